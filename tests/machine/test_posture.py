"""Compiled kinematics of one configuration against the vectorised ones."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.box_kernels import near_point
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.spatial import rotation, transform


@pytest.mark.parametrize("name", ["mini", "ex13", "shovel"])
def test_one_configuration_compiled_is_the_same(name: str) -> None:
    machine, rng = load_machine(name), np.random.default_rng(3)
    for _ in range(20):
        q = rng.uniform(-2.0, 2.0, len(machine.joints))
        R = rotation.from_attitude(*rng.uniform(-0.5, 0.5, 3))
        for T in (None, transform.make(R, rng.uniform(-9.0, 9.0, 3))):
            poses = kinematics.posture(machine, q, T)
            many = kinematics.link_poses(machine, np.tile(q, (2, 1)), T)
            assert np.allclose(poses, many[1], atol=1e-12)
            found = kinematics.posture_boxes(machine, poses)
            known = kinematics.body_boxes(machine, many[1])
            assert np.allclose(found.centers, known.centers, atol=1e-12)
            assert np.allclose(found.rotations, known.rotations, atol=1e-12)
            assert (found.half_extents == known.half_extents).all()


def test_velocities_of_points_are_those_of_small_motions() -> None:
    machine, rng = load_machine("ex13"), np.random.default_rng(4)
    q, step = rng.uniform(-1.0, 1.0, len(machine.joints)), 1e-6
    poses = kinematics.posture(machine, q)
    bodies = np.arange(len(machine.body_links))
    points = kinematics.posture_boxes(machine, poses).centers
    J = kinematics.body_point_jacobians(machine, poses, bodies, points)
    for k in range(len(q)):
        moved = q + step * np.eye(len(q))[k]
        after = kinematics.posture_boxes(machine, kinematics.posture(machine, moved)).centers
        assert np.allclose((after - points) / step, J[:, :, k], atol=1e-4)


def test_poses_that_are_no_numbers_are_refused() -> None:
    machine = load_machine("mini")
    poses = kinematics.posture(machine, np.zeros(len(machine.joints)))
    poses[-1] = np.nan
    with pytest.raises(ValueError, match="finite"):
        kinematics.posture_boxes(machine, poses)


def test_boxes_near_a_point_are_those_whose_nearest_point_is() -> None:
    machine, rng = load_machine("mini"), np.random.default_rng(5)
    boxes = kinematics.body_boxes(
        machine, kinematics.link_poses(machine, np.zeros(len(machine.joints)))
    )
    for _ in range(200):
        point, radius = rng.uniform(-4.0, 4.0, 3), float(rng.uniform(0.1, 3.0))
        local = np.einsum("nji,nj->ni", boxes.rotations, point - boxes.centers)
        outside = np.maximum(np.abs(local) - boxes.half_extents, 0.0)
        truth = np.flatnonzero(np.linalg.norm(outside, axis=1) <= radius)
        arrays = boxes.centers, boxes.rotations, boxes.half_extents
        assert near_point(*arrays, point, radius).tolist() == truth.tolist()
