"""The six-joint road-rail machine against Table 3.1 of the thesis; pose kinematics of its tool."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from backend.machine import kinematics
from backend.machine.bodies import overlaps
from backend.machine.load import load_machine
from backend.machine.model import PARTS, ROLES
from backend.machine.pose import damped_inverse, inverse_pose, pose_error, tool_jacobian, tool_pose

RAIL = load_machine("rail6")
# As stated in the URDF: a1, d1, a2, d2, a3, d5, a7, d7.
A1, D1, A2, D2, A3, D5, A7, D7 = 0.35, 1.75, 2.90, 0.10, 1.90, 0.10, 0.45, 1.15


def random_postures(count: int, seed: int, part: float = 1.0) -> np.ndarray:
    """(count, 6) within `part` of the joints' ranges."""
    low = np.where(np.isfinite(RAIL.lower), RAIL.lower, -np.pi)
    high = np.where(np.isfinite(RAIL.upper), RAIL.upper, np.pi)
    middle, half = 0.5 * (low + high), 0.5 * part * (high - low)
    return middle + np.random.default_rng(seed).uniform(-half, half, (count, 6))


def denavit_hartenberg(alpha: float, a: float, d: float, theta: float) -> np.ndarray:
    """Mäkinen 2021, Eq. (3.3), as printed."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    )


def test_the_machine_has_the_chain_of_table_3_1():
    quarter = np.pi / 2
    for q in random_postures(50, 0):
        rows = [
            (quarter, A1, D1, q[0]),
            (0.0, A2, D2, q[1]),
            (0.0, A3, 0.0, q[2]),
            (-quarter, 0.0, 0.0, q[3]),
            (quarter, 0.0, D5, q[4] + quarter),
            (0.0, 0.0, 0.0, q[5] + quarter),
            (0.0, A7, D7, 0.0),
        ]
        T_0_7 = np.eye(4)
        for row in rows:  # Eq. (3.4)
            T_0_7 = T_0_7 @ denavit_hartenberg(*row)
        T = tool_pose(RAIL, kinematics.link_poses(RAIL, q))
        np.testing.assert_allclose(T[:3, 3], T_0_7[:3, 3], atol=1e-12)
        # The tool's x runs along z6, its z along x6.
        np.testing.assert_allclose(T[:3, 0], T_0_7[:3, 2], atol=1e-12)
        np.testing.assert_allclose(T[:3, 2], T_0_7[:3, 0], atol=1e-12)


def test_the_machine_states_everything():
    assert RAIL.name == "rail6"
    assert [joint.role for joint in RAIL.joints] == list(ROLES)
    assert RAIL.assumptions == ()
    assert RAIL.masses_trusted
    assert {RAIL.part_of_body(b) for b in range(len(RAIL.bodies))} == set(PARTS)
    inertias = [link.inertia for link in RAIL.links]
    assert 18_000 < sum(i.mass for i in inertias if i is not None) < 22_000
    for inertia in inertias:
        assert inertia is not None
        a, b, c = np.linalg.eigvalsh(inertia.tensor)
        assert 0 < a <= b <= c < a + b


def test_the_arm_is_free_of_itself_in_ordinary_postures():
    for posture in ((30, -90, -30, 0, 0), (70, -140, -20, 0, 0), (0, -60, -60, 30, 90)):
        q = np.radians([20.0, *posture])
        boxes = kinematics.body_boxes(RAIL, kinematics.link_poses(RAIL, q))
        touching = overlaps(boxes, boxes)
        assert not [pair for pair in RAIL.self_pairs if touching[pair]], posture


def test_the_tools_jacobian_against_differences():
    for q in random_postures(20, 1):
        J = tool_jacobian(RAIL, q)
        T = tool_pose(RAIL, kinematics.link_poses(RAIL, q))
        for k in range(6):
            step = np.zeros(6)
            step[k] = 1e-6
            moved = tool_pose(RAIL, kinematics.link_poses(RAIL, q + step))
            turn = Rotation.from_matrix(moved[:3, :3] @ T[:3, :3].T).as_rotvec()
            want = np.concatenate([moved[:3, 3] - T[:3, 3], turn]) / 1e-6
            np.testing.assert_allclose(J[:, k], want, atol=2e-5)


@pytest.mark.parametrize("angle", [0.0, 1e-8, 0.7, np.pi - 1e-6, np.pi])
def test_the_pose_error_is_the_rotation_vector(angle):
    random = np.random.default_rng(2)
    for _ in range(20):
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        start, goal = np.eye(4), np.eye(4)
        start[:3, :3] = Rotation.random(rng=random).as_matrix()
        turn = Rotation.from_rotvec(angle * axis)
        goal[:3, :3] = turn.as_matrix() @ start[:3, :3]
        goal[:3, 3] = 1.0, 2.0, 3.0
        error = pose_error(goal, start)
        np.testing.assert_allclose(error[:3], [1.0, 2.0, 3.0])
        assert np.linalg.norm(error[3:]) == pytest.approx(angle, abs=1e-7)
        again = Rotation.from_rotvec(error[3:]).as_matrix()
        np.testing.assert_allclose(again, turn.as_matrix(), atol=1e-6)


def test_inverse_pose_finds_the_way_back():
    T_site_root = np.eye(4)
    T_site_root[:3, :3] = Rotation.from_euler("xyz", [0.02, -0.03, 1.1]).as_matrix()
    T_site_root[:3, 3] = 5.0, -2.0, 0.3
    random = np.random.default_rng(3)
    for q in random_postures(60, 4, part=0.8):
        goal = tool_pose(RAIL, kinematics.link_poses(RAIL, q, T_site_root))
        found = inverse_pose(RAIL, goal, q + random.uniform(-0.25, 0.25, 6), T_site_root)
        assert found.reached
        there = tool_pose(RAIL, kinematics.link_poses(RAIL, found.q, T_site_root))
        np.testing.assert_allclose(there, goal, atol=1e-6)
        assert (found.q >= RAIL.lower).all()
        assert (found.q <= RAIL.upper).all()


def test_inverse_pose_says_when_a_pose_is_out_of_reach():
    q = np.radians([0.0, 20.0, -80.0, -30.0, 0.0, 0.0])
    goal = tool_pose(RAIL, kinematics.link_poses(RAIL, q))
    goal[0, 3] += 4.0
    found = inverse_pose(RAIL, goal, q)
    assert not found.reached
    assert np.linalg.norm(found.error) > 0.5


def test_damped_inverse_without_damping_is_the_pseudo_inverse():
    J = np.random.default_rng(5).normal(size=(4, 6))
    np.testing.assert_allclose(damped_inverse(J, 0.0), np.linalg.pinv(J), atol=1e-10)
    singular = np.zeros((4, 6))
    assert np.abs(damped_inverse(singular, 0.1)).max() == 0.0
