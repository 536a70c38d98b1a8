"""The stages of a merged scan: every point of every LiDAR, and the tracks do not depend on them."""

from __future__ import annotations

import numpy as np

from backend.perception.detect import Settings
from backend.perception.stages import GROUND, LEFT, MACHINE, OBJECT, OUTSIDE
from backend.pipeline.watch import Cloud, Watched, follow, found_in, merged, staged, watch
from backend.shell.sim.lidar import Lidar, Person, scan
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import rz
from backend.spatial.transform import make

BODIES = Boxes(
    np.array([[0.0, 0.0, 0.7], [14.0, 0.0, 0.7]]),
    np.array([np.eye(3), rz(0.5)]),
    np.array([[1.5, 1.0, 0.7], [1.5, 1.0, 0.7]]),
)
PEOPLE = (Person(np.array([6.0, 3.0])), Person(np.array([9.0, -4.0])))


def cloud(x: float, yaw: float, time: float, seed: int) -> Cloud:
    """A turn of a LiDAR over one of the machines, in its own frame, with a beam that came to
    nothing.
    """
    T = make(rz(yaw), np.array([x, 0.0, 2.2]))
    points = scan(Lidar(), T, BODIES, PEOPLE, np.random.default_rng(seed)).points
    local = (points - T[:3, 3]) @ T[:3, :3]
    return Cloud("m", "lidar", time, np.concatenate([local, [[np.nan] * 3]]), T, BODIES)


CLOUDS = (cloud(0.0, 0.3, 5.0, 1), cloud(14.0, -2.0, 5.03, 2))
SETTINGS = Settings(reach=11.0)


def test_every_number_of_every_lidar_is_told_once() -> None:
    both = merged(CLOUDS, SETTINGS)
    stages = staged(both, found_in(both, SETTINGS), 10**9)
    assert stages.time == 5.03
    assert sum(stages.counts) == len(stages.points) == sum(len(c.points) - 1 for c in CLOUDS)
    counted = np.bincount(stages.stage, minlength=5)
    np.testing.assert_array_equal(counted, stages.counts)
    sensor = np.repeat([[0.0, 0.0], [14.0, 0.0]], [len(c.points) - 1 for c in CLOUDS], axis=0)
    distance = np.linalg.norm(stages.points[:, :2] - sensor, axis=1)
    assert (distance[stages.stage == OUTSIDE] > 11.0 - 1e-4).all()
    assert (distance[stages.stage != OUTSIDE] < 11.0 + 1e-4).all()
    local = np.einsum("nij,nki->nkj", BODIES.rotations, stages.points - BODIES.centers[:, None])
    inside = (np.abs(local) < BODIES.half_extents[:, None] + 0.149).all(axis=2).any(axis=0)
    assert (stages.stage[inside & (distance < 11.0)] == MACHINE).all()
    assert np.abs(stages.points[stages.stage == GROUND, 2]).max() < 0.3
    for k, person in enumerate(PEOPLE):
        near = np.linalg.norm(stages.points[:, :2] - person.place[:2], axis=1) < 0.4
        of = stages.cluster[near & (stages.stage == OBJECT)]
        assert len(of) > 30, k
        assert len(set(of)) == 1, k
        middle = stages.objects.center[of[0], :2]
        assert np.linalg.norm(middle - person.place[:2]) < 0.3
    assert (stages.cluster[stages.stage != OBJECT] == -1).all()
    assert stages.plane is not None
    assert abs(stages.plane.offset) < 0.05
    assert counted[LEFT] < 0.02 * counted.sum()


def test_a_picture_is_thin_and_counts_are_of_all() -> None:
    both = merged(CLOUDS, SETTINGS)
    found = found_in(both, SETTINGS)
    stages = staged(both, found, 2_000)
    assert len(stages.points) == len(stages.stage) == len(stages.cluster) == 2_000
    assert sum(stages.counts) == sum(len(c.points) - 1 for c in CLOUDS)
    assert set(stages.cluster) == {-1, *range(len(found.objects.points))}


def test_who_looks_changes_no_track() -> None:
    before, plain = Watched(), Watched()
    for k in range(4):
        clouds = (cloud(0.0, 0.3, 5.0 + 0.1 * k, k), cloud(14.0, -2.0, 5.03 + 0.1 * k, 9 + k))
        plain, expected = watch(plain, clouds)
        both = merged(clouds, Settings())
        found = found_in(both, Settings())
        staged(both, found)
        before, seen = follow(before, both, found.objects)
        np.testing.assert_array_equal(seen.state, expected.state)
        np.testing.assert_array_equal(seen.id, expected.id)
    assert len(seen.id) >= 2
