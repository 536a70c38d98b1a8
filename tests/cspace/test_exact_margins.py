"""Margins against fine sweeps, the reach image and regions against direct checks."""

from __future__ import annotations

import numpy as np
import pytest
from exact_scenes import judged, machine_named, scene
from scipy import ndimage

from backend.cspace import margins, regions
from backend.cspace.exact_points import touching
from backend.cspace.reach_image import ReachState, reach_image
from backend.machine.inverse import inverse
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.machine.sun_map import sun_angles
from backend.spatial.boxes import Boxes

NOTHING = Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))


def free_configurations(machine: Machine, obstacles: Boxes, count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low = np.maximum(machine.lower, -np.pi)
    q = rng.uniform(low, np.minimum(machine.upper, np.pi), (20 * count, 4))
    return q[~np.logical_or(*judged(machine, q, obstacles))][:count]


@pytest.fixture(scope="module", params=["mini", "askew"])
def machine(request: pytest.FixtureRequest) -> Machine:
    return machine_named(request.param)


def test_margins_agree_with_a_fine_sweep(machine: Machine) -> None:
    obstacles = scene(machine, 21)
    ended = 0
    for q in free_configurations(machine, obstacles, 12, 21):
        for k, margin in enumerate(margins.margins(machine, q, obstacles)):
            direction = np.zeros(4)
            direction[k // 2] = 1.0 if k % 2 else -1.0
            before = q + np.linspace(0.0, margin.free, 40)[:, None] * direction
            assert not np.logical_or(*judged(machine, before, obstacles)).any()
            if margin.hit is None:
                limit = machine.upper if k % 2 else machine.lower
                to_limit = abs(limit[k // 2] - q[k // 2])
                assert margin.free == pytest.approx(min(to_limit, 2 * np.pi))
                continue
            ended += 1
            after = (q + (margin.free + 1e-4) * direction)[None]
            against, itself = judged(machine, after, obstacles)
            assert itself[0] if margin.with_self else against[0]
    assert ended > 10


def test_margin_names_what_is_met_first() -> None:
    machine = machine_named("mini")
    q = np.array([0.0, 0.0, -0.6, 0.0])
    post = Boxes(np.array([[2.5, 1.5, 1.0]]), np.eye(3)[None], np.array([[0.1, 0.1, 3.0]]))
    toward = margins.margins(machine, q, post)[1]
    assert toward.hit == 0
    assert not toward.with_self
    assert toward.own is not None
    assert machine.part_of_body(toward.own) in ("boom", "stick", "bucket")
    assert 0.0 < toward.free < np.arctan2(1.5, 2.5)


def test_margins_shrink_with_inflation(machine: Machine) -> None:
    obstacles = scene(machine, 22)
    for q in free_configurations(machine, obstacles, 4, 22):
        built, grown = (margins.margins(machine, q, obstacles, eta) for eta in (0.0, 0.03))
        assert all(b.free <= a.free + 1e-6 for a, b in zip(built, grown, strict=True))


def test_a_direction_of_several_joints_ends_where_a_sweep_does(machine: Machine) -> None:
    obstacles = scene(machine, 23)
    rng = np.random.default_rng(23)
    for q in free_configurations(machine, obstacles, 8, 23):
        direction = rng.uniform(-1.0, 1.0, 4)
        margin = margins.margin(machine, q, direction, obstacles)
        before = q + np.linspace(0.0, margin.free, 60)[:, None] * direction
        assert not np.logical_or(*judged(machine, before, obstacles)).any()
        end = q + (margin.free + 1e-4 / np.abs(direction).max()) * direction
        beyond = (end < machine.lower).any() or (end > machine.upper).any()
        assert beyond or np.logical_or(*judged(machine, end[None], obstacles))[0]


def test_in_contact_the_margin_is_none() -> None:
    machine = machine_named("mini")
    q = np.array([0.0, 0.2, -1.0, 0.0])
    there = Boxes(end_point(machine, q)[None] - [0.2, 0.0, 0.0], np.eye(3)[None], np.ones((1, 3)))
    assert all(m.free == 0.0 for m in margins.margins(machine, q, there))


def test_margins_refuse_values_that_are_not_finite() -> None:
    with pytest.raises(ValueError, match="finite"):
        margins.margins(machine_named("mini"), np.array([0.0, np.nan, 0.0, 0.0]), NOTHING)


def test_points_agree_with_the_judge(machine: Machine) -> None:
    obstacles = scene(machine, 24)
    rng = np.random.default_rng(24)
    q = rng.uniform(-1.5, 1.5, (2000, 4))
    np.testing.assert_array_equal(touching(machine, q, obstacles), judged(machine, q, obstacles))


def test_reach_image_holds_height_and_attitude(machine: Machine) -> None:
    obstacles = scene(machine, 25)
    q = np.array([0.3, 0.4, -1.2, -0.3])
    image = reach_image(machine, q, {"partner": obstacles}, (24, 30))
    seen = set(np.unique(image.state).tolist())
    assert {ReachState.FREE, ReachState.COLLIDING, ReachState.OUT_OF_REACH} <= seen
    for s, r in np.argwhere(image.state <= ReachState.COLLIDING)[::7]:
        swing, reach = image.swing[s], image.reach[r]
        p = np.array([reach * np.cos(swing), reach * np.sin(swing), image.height])
        solution = inverse(machine, p + machine.arm.T_root_swing[:3, 3], image.attitude)
        tip = end_point(machine, solution.q) - machine.arm.T_root_swing[:3, 3]
        np.testing.assert_allclose(tip, p, atol=1e-9)
        assert sun_angles(machine, solution.q).sum() == pytest.approx(image.attitude)
        touches = np.logical_or(*judged(machine, solution.q[None], obstacles))[0]
        assert touches == (image.state[s, r] == ReachState.COLLIDING)


def test_reach_image_at_another_height_reaches_elsewhere() -> None:
    machine = machine_named("mini")
    q = np.array([0.3, 0.4, -1.2, -0.3])
    here = reach_image(machine, q, {}, (4, 60))
    high = reach_image(machine, q, {}, (4, 60), height=9.0)
    assert (here.state == ReachState.FREE).any()
    assert (high.state == ReachState.OUT_OF_REACH).all()


def test_regions_are_the_connected_parts() -> None:
    rng = np.random.default_rng(1)
    free = rng.uniform(size=(9, 8, 7, 20)) < 0.35
    found = regions.regions(free, (4, 4, 4, 4), wraps=False)
    labels, count = ndimage.label(free)
    assert len(found.sizes) == count
    np.testing.assert_array_equal(np.sort(np.bincount(labels.ravel())[1:])[::-1], found.sizes)
    pairs = np.unique(np.stack([labels.ravel(), found.labels.ravel()], axis=1), axis=0)
    assert len(pairs) == count + 1  # one of ours for each of theirs, and 0 for 0


def test_swing_closes_the_circle() -> None:
    free = np.zeros((12, 2, 2, 5), dtype=bool)
    free[:3] = free[9:] = True
    closed = regions.regions(free, (0, 0, 0, 0), wraps=True)
    opened = regions.regions(free, (0, 0, 0, 0), wraps=False)
    assert len(closed.sizes) == 1
    assert closed.share == closed.free == 0.5
    assert len(opened.sizes) == 2
    assert opened.share == 0.25
    assert opened.cut_off.tolist() == [2]


def test_a_blocked_cell_is_in_no_region() -> None:
    free = np.ones((3, 3, 3, 3), dtype=bool)
    free[1] = False
    found = regions.regions(free, (1, 1, 1, 1), wraps=False)
    assert (found.present, found.share) == (0, 0.0)
    assert found.cut_off.tolist() == [1, 2]


def test_cells_of_joint_values() -> None:
    lower, steps = np.array([-np.pi, 0.0, 0.0, 0.0]), np.array([0.1, 0.5, 0.5, 0.0])
    cell = regions.cell_of(lower, steps, (62, 4, 4, 1), np.array([-3.0, 0.7, 9.0, 5.0]))
    assert cell == (1, 1, 3, 0)
