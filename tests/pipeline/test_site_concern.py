"""Site bodies in a cycle: levels by distance, words, several pairs, and rows to brake by."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from test_step import config, inputs, run  # noqa: F401

from backend.collision.closest import all_pairs
from backend.documents.snapshot import snapshot_document
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.safety import site, words
from backend.safety.approach import Motion, approach_standing, standing_reach
from backend.safety.partner import Limits
from backend.safety.record import Concern, Level
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

MINI = load_machine("mini")


def walled(config: Config, x: float) -> Config:  # noqa: F811
    """A wall across the way of machine a, and far things."""
    centers = np.array([[x, 0.0, 1.5], [0.0, 60.0, 1.0]])
    half = np.array([[0.1, 10.0, 1.5], [1.0, 1.0, 1.0]])
    boxes = Boxes(centers, np.tile(np.eye(3), (2, 1, 1)), half)
    return replace(config, site=SiteBodies(boxes, ("wall", "shed/0")))


def of_site(snapshot: Snapshot, name: str = "a") -> Concern:
    return next(c for c in snapshot.concerns if c.name == "site" and c.machine == name)


def test_a_site_without_bodies_has_no_such_concern(config: Config) -> None:  # noqa: F811
    assert {c.name for c in run(config, 0.1, b_position=(30.0, 0.0))[-1].concerns} == {"partner"}


def test_closer_is_slow_then_stop_and_words_say_what(config: Config) -> None:  # noqa: F811
    found = []
    for x in np.arange(6.0, 4.0, -0.15):
        here = walled(config, float(x))
        snapshot = run(here, 0.3, b_position=(30.0, 0.0))[-1]
        concern, body = of_site(snapshot), snapshot.machines["a"].body
        assert body is not None
        exact = all_pairs(body.boxes, here.site.boxes).distance.min()
        found.append(concern.level)
        if concern.evidence is None:
            assert concern.level is Level.CLEAR
            continue
        assert concern.evidence.distance == pytest.approx(exact, abs=1e-9)
        if concern.level is Level.SLOW:
            assert concern.reason.endswith(f"{exact:.2f} m from wall")
            line = words.line(concern, config.labels)
            assert (
                line == f"SLOW · A {concern.evidence.own[2:].split('/')[0]} ↔ wall · {exact:.2f} m"
            )
            assert concern.travel[1] < concern.travel[0] == 1.0
            assert [a.concern.name for a in snapshot.alarms] == ["site"]
            assert snapshot_document(snapshot, here)["alarms"][0]["line"] == line
    assert found == sorted(found)
    assert {Level.CLEAR, Level.SLOW, Level.STOP} <= set(found)
    assert of_site(snapshot, "b").level is Level.CLEAR


def test_overlapping_it_may_move_out_and_not_in(config: Config) -> None:  # noqa: F811
    concern = of_site(run(walled(config, 4.0), 0.3, b_position=(30.0, 0.0))[-1])
    assert concern.level is Level.STOP
    assert concern.travel.tolist() == [1.0, 0.0]


def test_an_unknown_pose_is_unknown(config: Config) -> None:  # noqa: F811
    _, snapshot = step(initial(config), Inputs(), 100.0, walled(config, 9.0))
    concern = of_site(snapshot)
    assert concern.level is Level.UNKNOWN
    assert not concern.allowed.any()
    assert concern.reason.startswith("A ")


def test_only_who_is_driven_brakes_by_rows(config: Config) -> None:  # noqa: F811
    here, state = walled(config, 9.0), initial(config)
    for k in range(20):
        now = 100.0 + 0.02 * k
        one = replace(inputs(here, now, b_position=(30.0, 0.0)), driven=("a",))
        state, snapshot = step(state, one, now, here)
    rows = of_site(snapshot).approach
    assert rows is not None
    assert rows.share == 1.0
    assert not rows.closing.any()
    assert {rows.others[j] for j in rows.index[:, 1]} == {"site:wall"}
    assert of_site(snapshot, "b").approach is None


def test_fractions_are_makinens_and_the_most_restrictive_wins() -> None:
    margin = np.array([0.5, 0.35, 3.0])
    rows = site.Rows(
        np.array([0, 1, 0]), np.array([0, 0, 1]), margin + 0.1, margin, np.zeros((3, 2, 3)),
        np.array([[-1.0, 0.0], [1.0, -2.0], [-1.0, -1.0]]), np.array([-1.0, 0.0, 1.0]), np.zeros(3),
    )  # fmt: skip
    names = ("left:boom/0", "left:stick/0"), ("site:wall", "site:pole/2")
    found = site.judge("left", 2, rows, names, Limits(0.8, 0.2), 1.0)
    np.testing.assert_allclose(found.allowed, [[0.25, 0.5], [1.0, 0.25]])
    np.testing.assert_allclose(found.travel, [1.0, 0.5])
    assert found.level is Level.SLOW
    assert found.reason == "stick is 0.45 m from wall"


@pytest.mark.parametrize("seed", range(3))
def test_motions_within_the_rows_stay_clear_of_what_stands(seed: int) -> None:
    """As for partners: what uses at most the room of every row leaves the distance to keep."""
    rng, keep = np.random.default_rng(seed), 0.3
    boxes = Boxes(
        rng.uniform(-6, 6, (60, 3)) * np.array([1.0, 1.0, 0.4]),
        rotation.from_quaternion(rng.normal(size=(60, 4))),
        rng.uniform(0.02, 0.3, (60, 3)),
    )
    q = np.array([rng.uniform(-3, 3), 0.4, -1.2, -0.4])
    here = kinematics.body_boxes(MINI, kinematics.link_poses(MINI, q))
    gaps = all_pairs(here, boxes).distance.reshape(len(here), 60).min(axis=0)
    boxes = boxes.take(gaps > keep)
    names = tuple(f"site:{k}" for k in range(len(boxes)))
    motion = Motion(kinematics.link_poses(MINI, q), np.eye(4), np.zeros(4), np.zeros(3), 0.0)
    part = approach_standing(MINI, motion, boxes, names, keep, 0.1, 0.7)
    assert len(part.room)
    ended = 0
    for _ in range(20):
        s = np.append(rng.uniform(-1, 1, 4) * np.array([1.2, 0.5, 0.7, 0.7]), [0.0, 0.0])
        for t in np.linspace(0.0, 1.0, 21):
            used = part.slope @ (t * s) + 0.5 * np.einsum("k,rkl,l->r", t * s, part.bend, t * s)
            if (part.room + used).min() < 0.0:
                ended += 1
                break
            moved = kinematics.body_boxes(MINI, kinematics.link_poses(MINI, q + t * s[:4]))
            assert all_pairs(moved, boxes).distance.min() > keep - 0.02
    assert ended > 2


def test_nothing_beyond_the_reach_of_standing_bodies_has_a_way_to_be_touched() -> None:
    """A corner that every motion carries as far as it goes before it stands."""
    reach = standing_reach(MINI, 0.3, 0.7)
    rng = np.random.default_rng(2)
    before = kinematics.body_boxes(
        MINI, kinematics.link_poses(MINI, np.array([0, 0.4, -1.2, -0.4]))
    )
    from backend.safety.braking import accelerations, full_speeds, stopping_distance

    stop = stopping_distance(full_speeds(MINI), 0.7, accelerations(MINI))
    for _ in range(50):
        s = rng.uniform(-1, 1, 6) * stop
        yaw = (s[5] - s[4]) / MINI.tracks.gauge
        T = transform.make(rotation.rz(yaw), np.array([0.5 * (s[4] + s[5]), 0.0, 0.0]))
        q = np.array([0, 0.4, -1.2, -0.4]) + s[:4]
        after = kinematics.body_boxes(MINI, kinematics.link_poses(MINI, q, T))
        assert np.linalg.norm(after.corners() - before.corners(), axis=2).max() <= reach - 0.3
    assert math.isfinite(reach)
