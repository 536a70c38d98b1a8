"""Forward kinematics against yourdfpy, Sun's numbers, and properties."""

from __future__ import annotations

import functools
import io

import numpy as np
import pytest
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.machine import kinematics
from backend.machine.expand import urdf_text
from backend.machine.load import SHIPPED, load_machine
from backend.machine.outline import part_outlines
from backend.spatial import rotation, transform

angle = st.floats(-3.0, 3.0)
shipped = functools.cache(load_machine)  # hypothesis does not mix with fixtures of functions


def base(yaw, pitch=0.0, roll=0.0, p=(0.0, 0.0, 0.0)):
    return transform.make(rotation.from_attitude(yaw, pitch, roll), np.array(p))


# Sun 2020, Tables 1, 4 and 6 (pitch, boom, stick, bucket [deg]); d as in the errata's checked list.
@pytest.mark.parametrize(
    ("posture", "d"),
    [
        ((0.0, 30.0, -60.0, 30.0), 4.01315),
        ((-0.9, 26.8, -38.6, 42.2), 4.08410),
        ((-1.2, 44.8, -80.1, -22.0), 3.37557),
    ],
)
def test_reach_of_mini_is_suns_d(mini, posture, d):
    pitch, *arm = np.radians(posture)
    q = np.array([0.0, *arm])
    assert kinematics.reach(mini, q, base(0.6, pitch)) == pytest.approx(d, abs=5e-6)


@settings(max_examples=30, deadline=None)
@given(yaw=angle, swing=angle)
def test_azimuth_of_mini_is_yaw_plus_swing_on_level_ground(yaw, swing):
    mini = shipped("mini")
    got = kinematics.azimuth(mini, np.array([swing, 0.3, -1.0, 0.2]), base(yaw))
    assert np.sin(got - yaw - swing) == pytest.approx(0.0, abs=1e-12)
    assert np.cos(got - yaw - swing) > 0


def test_azimuth_points_at_the_tip_when_level(machine, draw):
    q = draw(machine, np.random.default_rng(2), 40)
    T = base(0.4, p=(3.0, -2.0, 1.0))
    to_tip = kinematics.end_point(machine, q, T) - kinematics.swing_center(machine, T)
    a = kinematics.azimuth(machine, q, T)
    beside = -np.sin(a) * to_tip[:, 0] + np.cos(a) * to_tip[:, 1]
    np.testing.assert_allclose(beside, machine.arm.tip_lateral, atol=1e-9)


@pytest.mark.parametrize("name", ["mini", "ex13", "zx200"])
def test_link_poses_agree_with_yourdfpy(name, request, shared_data, draw):
    machine = request.getfixturevalue(name)
    file = SHIPPED / name / f"{name}.urdf"
    if not file.exists():
        file = shared_data / name / f"{name}.xacro"
    robot = yourdfpy.URDF.load(
        io.StringIO(urdf_text(file)),
        build_scene_graph=True,
        load_meshes=False,
        build_collision_scene_graph=False,
    )
    for q in draw(machine, np.random.default_rng(1), 5):
        values = dict(zip((j.name for j in machine.joints), q, strict=True))
        robot.update_cfg({j: values.get(j, 0.0) for j in robot.actuated_joint_names})
        poses = kinematics.link_poses(machine, q)
        for link, T in zip(machine.links, poses, strict=True):
            expected = robot.get_transform(link.name, machine.links[0].name)
            np.testing.assert_allclose(T, expected, atol=1e-9)


def test_vectorised_equals_loop(machine, draw):
    random = np.random.default_rng(3)
    q = draw(machine, random, 6).reshape(3, 2, -1)
    T = base(random.uniform(-3, 3, (3, 1)), 0.1, -0.2, random.uniform(-5, 5, (3, 1, 3)))
    poses = kinematics.link_poses(machine, q, T)
    tips = kinematics.end_point(machine, q, T)
    assert poses.shape == (3, 2, len(machine.links), 4, 4)
    for i in range(3):
        for j in range(2):
            one = kinematics.link_poses(machine, q[i, j], T[i, 0])
            np.testing.assert_allclose(poses[i, j], one, atol=1e-12)
            np.testing.assert_allclose(
                tips[i, j], kinematics.end_point_of(machine, one), atol=1e-12
            )


