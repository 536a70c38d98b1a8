"""Inverse kinematics: the inverse of forward kinematics, limits and reach told apart."""

from __future__ import annotations

import numpy as np
import pytest

from backend.machine import kinematics
from backend.machine.inverse import inverse
from backend.machine.load import load_machine
from backend.machine.sun_map import from_sun_angles, sun_angles


def test_inverse_undoes_forward(machine, draw):
    q = draw(machine, np.random.default_rng(11), 2000)
    theta = sun_angles(machine, q)
    tips = kinematics.end_point(machine, q)
    level = tips - kinematics.swing_center(machine)
    a = kinematics.azimuth(machine, q)
    ahead = np.cos(a) * level[:, 0] + np.sin(a) * level[:, 1]
    q, theta, tips = q[ahead > 0.01], theta[ahead > 0.01], tips[ahead > 0.01]
    assert len(q) > 500
    phi = theta.sum(axis=1)
    for elbow in (1, -1):
        same_side = np.sign(-np.sin(theta[:, 1])) == elbow
        solution = inverse(machine, tips, phi, elbow)
        assert solution.reachable.all()
        back = kinematics.end_point(machine, solution.q)
        np.testing.assert_allclose(back, tips, atol=1e-9)
        turns = sun_angles(machine, solution.q).sum(axis=1) - phi
        np.testing.assert_allclose(np.sin(turns), 0.0, atol=1e-9)
        np.testing.assert_allclose(np.cos(turns), 1.0, atol=1e-9)
        # Near the stretched arm acos loses half its digits; the tip above does not.
        bent = same_side & (np.abs(np.sin(theta[:, 1])) > 0.05)
        np.testing.assert_allclose(solution.q[bent], q[bent], atol=1e-9)
        assert solution.within_limits[bent].all()


def test_reach_and_limits_are_told_apart(mini):
    far = inverse(mini, np.array([9.0, 0.0, 0.5]), 0.0)
    assert not far.reachable
    assert np.isfinite(far.q).all()
    # The arm nearly stretched: its lengths allow it, the stick's upper limit of -25 degrees does
    # not.
    stretched = inverse(mini, np.array([4.36, 0.0, 0.65]), 0.0)
    assert stretched.reachable
    assert not stretched.within_limits
    assert sun_angles(mini, stretched.q)[1] > mini.joints[2].upper
    dug = inverse(mini, np.array([3.4, 0.5, -0.5]), np.radians(-60.0))
    assert dug.reachable
    assert dug.within_limits


def test_a_tip_on_the_swing_axis_of_an_offset_arm_is_out_of_reach(tiny):
    machine = load_machine(str(tiny()))
    assert machine.arm.tip_lateral == pytest.approx(0.07)
    on_axis = inverse(machine, np.array([0.01, 0.0, 1.0]), 0.0)
    assert not on_axis.reachable


def test_shapes_broadcast(ex13):
    p = np.full((4, 1, 3), [5.0, 1.0, 0.0])
    solution = inverse(ex13, p, np.radians([[-100.0, -60.0, -20.0]]))
    assert solution.q.shape == (4, 3, 4)
    assert solution.reachable.shape == solution.within_limits.shape == (4, 3)


def test_swing_left_of_the_base_is_positive(mini):
    assert inverse(mini, np.array([2.0, 2.0, 0.0]), -1.5).q[0] == pytest.approx(np.pi / 4)


def test_joint_values_of_mini_are_suns_angles(mini, draw):
    q = draw(mini, np.random.default_rng(12), 20)
    assert mini.sun.lengths == (1.0, 1.72, 0.951, 0.7)
    assert mini.sun.signs == (1.0, 1.0, 1.0)
    assert mini.sun.offsets == (0.0, 0.0, 0.0)
    assert (mini.sun.azimuth_sign, mini.sun.azimuth_offset) == (1.0, 0.0)
    assert mini.max_reach == pytest.approx(4.371, abs=1e-9)
    np.testing.assert_array_equal(sun_angles(mini, q), q[:, 1:4])


def test_sun_angles_are_the_elevations_of_the_pivots(machine, draw):
    """Elevation of each line between pivots, from the poses, against the map's running sum."""
    q = draw(machine, np.random.default_rng(13), 50)
    poses = kinematics.link_poses(machine, q)
    moved = {link.joint: i for i, link in enumerate(machine.links) if link.joint >= 0}
    pivots = [poses[:, moved[k], :3, 3] for k in (1, 2, 3)]
    points = np.stack([*pivots, kinematics.end_point_of(machine, poses)], axis=1)
    a = kinematics.azimuth(machine, q)[:, None]
    forward = np.cos(a) * points[..., 0] + np.sin(a) * points[..., 1]
    steps = np.stack([np.diff(forward, axis=1), np.diff(points[..., 2], axis=1)], axis=-1)
    lengths = np.linalg.norm(steps, axis=-1)
    np.testing.assert_allclose(lengths, np.tile(machine.sun.lengths[1:], (50, 1)), atol=1e-9)
    running = np.cumsum(sun_angles(machine, q), axis=1)
    expected = np.stack([np.cos(running), np.sin(running)], axis=-1)
    np.testing.assert_allclose(steps / lengths[..., None], expected, atol=1e-9)


def test_from_sun_angles_undoes_sun_angles(machine, draw):
    q = draw(machine, np.random.default_rng(14), 20)
    np.testing.assert_allclose(
        from_sun_angles(machine, sun_angles(machine, q)), q[:, 1:4], atol=1e-12
    )


def test_raising_the_boom_is_positive_for_sun_whatever_the_axis(tiny):
    down = load_machine(str(tiny()))  # +y axes: positive lowers
    assert down.sun.signs == (-1.0, -1.0, -1.0)
    low = kinematics.end_point(down, from_full(down, [0.0, -0.5, 0.0]))
    high = kinematics.end_point(down, from_full(down, [0.3, -0.5, 0.0]))
    assert high[2] > low[2]


def from_full(machine, theta):
    return np.concatenate([[0.0], from_sun_angles(machine, np.array(theta))])


def test_a_swing_axis_that_points_down_turns_the_azimuth_back(tiny):
    path = tiny(('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>'))
    machine = load_machine(str(path))
    assert machine.sun.azimuth_sign == -1.0
    q = np.array([0.5, -0.4, 1.0, 0.3])
    assert kinematics.azimuth(machine, q) == pytest.approx(-0.5)
    phi = sun_angles(machine, q).sum()
    np.testing.assert_allclose(
        inverse(machine, kinematics.end_point(machine, q), phi).q, q, atol=1e-9
    )
