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


def moving(seed: int, places: int) -> tuple[Array, Array, Array]:
    """Half extents (b, 3), centers (m, b, 3), rotations (m, b, 3, 3) along a random motion."""
    rng = np.random.default_rng(seed)
    a, b = (rng.uniform(-1.5, 1.5, 4) for _ in range(2))
    q = a + np.linspace(0.0, 1.0, places)[:, None] * (b - a)
    at = [body_boxes(MINI, T) for T in link_poses(MINI, q)]
    return (
        at[0].half_extents,
        np.stack([boxes.centers for boxes in at]),
        np.stack([boxes.rotations for boxes in at]),
    )


@pytest.mark.parametrize("seed", range(6))
def test_least_along_a_motion_is_that_of_every_place(seed: int) -> None:
    scene = FclScene(some(np.random.default_rng(seed), 12, 6.0))
    half, centers, rotations = moving(seed, 150)
    every = [
        scene.by_manager(Boxes(c, R, half)).min() for c, R in zip(centers, rotations, strict=True)
    ]
    least = scene.least_along(half, centers, rotations)
    assert least == pytest.approx(min(every), abs=1e-9)
    np.testing.assert_allclose(scene.each_along(half, centers, rotations), every, atol=1e-9)


def test_a_moment_of_contact_between_far_ends_is_found() -> None:
    half = np.array([[0.1, 0.1, 0.1]])
    scene = FclScene(Boxes(np.array([[0.0, 0.25, 0.0]]), np.eye(3)[None], half))
    x = np.linspace(-5.0, 5.0, 400)
    centers = np.stack([x, 0 * x, 0 * x], axis=1)[:, None]
    rotations = np.broadcast_to(np.eye(3), (400, 1, 3, 3))
    assert scene.least_along(half, centers, rotations) == pytest.approx(0.05, abs=1e-6)
    assert scene.least_along(2.0 * half, centers, rotations) == 0.0
    assert scene.least_along(half, centers[:1], rotations[:1]) > 4.0


def test_a_lower_bound_is_never_above_the_distance() -> None:
    rng = np.random.default_rng(3)
    a, b = some(rng, 60, 1.5), some(rng, 40, 1.5)
    i, j = (index.ravel() for index in np.meshgrid(range(60), range(40), indexing="ij"))
    distance, _ = pair_distances(a, b, i, j)
    bound = lower_bounds(a, b)[i, j]
    assert (bound <= np.maximum(distance, 0.0) + 1e-12).all()
    assert (bound > 0.9 * distance)[distance > 0.0].mean() > 0.4
    assert (bound[distance < 0.0] == 0.0).all()