@settings(max_examples=30, deadline=None)
@given(q=st.lists(angle, min_size=4, max_size=4), yaw=angle, pitch=st.floats(-0.5, 0.5))
def test_jacobian_is_the_derivative(q, yaw, pitch):
    machine = shipped("ex13")
    q, T, h = np.array(q), base(yaw, pitch, 0.1, (1.0, 2.0, 3.0)), 1e-6
    link, point = machine.end_link, machine.end_point
    J = kinematics.jacobian(machine, q, T, link, point, angular=True)
    poses = kinematics.link_poses(machine, q, T)
    assert J.shape == (6, 4)
    for k in range(4):
        step = np.eye(4)[k] * h
        ahead = kinematics.link_poses(machine, q + step, T)
        behind = kinematics.link_poses(machine, q - step, T)
        moved = kinematics.end_point_of(machine, ahead) - kinematics.end_point_of(machine, behind)
        np.testing.assert_allclose(J[:3, k], moved / (2 * h), atol=1e-7)
        W = (ahead - behind)[link, :3, :3] / (2 * h) @ poses[link, :3, :3].T
        np.testing.assert_allclose(J[3:, k], [W[2, 1], W[0, 2], W[1, 0]], atol=1e-7)


def test_jacobian_of_the_root_and_of_batches(mini, draw):
    q = draw(mini, np.random.default_rng(5), 7)
    assert not kinematics.jacobian(mini, q, None, 0, np.ones(3)).any()
    J = kinematics.jacobian(mini, q, None, mini.end_link, mini.end_point)
    assert J.shape == (7, 3, 4)
    one = kinematics.jacobian(mini, q[3], None, mini.end_link, mini.end_point)
    np.testing.assert_allclose(J[3], one, atol=1e-12)


def test_a_rigid_motion_moves_everything_along(machine, draw):
    q = draw(machine, np.random.default_rng(6), 1)[0]
    T = base(1.1, 0.2, -0.1, (4.0, 5.0, 6.0))
    home, away = (kinematics.link_poses(machine, q, t) for t in (None, T))
    np.testing.assert_allclose(away, T @ home, atol=1e-12)
    corners = kinematics.body_boxes(machine, home).corners()
    moved = kinematics.body_boxes(machine, away).corners()
    np.testing.assert_allclose(moved, transform.apply(T, corners), atol=1e-12)


def test_bodies_turn_with_their_links(mini):
    q = np.array([0.0, 0.0, 0.0, 0.0])
    stretched = kinematics.body_boxes(mini, kinematics.link_poses(mini, q))
    swung = kinematics.body_boxes(mini, kinematics.link_poses(mini, np.array([np.pi / 2, 0, 0, 0])))
    for b, name in enumerate(mini.body_names):
        x, y, z = stretched.centers[b]
        expected = (x, y, z) if name.startswith("tracks") else (-y, x, z)
        np.testing.assert_allclose(swung.centers[b], expected, atol=1e-12)


def test_outlines_hold_every_corner_and_turn_counter_clockwise(machine, draw):
    q = draw(machine, np.random.default_rng(7), 1)[0]
    poses = kinematics.link_poses(machine, q, base(0.3, p=(2.0, 1.0, 0.0)))
    boxes = kinematics.body_boxes(machine, poses)
    outlines = part_outlines(machine, poses)
    assert list(outlines) == ["tracks", "upper", "boom", "stick", "bucket"]
    for b, corners in enumerate(boxes.corners()):
        outline = outlines[machine.part_of_body(b)]
        edges = np.roll(outline, -1, axis=0) - outline
        to_corner = corners[:, None, :2] - outline[None]
        left = edges[:, 0] * to_corner[..., 1] - edges[:, 1] * to_corner[..., 0]
        assert (left >= -1e-9).all()


def test_jacobians_of_body_points_are_those_of_their_links() -> None:
    rng = np.random.default_rng(11)
    machine = load_machine("ex13")
    q = rng.uniform(-0.4, 0.4, len(machine.joints))
    T = transform.make(rotation.from_attitude(0.4, 0.1, -0.2), np.array([3.0, -2.0, 0.5]))
    poses = kinematics.link_poses(machine, q, T)
    bodies = np.arange(len(machine.bodies))
    points = kinematics.body_boxes(machine, poses).corners()[:, 3]
    together = kinematics.body_point_jacobians(machine, poses, bodies, points)
    for body, point in zip(bodies, points, strict=True):
        link = machine.body_links[body]
        local = transform.apply(transform.inverse(poses[link]), point[None])[0]
        alone = kinematics.jacobian(machine, q, T, link, local)
        np.testing.assert_allclose(together[body], alone, atol=1e-12)
