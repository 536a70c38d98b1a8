from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fusion_world import Motion, World, arrival, feed

from backend.fusion.rig import Rig
from backend.fusion.samples import (
    AttitudeSample,
    ClockSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    ProjectedSample,
    Sample,
)
from backend.fusion.streams import CAPACITY, SPAN, Streams, ingest

NAMES = ("swing_joint", "boom_joint", "stick_joint", "bucket_joint")
GOOD = np.array([0.1, 0.5, -1.2, 0.3])


def joint(stamp: float, **changes: Any) -> JointSample:
    sample = JointSample("left", stamp, stamp + 0.05, NAMES, GOOD, np.zeros(0))
    return replace(sample, **changes)


def test_every_sample_lands_in_its_stream(rig: Rig) -> None:
    world = World(rig, imus=("base", "boom_link"), skew=3.0)
    streams = feed(rig, world.samples(0.0, 2.0))
    assert streams.joints.received == 200
    assert streams.position.received == streams.heading.received == 40
    assert set(streams.attitudes) == {"base", "boom_link"}
    assert all(buffer.rejected == 0 for buffer in streams.buffers.values())
    assert streams.joints.rate(2.05) == pytest.approx(100.0, rel=0.02)
    assert streams.position.rate(2.05) == pytest.approx(20.0, rel=0.06)


def test_rate_falls_to_zero_when_a_stream_stops(rig: Rig) -> None:
    streams = feed(rig, World(rig).samples(0.0, 2.0))
    assert streams.joints.rate(3.05) == pytest.approx(50.0, rel=0.05)
    assert streams.joints.rate(5.0) == 0.0


def test_duplicates_and_late_samples_are_applied_at_most_once(rig: Rig) -> None:
    clean = World(rig, motion=Motion(rates=(0.3, 0.0, 0.0, 0.0))).samples(0.0, 3.0)
    generator = random.Random(3)
    mixed: list[Sample] = []
    for sample in clean:
        mixed.append(sample)
        if generator.random() < 0.1:
            mixed.append(sample)
        if generator.random() < 0.1 and len(mixed) > 3:
            mixed.insert(len(mixed) - 3, mixed.pop())
    streams = Streams()
    newest = -math.inf
    for sample in mixed:
        streams = ingest(rig, streams, sample)
        stamps = [entry.stamp for entry in streams.joints.entries]
        assert stamps == sorted(set(stamps))
        assert not stamps or stamps[-1] >= newest
        newest = stamps[-1] if stamps else newest
    sent = {s.stamp for s in clean if isinstance(s, JointSample)}
    assert streams.joints.rejected > 0
    assert streams.joints.received - streams.joints.rejected <= len(sent)
    assert {entry.stamp for entry in streams.joints.entries} <= sent
    assert streams.joints.entries[-1].stamp == max(sent)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e308, -1e308])
def test_nonsense_is_rejected_and_counted(rig: Rig, bad: float) -> None:
    world = World(rig)
    before = feed(rig, world.samples(0.0, 1.0))
    t = 1.0
    wrong: list[tuple[str, Sample]] = []
    for k in range(4):
        values = GOOD.copy()
        values[k] = bad
        wrong.append(("joints", joint(t, position=values)))
        wrong.append(("joints", joint(t, velocity=values)))
    wrong += [("joints", joint(bad)), ("joints", joint(t, arrival=bad))]
    gnss = world.gnss(t)
    for field in ("latitude", "longitude", "altitude", "stamp", "arrival"):
        wrong.append(("position", replace(gnss, **{field: bad})))
    wrong.append(("position", replace(gnss, covariance=np.full((3, 3), bad))))
    projected = ProjectedSample("left", t, t, np.full(3, bad), np.zeros((3, 3)))
    wrong.append(("position", projected))
    heading = world.heading(t)
    wrong += [("heading", replace(heading, heading=bad)), ("heading", replace(heading, stamp=bad))]
    wrong.append(("heading", replace(heading, variance=bad)))
    imu = world.imu(t, "base")
    wrong.append(("imu/base", replace(imu, orientation=np.array([1.0, bad, 0.0, 0.0]))))
    wrong.append(("imu/base", replace(imu, rate=np.array([0.0, bad, 0.0]))))
    for key, sample in wrong:
        after = ingest(rig, before, sample)
        old = before.buffers.get(key)
        assert after.buffers[key].rejected == 1, (key, sample)
        assert after.buffers[key].entries == (old.entries if old else ())


