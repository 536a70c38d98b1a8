"""The certified check: what it calls free is, at every instant between its samples."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.box_distance import lower_bounds
from backend.collision.closest import fcl_box, fcl_distance
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.planning.trajectory.records import Obstacles
from backend.planning.trajectory.sweep import OWN, make_sweep
from backend.spatial.boxes import Boxes

CLEAR = 0.1
MINI = load_machine("mini")
START = np.array([0.0, 0.6, -1.2, -0.4])


def some_boxes(seed: int) -> Boxes:
    rng = np.random.default_rng(seed)
    centers = rng.uniform([-4, -4, 0.2], [4, 4, 3.5], (6, 3))
    return Boxes(centers, np.repeat(np.eye(3)[None], 6, axis=0), rng.uniform(0.05, 0.4, (6, 3)))


@pytest.mark.parametrize("seed", range(8))
def test_free_is_free_between_samples_and_blocked_is_too_near(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = some_boxes(seed)
    sweep = make_sweep(MINI, Obstacles(boxes, tuple("abcdef"), ground=False), CLEAR)
    end = START + rng.uniform(-1, 1, 4) * [2.5, 0.4, 0.5, 0.5]
    hit = sweep.blocked(np.stack([START, end]))
    sides = zip(boxes.centers, boxes.half_extents, strict=True)
    fixed = [fcl_box(c, np.eye(3), h) for c, h in sides]
    nearest = np.inf
    moving = np.flatnonzero(MINI.body_joints.any(axis=1))
    for t in np.linspace(0.0, 1.0, 200):
        links = body_boxes(MINI, link_poses(MINI, START + t * (end - START))).take(moving)
        near = np.argwhere(lower_bounds(links, boxes) < 2.0 * CLEAR)
        for i, j in near:
            body = fcl_box(links.centers[i], links.rotations[i], links.half_extents[i])
            nearest = min(nearest, fcl_distance(body, fixed[j]))
    if hit is None:
        assert nearest >= 0.8 * CLEAR - 1e-6
    elif not hit.startswith("its own"):
        # python-fcl may over-estimate a little, and looks at 200 instants only.
        assert nearest < CLEAR + 0.03


@pytest.mark.parametrize("seed", range(8))
def test_every_pair_keeps_its_distance_or_the_named_one_does_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    made = make_sweep(MINI, Obstacles(some_boxes(seed), tuple("abcdef"), ground=True), CLEAR)
    sweep = made.relaxed(START)
    end = START + rng.uniform(-1, 1, 4) * [2.5, 0.4, 0.5, 0.5]
    way = START + np.linspace(0.0, 1.0, 400)[:, None] * (end - START)
    found = np.array([sweep.distances(q) for q in way])
    hit = sweep.blocked(np.stack([START, end]))
    if hit is None:
        assert (found >= sweep.pairs[3]).all()
        assert (found[[0, -1]] >= sweep.pairs[2]).all()
    else:
        named = [k for k, name in enumerate(sweep.names) if name == hit]
        assert (found < sweep.pairs[2] + 0.01)[:, named].any()


def test_some_are_free_and_some_are_not() -> None:
    found = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        sweep = make_sweep(MINI, Obstacles(some_boxes(seed), tuple("abcdef"), False), CLEAR)
        end = START + rng.uniform(-1, 1, 4) * [2.5, 0.4, 0.5, 0.5]
        found.append(sweep.blocked(np.stack([START, end])) is None)
    assert any(found)
    assert not all(found)


def test_the_ground_and_own_bodies_are_obstacles() -> None:
    sweep = make_sweep(MINI, Obstacles(), CLEAR)
    low = START.copy()
    low[1] = -0.6
    assert sweep.blocked(np.stack([START, low])) == "the ground"
    assert make_sweep(MINI, Obstacles(ground=False), CLEAR).blocked(np.stack([START, low])) is None
    folded = np.array([0.0, -0.87, -2.6, -2.1])
    without = make_sweep(MINI, Obstacles(ground=False), CLEAR)
    hit = without.blocked(np.stack([START, folded]))
    assert hit is not None
    assert hit.startswith("its own")
    assert min(d for d, _ in without.near(folded)) < OWN


def test_a_start_that_is_near_may_be_left_but_not_neared() -> None:
    tip = body_boxes(MINI, link_poses(MINI, START))
    foremost = tip.corners()[:, :, 0].max()
    wall = Boxes(np.array([[foremost + 0.55, 0.0, 1.0]]), np.eye(3)[None], np.full((1, 3), 0.5))
    sweep = make_sweep(MINI, Obstacles(wall, ("wall",)), 0.2)
    assert [name for _, name in sweep.near(START)] == ["wall"]
    relaxed = sweep.relaxed(START)
    assert not relaxed.near(START)
    back = START + np.array([0.0, 0.2, -0.3, 0.1])
    ahead = START + np.array([0.0, 0.0, 0.15, -0.15])
    assert relaxed.blocked(np.stack([START, back])) is None
    assert relaxed.blocked(np.stack([START, ahead])) == "wall"


def test_distances_along_are_the_least_of_single_ones() -> None:
    boxes = some_boxes(1)
    sweep = make_sweep(MINI, Obstacles(boxes, tuple("abcdef"), ground=True), CLEAR)
    q = START + np.linspace(0, 1, 12)[:, None] * [1.5, 0.3, -0.3, 0.2]
    every = np.array([sweep.distances(p) for p in q])
    own = np.array([name.startswith("its own") for name in sweep.names])
    outer = np.array([name in "abcdef" for name in sweep.names])
    ground = np.array([name == "the ground" for name in sweep.names])
    kinds = [every[:, kind].min() for kind in (own, outer, ground)]
    np.testing.assert_allclose(sweep.least_along(q), kinds, atol=1e-9)
