"""The simulated LiDAR's ranges against trimesh's and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from backend.shell.sim.lidar import Lidar, Person, scan
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.rotation import rz
from backend.spatial.transform import make

EXACT = Lidar(noise=0.0, lost=0.0, directions=360)
T = make(rz(0.3), np.array([0.5, -0.2, 2.0]))


def boxes(count: int, seed: int) -> Boxes:
    rng = np.random.default_rng(seed)
    at = rng.uniform(-np.pi, np.pi, count)
    far = rng.uniform(3.0, 15.0, count)
    centers = np.stack([far * np.cos(at), far * np.sin(at), rng.uniform(0.0, 3.0, count)], axis=1)
    return Boxes(centers, rz(rng.uniform(-3, 3, count)), rng.uniform(0.2, 1.5, (count, 3)))


def test_ranges_agree_with_trimesh() -> None:
    scene = boxes(12, 1)
    mesh = trimesh.util.concatenate(
        [
            trimesh.creation.box(2.0 * h, make(R, c))
            for c, R, h in zip(scene.centers, scene.rotations, scene.half_extents, strict=True)
        ]
    )
    seen = scan(EXACT, T, scene, (), np.random.default_rng(0), (np.array([0, 0, 1.0]), -100.0))
    ways = seen.points - T[:3, 3]
    far = np.linalg.norm(ways, axis=1)
    where, ray, _ = mesh.ray.intersects_location(
        np.repeat(T[None, :3, 3], len(ways), axis=0), ways / far[:, None]
    )
    first = np.full(len(ways), np.inf)
    np.minimum.at(first, ray, np.linalg.norm(where - T[:3, 3], axis=1))
    assert len(seen.points) > 300
    np.testing.assert_allclose(far, first, atol=1e-6)


def test_a_person_is_as_far_as_their_front() -> None:
    person = Person(np.array([8.0, 0.0]))
    level = make(np.eye(3), np.array([0.0, 0.0, 1.0]))
    lidar = Lidar(elevations=np.zeros(1), directions=360, noise=0.0, lost=0.0)
    seen = scan(lidar, level, NO_BOXES, (person,), np.random.default_rng(0))
    ahead = seen.points[np.abs(seen.points[:, 1]) < 1e-9]
    np.testing.assert_allclose(ahead[0, 0], 8.0 - person.radius)
    on = np.hypot(seen.points[:, 0] - 8.0, seen.points[:, 1])
    np.testing.assert_allclose(on, person.radius, atol=1e-9)


def test_the_ground_is_flat_and_ends_at_the_farthest() -> None:
    seen = scan(EXACT, T, NO_BOXES, (), np.random.default_rng(0))
    np.testing.assert_allclose(seen.points[:, 2], 0.0, atol=1e-9)
    assert (seen.hit == -1).all()
    assert np.linalg.norm(seen.points - T[:3, 3], axis=1).max() < EXACT.farthest


def test_noise_and_losses_are_as_told() -> None:
    lidar = Lidar(noise=0.05, lost=0.1)
    seen = scan(lidar, T, NO_BOXES, (), np.random.default_rng(3))
    whole = scan(Lidar(noise=0.0, lost=0.0), T, NO_BOXES, (), np.random.default_rng(3))
    assert len(seen.points) / len(whole.points) == pytest.approx(0.9, abs=0.01)
    far = np.linalg.norm(seen.points - T[:3, 3], axis=1)
    drop = T[2, 3] / ((T[2, 3] - seen.points[:, 2]) / far)  # range at which the ray meets z = 0
    assert (far - drop).std() == pytest.approx(0.05, rel=0.05)
