"""Rotations, transforms and angles: group laws and round trips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.spatial import angles, rotation, transform
from backend.spatial.boxes import Boxes

angle = st.floats(-10.0, 10.0)
tilt = st.floats(-1.5, 1.5)


@given(angle, tilt, angle)
def test_attitude_round_trip(yaw: float, pitch: float, roll: float) -> None:
    R = rotation.from_attitude(yaw, pitch, roll)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    back = rotation.from_attitude(*rotation.to_attitude(R))
    np.testing.assert_allclose(back, R, atol=1e-7)


def test_positive_pitch_raises_the_front_and_yaw_turns_left() -> None:
    front = rotation.from_attitude(0.0, 0.1, 0.0) @ [1.0, 0.0, 0.0]
    assert front[2] > 0
    left = rotation.from_attitude(np.pi / 2, 0.0, 0.0) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(left, [0.0, 1.0, 0.0], atol=1e-12)


@given(st.lists(angle, min_size=3, max_size=3), angle)
def test_quaternions_round_trip(attitude: list[float], turn: float) -> None:
    R = rotation.from_attitude(*attitude) @ rotation.rx(turn)
    q = rotation.to_quaternion(R)
    assert np.linalg.norm(q) == pytest.approx(1.0)
    assert q[0] >= 0.0
    np.testing.assert_allclose(rotation.from_quaternion(q), R, atol=1e-9)


@given(angle)
def test_rodrigues_agrees_with_the_principal_rotations(turn: float) -> None:
    for axis, about in zip(np.eye(3), (rotation.rx, rotation.ry, rotation.rz), strict=True):
        np.testing.assert_allclose(rotation.about_axis(axis, turn), about(turn), atol=1e-12)


@given(angle, angle)
def test_angles_wrap_and_the_short_way_round_is_short(a: float, b: float) -> None:
    assert -np.pi <= float(angles.wrap(a)) < np.pi
    assert abs(float(angles.difference(a, b))) <= np.pi
    assert np.cos(angles.interpolate(a, b, 1.0) - b) == pytest.approx(1.0)
    assert np.cos(angles.interpolate(a, b, 0.0) - a) == pytest.approx(1.0)


def test_interpolation_crosses_the_seam() -> None:
    half = angles.interpolate(np.deg2rad(179.0), np.deg2rad(-179.0), 0.5)
    assert abs(half) == pytest.approx(np.pi)


@given(st.lists(angle, min_size=6, max_size=6))
def test_transforms_are_a_group(values: list[float]) -> None:
    T = transform.make(rotation.from_attitude(*values[:3]), np.array(values[3:]))
    np.testing.assert_allclose(T @ transform.inverse(T), np.eye(4), atol=1e-9)
    points = np.random.default_rng(0).normal(size=(5, 3))
    back = transform.apply(transform.inverse(T), transform.apply(T, points))
    np.testing.assert_allclose(back, points, atol=1e-9)


def test_boxes_refuse_what_is_no_box() -> None:
    one = (np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 3)))
    assert Boxes(*one).corners().shape == (1, 8, 3)
    with pytest.raises(ValueError, match="half_extents must not be negative"):
        Boxes(one[0], one[1], -one[2])
    with pytest.raises(ValueError, match="centers must have shape nx3"):
        Boxes(np.zeros(3), one[1], one[2])
    with pytest.raises(ValueError, match="finite"):
        Boxes(np.full((1, 3), np.nan), one[1], one[2])
    with pytest.raises(ValueError, match="read-only"):
        Boxes(*one).centers[0] = 1.0
