"""One cycle: fused poses to distances, concerns and alarms; silence is never safe."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from backend.documents.snapshot import snapshot_document
from backend.fusion.pose import Validity
from backend.fusion.samples import ClockSample, Fix, FixSample, HeadingSample, JointSample
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.images import SunParameters, ordered_pairs, pair_image
from backend.pipeline.records import ImageStamp, Inputs, Notice, Snapshot
from backend.pipeline.step import initial, step
from backend.safety.partner import Limits
from backend.safety.record import Level
from backend.shell.app.models import SnapshotModel
from backend.shell.app.wire import dumps
from backend.site.site import load_site

Q = {"a": (0.0, 0.5, -1.0, 0.5), "b": (0.0, 0.5, -1.0, 0.5)}


@pytest.fixture(scope="module")
def config() -> Config:
    site = load_site("sun2020-simulation")
    machine = load_machine("mini")
    return Config(
        frame=site.frame,
        machines={"a": machine, "b": machine},
        labels={"a": "A", "b": "B"},
        own=("a", "b"),
        limits=Limits(0.8, 0.2),
        eta=0.1,
        mode="LIVE",
    )


def inputs(
    config: Config,
    now: float,
    b_position: tuple[float, float] = (8.0, 0.0),
    silent: tuple[str, ...] = (),
    q: dict[str, tuple[float, ...]] = Q,
) -> Inputs:
    samples = []
    stamp = now - 0.03
    for name, position in (("a", (0.0, 0.0)), ("b", b_position)):
        if name in silent:
            continue
        machine = config.machines[name]
        heading = 0.0 if name == "a" else math.pi
        # The heading sensor and the antenna sit where the machine's description says.
        from backend.machine import kinematics
        from backend.spatial import rotation, transform

        values = np.array(q[name])
        T = transform.make(rotation.rz(heading), np.array([*position, 0.0]))
        poses = kinematics.link_poses(machine, values, T)
        antenna = transform.apply(poses[machine.antenna.link], machine.antenna.position[None])[0]
        turned = heading + (values[0] if machine.heading_of == "upper" else 0.0)
        latitude, longitude, height = config.frame.to_geodetic(antenna)
        samples += [
            JointSample(
                *(name, stamp, now, ("swing", "boom", "stick", "bucket"), values, np.zeros(4))
            ),
            FixSample(
                *(name, stamp, now, latitude, longitude, height, np.eye(3) * 1e-4, Fix.RTK_FIXED)
            ),
            HeadingSample(name, stamp, now, turned + machine.heading_offset, 1e-6),
        ]
    return Inputs(tuple(samples))


def run(config: Config, seconds: float, **kwargs: object) -> list[Snapshot]:
    state, found = initial(config), []
    for k in range(round(seconds / 0.02)):
        now = 100.0 + 0.02 * k
        state, snapshot = step(state, inputs(config, now, **kwargs), now, config)  # type: ignore[arg-type]
        found.append(snapshot)
    return found


def test_before_any_input_everything_is_unknown(config: Config) -> None:
    _, snapshot = step(initial(config), Inputs(), 100.0, config)
    assert all(m.pose.validity is Validity.UNKNOWN for m in snapshot.machines.values())
    assert all(m.body is None for m in snapshot.machines.values())
    assert math.isnan(snapshot.pairs[0].distance)
    assert [c.level for c in snapshot.concerns] == [Level.UNKNOWN, Level.UNKNOWN]
    assert not any(c.allowed.any() or c.travel.any() for c in snapshot.concerns)


def test_poses_are_where_the_sensors_say(config: Config) -> None:
    snapshot = run(config, 0.5)[-1]
    for name, position, yaw in (("a", (0, 0), 0.0), ("b", (8, 0), math.pi)):
        pose = snapshot.machines[name].pose
        assert pose.validity is Validity.VALID
        np.testing.assert_allclose(pose.position, [*position, 0], atol=1e-3)
        assert math.cos(pose.yaw - yaw) == pytest.approx(1.0, abs=1e-6)
        np.testing.assert_allclose(pose.joints, Q[name], atol=1e-9)


def test_far_apart_is_clear_and_without_alarm(config: Config) -> None:
    snapshot = run(config, 0.5, b_position=(12.0, 0.0))[-1]
    assert [c.level for c in snapshot.concerns] == [Level.CLEAR, Level.CLEAR]
    assert snapshot.alarms == ()
    assert snapshot.pairs[0].distance > 1.0


def test_very_far_apart_costs_no_distance_but_a_bound(config: Config) -> None:
    pair = run(config, 0.3, b_position=(60.0, 0.0))[-1].pairs[0]
    assert not pair.near
    assert pair.points is None
    assert 20.0 < pair.distance < 60.0


def test_closer_is_slow_then_stop(config: Config) -> None:
    levels = []
    for x in np.arange(11.0, 7.0, -0.4):
        snapshot = run(config, 0.2, b_position=(float(x), 0.0))[-1]
        levels.append(snapshot.concerns[0].level)
        if snapshot.concerns[0].level is Level.SLOW:
            # Reaching further approaches more than drawing the stick in does.
            stick_out, stick_in = snapshot.concerns[0].allowed[2][::-1]
            assert stick_out < stick_in
    assert levels == sorted(levels)
    assert {Level.CLEAR, Level.SLOW, Level.STOP} <= set(levels)


def test_a_silent_machine_is_stale_within_its_limit_and_clearance_unknown(config: Config) -> None:
    state = initial(config)
    for k in range(50):
        state, snapshot = step(state, inputs(config, 100.0 + 0.02 * k), 100.0 + 0.02 * k, config)
    assert snapshot.machines["b"].pose.validity is Validity.VALID
    last = 100.0 + 0.02 * 49
    stale_at = None
    for k in range(1, 60):
        now = last + 0.02 * k
        state, snapshot = step(state, inputs(config, now, silent=("b",)), now, config)
        if snapshot.machines["b"].pose.validity is not Validity.VALID:
            stale_at = now
            break
    assert stale_at is not None
    assert stale_at - last <= 0.2 + 1e-9
    assert math.isnan(snapshot.pairs[0].distance)
    assert snapshot.concerns[0].level is Level.UNKNOWN
    assert snapshot.alarms[0].active
    assert "B" in snapshot.alarms[0].concern.reason
    now += 0.02
    for k in range(60):
        state, snapshot = step(state, inputs(config, now + 0.02 * k), now + 0.02 * k, config)
    assert snapshot.machines["b"].pose.validity is Validity.VALID
    assert not math.isnan(snapshot.pairs[0].distance)


def test_same_input_gives_the_same_snapshots(config: Config) -> None:
    first, second = run(config, 0.6), run(config, 0.6)
    for a, b in zip(first, second, strict=True):
        assert dumps(snapshot_document(a, config)) == dumps(snapshot_document(b, config))


def test_only_own_machines_are_judged(config: Config) -> None:
    only_a = dataclasses.replace(config, own=("a",))
    snapshot = run(only_a, 0.3)[-1]
    assert [c.machine for c in snapshot.concerns] == ["a"]
    assert [own for own, _ in ordered_pairs(snapshot, only_a)] == ["a"]
    assert set(snapshot.machines) == {"a", "b"}


def test_three_machines_have_three_pairs_and_six_images(config: Config) -> None:
    machine = config.machines["a"]
    three = dataclasses.replace(
        config,
        machines={"a": machine, "b": machine, "c": machine},
        labels={"a": "A", "b": "B", "c": "C"},
        own=("a", "b", "c"),
    )
    state = initial(three)
    for k in range(20):
        now = 100.0 + 0.02 * k
        both = inputs(three, now).samples
        moved = inputs(three, now, b_position=(4.0, 8.0)).samples
        third = tuple(dataclasses.replace(s, machine="c") for s in moved if s.machine == "b")
        state, snapshot = step(state, Inputs(both + third), now, three)
    assert {(p.a, p.b) for p in snapshot.pairs} == {("a", "b"), ("a", "c"), ("b", "c")}
    assert len(ordered_pairs(snapshot, three)) == 6


def test_counts_of_refused_messages_add_up(config: Config) -> None:
    state = initial(config)
    stamp = ImageStamp("a<-b", "sun", 99.0, 99.1, 0.1)
    for _ in range(3):
        state, snapshot = step(
            state,
            Inputs((), (stamp,), (("a/joint_states", 2),), (("x", 1),), 4),
            100.0,
            config,
        )
    assert snapshot.health.malformed == {"a/joint_states": 6}
    assert snapshot.health.foreign == {"x": 3}
    assert snapshot.health.lost == 12
    assert snapshot.health.images == {"sun a<-b": stamp}


def test_the_document_is_what_the_api_describes(config: Config) -> None:
    import json

    snapshot = run(config, 0.3)[-1]
    document = json.loads(dumps(snapshot_document(snapshot, config)))
    SnapshotModel.model_validate(document)


def test_images_are_stamped_with_the_state_they_show(config: Config) -> None:
    snapshot = run(config, 0.3)[-1]
    image = pair_image(snapshot, config, "a", "b", SunParameters(20, 20, 0.1))
    assert image.key == "a<-b"
    assert image.state_time == snapshot.state_time
    assert image.sun.current.d == pytest.approx(snapshot.machines["a"].body.reach, abs=1e-6)


def test_notices_keep_the_time_since_when_they_hold(config: Config) -> None:
    state = initial(config)
    full, slow = Notice("recording", "disk full"), Notice("recording", "disk slow")
    other = Notice("other", "something else")
    told = [(), (full,), (slow, other), (other,), (full,)]
    found = []
    for cycle, notices in enumerate(told):
        state, snapshot = step(state, Inputs(notices=notices), 10.0 + cycle, config)
        found.append([(n.key, n.line, n.since) for n in snapshot.notices])
        assert snapshot_document(snapshot, config)["notices"] == [
            {"key": key, "line": line, "since": since} for key, line, since in found[-1]
        ]
        # Beside the alarms, which stay what they are.
        assert {alarm.concern.level for alarm in snapshot.alarms} == {Level.UNKNOWN}
    assert found == [
        [],
        [("recording", "disk full", 11.0)],
        [("recording", "disk slow", 11.0), ("other", "something else", 12.0)],
        [("other", "something else", 12.0)],
        [("recording", "disk full", 14.0)],
    ]


def test_braking_is_judged_only_where_somebody_drives(config: Config) -> None:
    def last(changed: Config, driven: tuple[str, ...] = (), clocks: bool = True) -> Snapshot:
        state = initial(changed)
        for k in range(30):
            now = k * 0.02
            told = dataclasses.replace(inputs(changed, now), driven=driven)
            if clocks and k % 10 == 0:
                trips = tuple(ClockSample(m, now - 0.002, now - 0.001, now) for m in ("a", "b"))
                told = dataclasses.replace(told, samples=trips + told.samples)
            state, snapshot = step(state, told, now, changed)
        return snapshot

    watched = last(config)
    assert all(concern.approach is None for concern in watched.concerns)
    driving = dataclasses.replace(config, margins=False)
    driven = last(driving, ("a", "b"))
    assert driven.margins == {}
    assert len(driven.concerns) == 2
    for concern in driven.concerns:
        part = concern.approach
        assert part is not None
        assert len(part.room) > 0
        # p_l, and what both poses may be wrong by, are taken off.
        assert part.room.min() <= driven.pairs[0].distance - config.limits.stop_below
        assert part.age == pytest.approx(0.03, abs=0.01)
    # Everything else is the same, and documents do not carry it.
    assert [c.level for c in driven.concerns] == [c.level for c in watched.concerns]
    for a, b in zip(driven.concerns, watched.concerns, strict=True):
        np.testing.assert_array_equal(a.allowed, b.allowed)
    dumps({"snapshot": snapshot_document(driven, config)})

    # Without round trips to the machines' clocks the age is not known: nothing may move.
    blind = last(driving, ("a",), clocks=False)
    ages = [c for c in blind.concerns if c.name == "age"]
    assert [c.machine for c in ages] == ["a"]
    assert all(c.level is Level.UNKNOWN and not c.allowed.any() for c in ages)


def test_a_machine_alone_on_its_site_is_unknown_until_it_is_heard(config: Config) -> None:
    alone = dataclasses.replace(config, machines={"a": config.machines["a"]}, own=("a",))
    state, snapshot = step(initial(alone), Inputs(driven=("a",)), 100.0, alone)
    assert [c.level for c in snapshot.concerns if c.name == "partner"] == [Level.UNKNOWN]
    for k in range(1, 10):
        now = 100.0 + 0.02 * k
        heard = dataclasses.replace(inputs(alone, now, silent=("b",)), driven=("a",))
        state, snapshot = step(state, heard, now, alone)
    assert [c.level for c in snapshot.concerns if c.name == "partner"] == [Level.CLEAR]
    _, snapshot = step(state, Inputs(driven=("a",)), 103.0, alone)
    assert [c.level for c in snapshot.concerns if c.name == "partner"] == [Level.UNKNOWN]
