"""The simulated LiDAR's ranges against trimesh's and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from backend.shell.sim.lidar import Lidar, Person, measured, scan
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.rotation import from_attitude, rz
from backend.spatial.transform import make

EXACT = Lidar(noise=0.0, lost=0.0, directions=360)
NO_GROUND = (np.array([0.0, 0.0, 1.0]), -100.0)
T = make(rz(0.3), np.array([0.5, -0.2, 2.0]))


def boxes(count: int, seed: int) -> Boxes:
    rng = np.random.default_rng(seed)
    at = rng.uniform(-np.pi, np.pi, count)
    far = rng.uniform(3.0, 15.0, count)
    centers = np.stack([far * np.cos(at), far * np.sin(at), rng.uniform(0.0, 3.0, count)], axis=1)
    return Boxes(centers, rz(rng.uniform(-3, 3, count)), rng.uniform(0.2, 1.5, (count, 3)))


def around(T: np.ndarray, count: int, seed: int) -> Boxes:
    """Boxes of any attitude above, below and beside the sensor, none of them around it."""
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(count, random_state=seed).as_matrix()
    found = Boxes(
        T[:3, 3] + rng.uniform(-5.0, 5.0, (count, 3)), rotations, rng.uniform(0.1, 1.5, (count, 3))
    )
    local = np.einsum("bji,bj->bi", found.rotations, T[:3, 3] - found.centers)
    return found.take((np.abs(local) > found.half_extents).any(axis=1))


TILTED = make(from_attitude(1.0, 0.5, -0.8), np.array([1.0, 2.0, 3.0]))
STEEP = replace(EXACT, elevations=np.deg2rad(np.linspace(-88.0, 88.0, 16)))


@pytest.mark.parametrize(
    ("lidar", "T", "scene"),
    [
        (EXACT, T, boxes(12, 1)),
        (STEEP, T, around(T, 12, 2)),
        (STEEP, TILTED, around(TILTED, 12, 3)),
        (STEEP, TILTED, around(TILTED, 6, 4)),
    ],
)
def test_ranges_agree_with_trimesh(lidar: Lidar, T: np.ndarray, scene: Boxes) -> None:
    mesh = trimesh.util.concatenate(
        [
            trimesh.creation.box(2.0 * h, make(R, c))
            for c, R, h in zip(scene.centers, scene.rotations, scene.half_extents, strict=True)
        ]
    )
    seen = scan(lidar, T, scene, (), np.random.default_rng(0), NO_GROUND)
    e, a = np.meshgrid(lidar.elevations, np.arange(360) * 2.0 * np.pi / 360, indexing="ij")
    ways = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)
    ways = ways.reshape(-1, 3) @ T[:3, :3].T
    where, ray, _ = mesh.ray.intersects_location(np.repeat(T[None, :3, 3], len(ways), axis=0), ways)
    first = np.full(len(ways), np.inf)
    np.minimum.at(first, ray, np.linalg.norm(where - T[:3, 3], axis=1))
    expected = T[:3, 3] + (first[:, None] * ways)[np.isfinite(first)]
    assert len(seen.points) > 300
    np.testing.assert_allclose(seen.points, expected, atol=1e-6)


def test_people_are_met_from_everywhere_as_sampled_rays_meet_them() -> None:
    person = Person(np.array([2.2, 1.4]), ground=-0.5)
    lidar = replace(STEEP, elevations=np.deg2rad(np.linspace(-88.0, 88.0, 60)), directions=180)
    seen = measured(lidar, TILTED, NO_BOXES, (person,), np.random.default_rng(0), NO_GROUND)
    e, a = np.meshgrid(lidar.elevations, np.arange(180) * 2.0 * np.pi / 180, indexing="ij")
    ways = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)
    far = np.arange(1.0, 4.5, 0.01)
    on = ways.reshape(-1, 1, 3) * far[:, None] @ TILTED[:3, :3].T + TILTED[:3, 3]
    x, y, bottom, radius, height = person.cylinders().T[:, None, None]
    inside = (np.hypot(on[..., 0, None] - x, on[..., 1, None] - y) <= radius) & (
        (on[..., 2, None] >= bottom) & (on[..., 2, None] <= bottom + height)
    )
    met = inside.any(axis=(1, 2))
    assert met.sum() > 60
    assert abs(len(seen.points) - met.sum()) <= 4  # some are grazed between two samples
    ranges = far[inside.any(axis=2).argmax(axis=1)[met]]
    assert np.linalg.norm(seen.points, axis=1).mean() == pytest.approx(ranges.mean(), abs=0.02)


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
