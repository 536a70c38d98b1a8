"""The least distance along a motion: as if python-fcl were asked in every place."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.box_distance import lower_bounds, pair_distances
from backend.collision.peer import FclScene
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

MINI = load_machine("mini")


def some(rng: np.random.Generator, count: int, spread: float) -> Boxes:
    turns = rotation.from_quaternion(rng.normal(size=(count, 4)))
    return Boxes(
        rng.uniform(-spread, spread, (count, 3)), turns, rng.uniform(0.02, 0.6, (count, 3))
    )


def moving(seed: int, places: int) -> Array:
    """(m, links, 4, 4) along a random motion."""
    rng = np.random.default_rng(seed)
    a, b = (rng.uniform(-1.5, 1.5, 4) for _ in range(2))
    return link_poses(MINI, a + np.linspace(0.0, 1.0, places)[:, None] * (b - a))


@pytest.mark.parametrize("seed", range(6))
def test_least_along_a_motion_is_that_of_every_place(seed: int) -> None:
    scene = FclScene(some(np.random.default_rng(seed), 12, 6.0))
    T = moving(seed, 150)
    every = [scene.by_manager(body_boxes(MINI, one)).min() for one in T]
    asked = (MINI.bodies, MINI.body_link_index, T)
    assert scene.least_along(*asked) == pytest.approx(min(every), abs=1e-9)
    np.testing.assert_allclose(scene.each_along(*asked), every, atol=1e-9)


def test_a_moment_of_contact_between_far_ends_is_found() -> None:
    half = np.array([[0.1, 0.1, 0.1]])
    scene = FclScene(Boxes(np.array([[0.0, 0.25, 0.0]]), np.eye(3)[None], half))
    T = np.tile(np.eye(4), (400, 1, 1, 1))
    T[:, 0, 0, 3] = np.linspace(-5.0, 5.0, 400)
    small, large = (Boxes(np.zeros((1, 3)), np.eye(3)[None], k * half) for k in (1.0, 2.0))
    frames = np.zeros(1, np.int64)
    assert scene.least_along(small, frames, T) == pytest.approx(0.05, abs=1e-6)
    assert scene.least_along(large, frames, T) == 0.0
    assert scene.least_along(small, frames, T[:1]) > 4.0


@pytest.mark.parametrize("turn", [0.002, 0.5])
def test_a_long_box_that_turns_about_its_middle_is_found_where_its_end_passes(turn: float) -> None:
    scene = FclScene(Boxes(np.array([[0.0, 3.2, 0.0]]), np.eye(3)[None], np.full((1, 3), 0.1)))
    angles = np.arange(0.0, np.pi, turn)
    T = np.tile(np.eye(4), (len(angles), 1, 1, 1))
    T[:, 0, :3, :3] = rotation.rz(angles)
    box = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.array([[3.0, 0.05, 0.05]]))
    every = [scene.by_manager(Boxes(box.centers, R, box.half_extents)) for R in T[..., :3, :3]]
    least = scene.least_along(box, np.zeros(1, np.int64), T)
    assert least == pytest.approx(float(np.min(every)), abs=1e-9)


def test_a_lower_bound_is_never_above_the_distance() -> None:
    rng = np.random.default_rng(3)
    a, b = some(rng, 60, 1.5), some(rng, 40, 1.5)
    i, j = (index.ravel() for index in np.meshgrid(range(60), range(40), indexing="ij"))
    distance, _ = pair_distances(a, b, i, j)
    bound = lower_bounds(a, b)[i, j]
    assert (bound <= np.maximum(distance, 0.0) + 1e-12).all()
    assert (bound > 0.9 * distance)[distance > 0.0].mean() > 0.4
    assert (bound[distance < 0.0] == 0.0).all()
