"""Eqs. (12)-(28) on random pairs, and the image of one pair."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from backend.cspace.sun import SunPose
from backend.cspace.sun_images import sun_image
from backend.cspace.sun_manipulation import (
    beta_samples,
    co_d,
    co_theta,
    contact_length,
    contact_vectors,
    full_turn,
    in_free_joints,
    in_obstacle,
    joint_sets,
    theta_d,
)

Make = Callable[..., SunPose]
LENGTHS = np.array([1.0, 1.72, 0.951, 0.7])
near = st.floats(-5.0, 5.0)
angle = st.floats(-7.0, 7.0)
length = st.floats(3.1, 6.0)


def arm(x: float, y: float, yaw: float, boom: float, stick: float, bucket: float) -> SunPose:
    return SunPose(np.array([x, y]), yaw, 0.0, boom, stick, bucket, LENGTHS)


@given(near, near)
def test_azimuth_and_length_are_polar_coordinates(x: float, y: float) -> None:
    vectors = np.array([[x, y]])
    theta = co_theta(vectors)
    d = co_d(vectors, theta)
    assert d == pytest.approx(np.hypot(x, y), rel=1e-12, abs=1e-12)
    assert np.array([d * np.cos(theta), d * np.sin(theta)])[:, 0] == pytest.approx([x, y])


def test_plain_atan_of_equation_12_points_the_other_way() -> None:
    vectors = np.array([[-3.0, 1.0]])
    assert co_theta(vectors) - np.arctan(vectors[:, 1] / vectors[:, 0]) == pytest.approx(np.pi)


@settings(max_examples=200)
@given(near, near, angle, length, st.integers(1, 60), st.floats(0.5, 12.0))
def test_curve_is_sorted_continuous_and_on_the_line(
    straight: Make, x: float, y: float, yaw: float, d_a: float, n: int, reach: float
) -> None:
    a, b = straight(x, y, yaw, d_a), straight(0.0, 0.0, 0.0, 4.0)
    theta, d = theta_d(a, b, 0.1, n, reach)
    s = np.linspace(0.0, a.d - 0.1, n + 1)
    points = a.position + s[:, None] * [np.cos(yaw), np.sin(yaw)]
    far = np.hypot(*points.T)
    assume((np.abs(far - reach) > 1e-9).all())  # else rounding decides
    assert len(theta) == len(d) == (far <= reach).sum()
    if len(theta):
        assert 0.0 <= theta[0] < 2.0 * np.pi
        assert (np.diff(theta) >= 0.0).all()
        assert theta[-1] - theta[0] <= np.pi + 1e-9
        back = d[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=-1)
        gap = np.linalg.norm(back[:, None] - points[None], axis=-1)
        assert gap.min(axis=1).max() < 1e-9


def test_no_jump_where_the_line_crosses_grid_east(straight: Make) -> None:
    a, b = straight(3.0, -2.0, np.pi / 2, 4.1), straight(0.0, 0.0, 0.0, 4.0)
    theta, d = theta_d(a, b, 0.1, 40, 10.0)
    assert theta[0] < 2 * np.pi < theta[-1]
    assert np.diff(theta).max() < 0.05
    for east in (0.0, 2 * np.pi, -2 * np.pi):
        assert contact_length(theta, d, east) == pytest.approx(3.0)


@settings(max_examples=200)
@given(near, near, angle, length, angle, st.integers(1, 60))
def test_contact_length_is_the_ray_to_the_line(
    straight: Make, x: float, y: float, yaw: float, d_a: float, azimuth: float, n: int
) -> None:
    a, b = straight(x, y, yaw, d_a), straight(0.0, 0.0, 0.0, 4.0)
    # By the determinant of [ray, -arm] (s, l) = foot of A.
    ray = np.array([np.cos(azimuth), np.sin(azimuth)])
    along = np.array([np.cos(yaw), np.sin(yaw)])
    matrix = np.stack([ray, -along], axis=1)
    assume(abs(np.linalg.det(matrix)) > 1e-3)
    s, on_arm = np.linalg.solve(matrix, a.position)
    tip = a.d - 0.1
    assume(min(abs(s), abs(on_arm), abs(on_arm - tip)) > 1e-6)
    assume(abs(along[0] * y - along[1] * x) > 1e-3)  # B beside A's line, not on it
    expected = s if s > 0.0 and 0.0 < on_arm < tip else np.inf
    curve = theta_d(a, b, 0.1, n, np.inf)
    assert contact_length(*curve, azimuth) == pytest.approx(expected, rel=1e-6)
    if np.isfinite(expected):
        assert in_obstacle(*curve, azimuth, expected * 1.001)
        assert not in_obstacle(*curve, azimuth, expected * 0.999)


def test_membership_is_vectorised(straight: Make) -> None:
    a, b = straight(3.0, -2.0, np.pi / 2, 4.1), straight(0.0, 0.0, 0.0, 4.0)
    curve = theta_d(a, b, 0.1, 40, 10.0)
    azimuth, reach = np.meshgrid(np.linspace(-7.0, 7.0, 41), np.linspace(0.0, 6.0, 31))
    image = in_obstacle(*curve, azimuth, reach)
    assert image.shape == (31, 41)
    assert image.any()
    assert not image.all()
    for k in np.ndindex(image.shape):
        assert image[k] == in_obstacle(*curve, azimuth[k], reach[k])


def test_b_on_the_arms_own_line(straight: Make) -> None:
    b = straight(0.0, 0.0, 0.0, 4.0)
    pointing = theta_d(straight(-6.0, 0.0, 0.0, 4.1), b, 0.1, 8, np.inf)
    assert contact_length(*pointing, np.pi) == pytest.approx(2.0)
    assert contact_length(*pointing, np.pi - 0.01) == np.inf
    across = theta_d(straight(-2.1, 0.0, 0.0, 4.1), b, 0.1, 8, np.inf)
    assert in_obstacle(*across, np.linspace(-4.0, 4.0, 50), 0.0).all()


def test_out_of_reach_is_empty_and_free(straight: Make) -> None:
    a, b = straight(40.0, 0.0, 0.0, 4.0), arm(0.0, 0.0, 0.0, 0.5, -1.0, 0.5)
    image = sun_image(a, b, 4.371, 0.1, 20, 30)
    assert image.theta.shape == image.d.shape == (0,)
    assert image.joints.boom.shape == (21, 0)
    assert image.joints.co4.shape == (21, 0, 4)
    assert not image.current.collides
    assert not image.current.in_joint_set
    assert not image.current.in_zone
    assert in_free_joints(image.joints.co3, np.array([0.5, -1.0, 0.5]))


@settings(max_examples=50, deadline=None)
@given(near, near, angle, st.floats(-0.2, 0.2), st.sampled_from([1, -1]))
def test_joint_sets_put_the_bucket_pivot_on_its_point(
    straight: Make, x: float, y: float, yaw: float, pitch: float, elbow: int
) -> None:
    b = SunPose(np.zeros(2), 0.0, pitch, 0.5, -1.0, 0.5, LENGTHS)
    theta, d = theta_d(straight(x, y, yaw, 4.0), b, 0.1, 20, float(LENGTHS.sum()))
    sets = joint_sets(theta, d, b, 0.1, 10, elbow)
    assert sets.boom.shape == (11, len(d))
    beta, d2 = np.broadcast_arrays(beta_samples(10)[:, None], sets.d2)
    solved = np.isfinite(sets.boom)
    # No solution exactly where two sides of the triangle cannot span the third.
    assert (solved == ((d2 <= 1.72 + 0.951) & (d2 >= 1.72 - 0.951))).all()
    phi = sets.boom + pitch
    px = 1.72 * np.cos(phi) + 0.951 * np.cos(phi + sets.stick)
    pz = 1.72 * np.sin(phi) + 0.951 * np.sin(phi + sets.stick)
    assert px[solved] == pytest.approx((d2 * np.cos(beta))[solved], abs=1e-9)
    assert pz[solved] == pytest.approx((d2 * np.sin(beta))[solved], abs=1e-9)
    assert (np.sign(sets.stick[solved]) * elbow <= 0.0).all()  # elbow up folds the stick down
    assert (np.isnan(sets.stick) == ~solved).all()
    assert (np.isnan(sets.bucket) == ~solved).all()


@settings(max_examples=60, deadline=None)
@given(st.floats(0.0, np.pi / 2), st.floats(0.0, 1.0), st.floats(0.03, 0.5))
def test_postures_between_samples_are_members_and_lifted_buckets_are_not(
    beta: float, fraction: float, lift: float
) -> None:
    a, b = arm(-5.0, -2.0, 1.0472, 0.52, -1.05, 0.53), arm(0.0, 0.0, 2.8, 0.5, -1.0, 0.5)
    theta, d = theta_d(a, b, 0.1, 49, float(LENGTHS.sum()))
    sets = joint_sets(theta, d, b, 0.1, 49)
    k = np.isfinite(sets.boom[0])
    place = np.interp(fraction, [0.0, 1.0], [0.0, k.sum() - 1.0])
    grid = np.arange(k.sum())
    swing, reach = np.interp(place, grid, theta[k]), np.interp(place, grid, d[k])
    one = joint_sets(np.array([swing]), np.array([reach]), b, 0.1, 1)
    boom, stick = one.boom[0, 0] + beta, one.stick[0, 0]
    q = np.array([boom, stick, -boom - stick])
    assert not in_free_joints(sets.co3, q)
    assert not in_free_joints(sets.co4, np.array([swing + 2.0 * np.pi, *q]))
    assert in_free_joints(sets.co3, q + np.array([0.0, 0.0, lift + 1.0]))


def test_image_holds_every_set_and_both_directions() -> None:
    a, b = arm(25.0, 25.0, 1.0472, 0.52, -1.05, 0.53), arm(30.0, 27.0, 2.8, 0.5, -1.0, 0.5)
    image, other = sun_image(a, b, 4.371, 0.1, 20, 30), sun_image(b, a, 4.371, 0.1, 20, 30)
    assert image.x.shape == image.y.shape == (2, 21, 31)
    assert image.zone.shape == (64, 2)
    assert image.joints.boom.shape == (21, len(image.theta))
    assert image.current.d == pytest.approx(b.d)
    assert other.current.d == pytest.approx(a.d)
    for seen, p, q in ((image, a, b), (other, b, a)):
        far = np.linalg.norm(contact_vectors(p, q, np.linspace(0.0, p.d - 0.1, 31)), axis=1)
        assert np.sort(seen.d) == pytest.approx(np.sort(far[far <= 4.371]), abs=1e-9)
    with pytest.raises(ValueError, match="read-only"):
        image.d[0] = 0.0


@settings(max_examples=40, deadline=None)
@given(near, near, angle, angle, angle, near, near)
def test_image_is_the_same_seen_from_a_turned_and_moved_frame(
    x: float, y: float, yaw_a: float, yaw_b: float, turn: float, east: float, north: float
) -> None:
    a, b = arm(x, y, yaw_a, 0.52, -1.05, 0.53), arm(0.0, 0.0, yaw_b, 0.5, -1.0, 0.5)
    c, s = np.cos(turn), np.sin(turn)
    R, p = np.array([[c, -s], [s, c]]), np.array([east, north])
    here = sun_image(a, b, 99.0, 0.1, 5, 20)
    cross = np.cos(yaw_a) * y - np.sin(yaw_a) * x
    contact = float(contact_length(here.theta, here.d, yaw_b))
    # Away from the edges where rounding decides.
    assume(abs(cross) > 1e-3 and abs(contact - b.d) > 1e-6)
    edge = np.exp(1j * (np.array([here.theta[0], here.theta[-1]]) - yaw_b))
    assume(np.abs(edge - 1.0).min() > 1e-6)
    moved = [arm(*(R @ q.position + p), q.yaw + turn, q.boom, q.stick, q.bucket) for q in (a, b)]
    there = sun_image(moved[0], moved[1], 99.0, 0.1, 5, 20)
    assert there.d == pytest.approx(here.d, abs=1e-9)
    assert there.current.collides == here.current.collides
    assert there.current.zone_distance == pytest.approx(here.current.zone_distance, abs=1e-9)
    assert there.zone.shape == here.zone.shape
    assert np.exp(1j * (there.theta - turn)) == pytest.approx(np.exp(1j * here.theta), abs=1e-9)


def test_a_rounded_whole_turn_is_zero() -> None:
    assert full_turn(-1e-20) == 0.0
    assert full_turn(-0.5) == pytest.approx(2 * np.pi - 0.5)
    assert full_turn(2 * np.pi) == 0.0


def test_bad_parameters_are_refused() -> None:
    a, b = arm(0.0, 0.0, 0.0, 0.5, -1.0, 0.5), arm(4.0, 0.0, 2.0, 0.5, -1.0, 0.5)
    for m, n, eta in ((0, 5, 0.1), (5, 0, 0.1), (5, 5, -0.1)):
        with pytest.raises(ValueError, match=r"at least 1|eta must"):
            sun_image(a, b, 4.371, eta, m, n)
    with pytest.raises(ValueError, match="3 or 4 joints"):
        in_free_joints(np.zeros((2, 2, 3)), np.zeros(4))