@pytest.mark.parametrize(
    "sample",
    [
        joint(0.0, names=("a", "b", "c", "d")),
        joint(0.0, names=NAMES[1:], position=GOOD[1:]),
        joint(0.0, names=(*NAMES[:3], "swing_joint")),
        joint(0.0, names=NAMES[:3]),
        joint(0.0, velocity=np.zeros(2)),
        joint(0.0, position=GOOD.reshape(2, 2)),
        joint(0.0, position=np.array([0.1, 0.5, 2.0, 0.3])),
        joint(0.0, velocity=np.array([0.0, 20.0, 0.0, 0.0])),
        joint(0.0, names=(), position=np.zeros(0)),
    ],
)
def test_wrong_joint_messages_are_rejected(rig: Rig, sample: JointSample) -> None:
    streams = ingest(rig, Streams(), sample)
    assert (streams.joints.received, streams.joints.rejected) == (1, 1)


def test_names_may_be_roles_in_any_order_with_others_between(rig: Rig) -> None:
    names = ("bucket", "extra", "stick", "boom", "swing")
    position = np.array([0.3, 99.0, -1.2, 0.5, 0.1])
    streams = ingest(rig, Streams(), joint(0.0, names=names, position=position))
    assert streams.joints.entries[0].value == tuple(GOOD.tolist())


def test_bad_covariances_variances_and_quaternions(rig: Rig) -> None:
    world = World(rig)
    negative = replace(world.gnss(0.0), covariance=-np.eye(3))
    assert ingest(rig, Streams(), negative).position.rejected == 1
    wrong_shape = replace(world.gnss(0.0), covariance=np.eye(2))
    assert ingest(rig, Streams(), wrong_shape).position.rejected == 1
    unknown = replace(world.heading(0.0), variance=-1.0)
    assert ingest(rig, Streams(), unknown).heading.rejected == 1
    short = replace(world.imu(0.0, "base"), orientation=np.array([0.1, 0.0, 0.0, 0.0]))
    assert ingest(rig, Streams(), short).attitudes["base"].rejected == 1
    stranger = replace(world.imu(0.0, "base"), link="ripper")
    streams = ingest(rig, Streams(), stranger)
    assert (streams.strangers, streams.attitudes) == (1, {})


def test_far_away_positions_are_rejected(rig: Rig) -> None:
    sample = replace(World(rig).gnss(0.0), latitude=10.0)
    assert ingest(rig, Streams(), sample).position.rejected == 1


def test_a_jump_that_no_machine_can_make_is_an_outlier_until_it_stays(rig: Rig) -> None:
    streams = feed(rig, [joint(0.01 * k) for k in range(10)])
    moved = GOOD + np.array([0.0, 0.8, 0.0, 0.0])
    streams = ingest(rig, streams, joint(0.10, position=moved))
    assert streams.joints.rejected == 1
    streams = ingest(rig, streams, joint(0.11))
    assert streams.joints.rejected == 1
    for k in range(12, 80):
        streams = ingest(rig, streams, joint(0.01 * k, position=moved))
    assert streams.joints.entries[-1].value[1] == pytest.approx(1.3)


def test_swing_may_wrap(rig: Rig) -> None:
    streams = Streams()
    for k in range(50):
        swing = (3.0 + 0.02 * k + math.pi) % (2 * math.pi) - math.pi
        values = np.array([swing, *GOOD[1:]])
        streams = ingest(rig, streams, joint(0.05 * k, position=values))
    assert streams.joints.rejected == 0


