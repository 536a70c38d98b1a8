"""People in a cycle: carried on, told when lost, judged, and unknown without a scan."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from test_step import config, inputs  # noqa: F401

from backend.documents.snapshot import snapshot_document
from backend.pipeline.config import Config
from backend.pipeline.people import boxes_of, carried_on, following, present
from backend.pipeline.people_records import Missing, Seen, Sensor
from backend.pipeline.records import Snapshot
from backend.pipeline.step import State, initial, step
from backend.safety.people import Watch
from backend.safety.record import Concern, Level
from backend.tracking.records import HEIGHT, LENGTH, PX, PY, PZ, VX, VY, WIDTH, Status

FAR = (30.0, 0.0)


def seen(
    time: float,
    *people: tuple[int, float, float, float, float],
    status: Status = Status.CONFIRMED,
    lost: tuple[Missing, ...] = (),
    size: tuple[float, float, float] = (0.5, 0.5, 1.7),
) -> Seen:
    """people: (id, x, y, vx, vy)."""
    k = len(people)
    state = np.zeros((k, 11))
    for row, (_, x, y, vx, vy) in zip(state, people, strict=True):
        row[[PX, PY, PZ, VX, VY]] = x, y, 0.9, vx, vy
        row[[LENGTH, WIDTH, HEIGHT]] = size
    cov = np.tile(np.diag([0.01, 0.01, 0.04, 0.04]), (k, 1, 1))
    return Seen(
        time,
        time + 0.05,
        (Sensor("a", "lidar", time, (0.0, 0.0, 2.0), 20_000),),
        np.array([one[0] for one in people], dtype=np.int64),
        np.full(k, status, dtype=np.int64),
        state,
        cov,
        state[:, [PX, PY]] + state[:, [VX, VY]],
        np.tile(0.09 * np.eye(2), (k, 1, 1)),
        np.full(k, time),
        lost,
    )


def run(
    config: Config,  # noqa: F811
    *people: tuple[int, float, float, float, float],
    cycles: int = 25,
    scans: int = 100,
    driven: tuple[str, ...] = (),
    status: Status = Status.CONFIRMED,
    position: tuple[float, float] = FAR,
) -> Snapshot:
    """Machine a at the origin, b at `position`, scans every 0.1 s until `scans` were seen."""
    here, state = replace(config, people=Watch()), initial(config)
    for k in range(cycles):
        now = 100.0 + 0.02 * k
        scan = seen(now - 0.1, *people, status=status) if k % 5 == 0 and k // 5 < scans else None
        one = replace(inputs(here, now, b_position=position), people=scan, driven=driven)
        state, snapshot = step(state, one, now, here)
    return snapshot


def of(snapshot: Snapshot, machine: str = "a") -> Concern:
    return next(c for c in snapshot.concerns if c.name == "people" and c.machine == machine)


def test_a_site_without_lidars_has_no_such_concern(config: Config) -> None:  # noqa: F811
    _, snapshot = step(initial(config), inputs(config, 100.0, b_position=FAR), 100.0, config)
    assert snapshot.people is None
    assert not [c for c in snapshot.concerns if c.name == "people"]
    assert snapshot_document(snapshot, config)["people"] is None


def test_without_a_scan_nothing_may_move(config: Config) -> None:  # noqa: F811
    for scans, reason in ((0, "no LiDAR has been heard yet"), (1, "no LiDAR data for")):
        snapshot = run(config, cycles=60, scans=scans)
        concern = of(snapshot)
        assert concern.level is Level.UNKNOWN
        assert reason in concern.reason
        assert not concern.allowed.any()
        assert not concern.travel.any()


def test_nobody_near_is_clear(config: Config) -> None:  # noqa: F811
    snapshot = run(config)
    assert of(snapshot).level is Level.CLEAR
    assert of(snapshot).allowed.all()
    snapshot = run(config, (1, 0.0, 15.0, 0.0, 0.0))
    assert of(snapshot).level is Level.CLEAR


def test_nearer_is_slow_then_stop_and_away_stays_free(config: Config) -> None:  # noqa: F811
    body = run(config).machines["a"].body
    assert body is not None
    reach = float(body.boxes.corners()[..., 0].max())
    levels = []
    for gap in (4.0, 1.6, 0.4):
        concern = of(run(config, (7, reach + gap, 0.0, 0.0, 0.0)))
        levels.append(concern.level)
        assert concern.travel[0] == 1.0
        if gap < 2.0:
            assert concern.travel[1] < 1.0
            assert concern.evidence is not None
            assert concern.evidence.other == "person:P7"
    assert levels == [Level.CLEAR, Level.SLOW, Level.STOP]


def test_what_was_seen_once_does_not_stop_a_machine(config: Config) -> None:  # noqa: F811
    one = (7, 3.5, 0.0, 0.0, 0.0)
    assert of(run(config, one)).level > Level.CLEAR
    assert of(run(config, one, status=Status.TENTATIVE)).level is Level.CLEAR


def test_coming_people_count_in_braking(config: Config) -> None:  # noqa: F811
    coming = run(config, (7, 8.0, 0.0, -1.4, 0.0), driven=("a",))
    rows = of(coming).approach
    assert rows is not None
    assert {rows.others[k] for k in rows.index[:, 1]} == {"person:P7"}
    assert rows.closing.max() == pytest.approx(1.4, abs=0.01)
    leaving = of(run(config, (7, 6.0, 0.0, 1.4, 0.0), driven=("a",))).approach
    assert leaving is not None
    assert set(leaving.closing.tolist()) == {Watch().walking}
    assert of(run(config, (7, 8.0, 0.0, -1.4, 0.0))).approach is None


def test_tracks_are_carried_on_and_grow_uncertain() -> None:
    scan = seen(10.0, (3, 1.0, 2.0, 1.0, -0.5))
    now, soon = carried_on(scan, 10.0), carried_on(scan, 10.4)
    np.testing.assert_allclose(soon.position[0, :2], [1.4, 1.8])
    np.testing.assert_allclose(soon.position[0, 2], 0.9)
    assert soon.sigma[0] > now.sigma[0]
    assert soon.unseen[0] == pytest.approx(0.4)
    assert carried_on(scan, 99.0).position[0, 0] == pytest.approx(2.0)


def test_bodies_of_people_are_whole_however_little_was_seen() -> None:
    scan = seen(10.0, (3, 1.0, 2.0, 0.0, 0.0), size=(0.2, 0.1, 0.4))
    box = boxes_of(carried_on(scan, 10.0))
    low, high = box.corners()[0].min(axis=0), box.corners()[0].max(axis=0)
    assert (high - low)[0] >= 0.5
    assert (high - low)[2] >= 1.8
    assert low[2] <= 0.4


def test_who_was_lost_is_told_until_found(config: Config) -> None:  # noqa: F811
    gone = Missing(7, (3.5, 0.0, 0.9), 9.0, 12.0)
    state = following(State({}, {}).people, seen(12.0, lost=(gone,)), {}, 12.0)
    assert state.lost == (gone,)
    here = present(state, Watch(stale=100.0), 40.0)
    assert here.lost == (gone,)
    later = following(state, seen(60.0, (8, 20.0, 0.0, 0.0, 0.0)), {}, 60.0)
    assert later.lost == (gone,)
    back = seen(61.0, (8, 20.0, 0.0, 0.0, 0.0), (9, 3.0, 0.5, 0.0, 0.0))
    assert following(later, back, {}, 61.0).lost == ()
    assert following(later, None, {}, 75.0).lost == ()


def test_nobody_vanishes_when_the_process_that_follows_them_is_started_again() -> None:
    state = following(State({}, {}).people, seen(12.0, (7, 3.5, 0.0, 0.0, 0.0)), {}, 12.0)
    after = following(state, seen(13.0), {}, 13.0)
    assert [one.id for one in after.lost] == [7]
    assert after.lost[0].position == (3.5, 0.0, 0.9)


def test_a_place_of_somebody_lost_counts_as_taken_for_a_while(config: Config) -> None:  # noqa: F811
    here, state = replace(config, people=Watch()), initial(config)
    gone = Missing(7, (3.5, 0.0, 0.9), 99.0, 99.9)
    levels = []
    for k in range(700):
        now = 100.0 + 0.02 * k
        scan = seen(now - 0.05, lost=(gone,) if k == 0 else ()) if k % 5 == 0 else None
        one = replace(inputs(here, now, b_position=FAR), people=scan)
        if k in (25, 650):
            state, snapshot = step(state, one, now, here)
            levels.append(of(snapshot).level)
        else:
            state, _ = step(state, one, now, here)
    assert levels[0] > Level.CLEAR
    assert levels[1] is Level.CLEAR


def test_the_document_says_everything(config: Config) -> None:  # noqa: F811
    snapshot = run(config, (7, 4.5, 1.0, -1.0, 0.0))
    document = snapshot_document(snapshot, replace(config, people=Watch()))["people"]
    assert document["reason"] == ""
    assert 0.0 <= document["age"] < 0.3
    (track,) = document["tracks"]
    assert (track["id"], track["kind"], track["status"]) == (7, "person", "confirmed")
    assert len(document["risks"]) == 2
    near = next(risk for risk in document["risks"] if risk["machine"] == "a")
    assert near["level"] in ("SAFE", "WARNING", "EMERGENCY")
    assert math.isfinite(near["distance"])
    assert near["ttc"] < 5.0