def test_no_fix_is_known_at_once(rig: Rig) -> None:
    world = World(rig)
    streams = feed(rig, world.samples(0.0, 1.0))
    lost = replace(world.gnss(1.0), fix=Fix.NONE, latitude=math.nan)
    streams = ingest(rig, streams, lost)
    assert streams.no_fix == pytest.approx(1.0)
    assert streams.position.rejected == 0
    assert ingest(rig, streams, lost).position.rejected == 1


@pytest.mark.parametrize("clock", [True, False])
def test_a_stray_future_stamp_blocks_nothing(rig: Rig, clock: bool) -> None:
    world = World(rig, clock=clock, skew=-4.0)
    streams = feed(rig, world.samples(0.0, 1.0))
    stray = replace(world.joint(1.0), stamp=world.joint(1.0).stamp + 1000.0)
    streams = ingest(rig, streams, stray)
    assert streams.joints.rejected == 1
    streams = ingest(rig, streams, world.joint(1.01))
    assert streams.joints.rejected == 1
    assert streams.last_step == -math.inf


@pytest.mark.parametrize("jump", [5.0, -5.0])
def test_a_stepped_clock_recovers_without_round_trips(rig: Rig, jump: float) -> None:
    before = World(rig, clock=False, skew=2.0)
    after = replace(before, skew=2.0 + jump)
    streams = feed(rig, before.samples(0.0, 3.0))
    seen = math.inf
    for sample in after.samples(3.0, 6.0):
        streams = ingest(rig, streams, sample)
        if streams.last_step > 0.0:
            seen = min(seen, arrival(sample))
    assert seen - 3.0 <= 1.0
    offset = streams.offset(6.0)
    assert offset is not None
    assert offset[0] == pytest.approx(2.0 + jump + before.latency)
    assert streams.joints.rate(6.0) == pytest.approx(100.0, rel=0.05)


def test_memory_is_bounded(rig: Rig) -> None:
    streams = Streams()
    for k in range(3000):
        streams = ingest(rig, streams, joint(0.001 * k))
    assert len(streams.joints.entries) == CAPACITY
    for k in range(1000):
        streams = ingest(rig, streams, joint(3.0 + 0.05 * k))
    stamps = [entry.stamp for entry in streams.joints.entries]
    assert stamps[-1] - stamps[0] <= SPAN


def test_fuzzed_samples_never_raise_and_never_grow(rig: Rig) -> None:
    generator = random.Random(7)
    odd = [0.0, -1.0, 1e-300, 1e9, 1e308, -1e308, math.nan, math.inf, -math.inf, 0.5, 3.0]

    def number() -> float:
        return generator.choice(odd) if generator.random() < 0.5 else generator.gauss(0.0, 100.0)

    def array(*shape: int) -> np.ndarray[Any, Any]:
        return np.array([number() for _ in range(math.prod(shape))]).reshape(shape)

    streams = Streams()
    for _ in range(4000):
        n = generator.randrange(6)
        names = tuple(generator.choice([*NAMES, "x", ""]) for _ in range(n))
        sample: Sample = generator.choice(
            [
                JointSample("left", number(), number(), names, array(n), array(n)),
                FixSample(
                    "left", number(), number(), number(), number(), number(), array(3, 3), Fix.SBAS
                ),
                FixSample("left", number(), number(), 0.0, 0.0, 0.0, array(3, 3), Fix.NONE),
                ProjectedSample("left", number(), number(), array(3), array(3, 3)),
                HeadingSample("left", number(), number(), number(), number()),
                AttitudeSample("left", number(), number(), f"l{n}", array(4), array(3), number()),
                ClockSample("left", number(), number(), number()),
            ]
        )
        streams = ingest(rig, streams, sample)
    assert set(streams.buffers) <= {"joints", "position", "heading", "imu/base"}
    assert all(len(buffer.entries) <= CAPACITY for buffer in streams.buffers.values())
