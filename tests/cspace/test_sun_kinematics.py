"""Eqs. (2), (3), (17)-(21): the chain and its inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from backend.cspace.sun import (
    SunPose,
    d_double_prime,
    d_prime,
    end_point,
    forward_kinematics,
    inverse_kinematics,
    projected_length,
)
from backend.spatial.transform import make

LENGTHS = np.array([1.0, 1.72, 0.951, 0.7])
angle = st.floats(-3.1, 3.1)


def rising(phi: float) -> np.ndarray:
    """Rotation in the x-z plane that raises x for positive phi."""
    c, s = np.cos(phi), np.sin(phi)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


@given(angle, angle, angle, angle)
def test_chain_is_the_product_of_its_joints(p: float, b: float, s: float, k: float) -> None:
    T = np.eye(4)
    for q, length in zip((p, b, s, k), LENGTHS, strict=True):
        T = T @ make(rising(q), np.zeros(3)) @ make(np.eye(3), np.array([length, 0.0, 0.0]))
    assert forward_kinematics(LENGTHS, np.array([p, b, s, k])) == pytest.approx(T, abs=1e-12)


def test_vectorised_over_postures() -> None:
    angles = np.random.default_rng(1).uniform(-2.0, 2.0, (3, 5, 4))
    T = forward_kinematics(LENGTHS, angles)
    x, z = end_point(LENGTHS, angles)
    assert T.shape == (3, 5, 4, 4)
    for i in np.ndindex(3, 5):
        assert T[i] == pytest.approx(forward_kinematics(LENGTHS, angles[i]))
    assert T[..., 0, 3] == pytest.approx(x)
    assert T[..., 2, 3] == pytest.approx(z)
    assert projected_length(LENGTHS, angles) == pytest.approx(np.abs(x))


@given(st.floats(-0.3, 0.3), st.floats(-0.5, 1.2), st.floats(-2.8, 2.8))
def test_inverse_undoes_forward(pitch: float, boom: float, stick: float) -> None:
    assume(abs(stick) > 1e-3)  # the two elbows meet at 0
    phi = np.cumsum([pitch + boom, stick])
    x, z = np.cos(phi) @ LENGTHS[1:3], np.sin(phi) @ LENGTHS[1:3]
    solved = inverse_kinematics(LENGTHS, x, z, pitch, elbow=-1 if stick > 0 else 1)
    assert np.array(solved) == pytest.approx([boom, stick, -boom - stick], abs=1e-6)


def test_d_primes_take_body_and_bucket_off() -> None:
    pose = SunPose(np.zeros(2), 0.0, 0.1, 0.5, -0.9, 0.3, LENGTHS)
    d1 = d_prime(pose.d, 1.0, 0.1)
    assert d1 == pytest.approx(
        1.72 * np.cos(0.6) + 0.951 * np.cos(-0.3) + 0.7 * np.cos(0.0)
    )  # (17)
    assert d_double_prime(d1, 0.7) == pytest.approx(1.72 * np.cos(0.6) + 0.951 * np.cos(-0.3))
    assert d_double_prime(d1, 0.7, 0.1) == pytest.approx(d1 - 0.6)
    assert d_double_prime(0.2, 0.7) == pytest.approx(0.5)  # (18) takes the absolute value


@pytest.mark.parametrize("x", [2.672, 0.768, 0.0, 1e6])
def test_out_of_reach_is_nan(x: float) -> None:
    for values in inverse_kinematics(LENGTHS, np.array([x]), np.array([0.0])):
        assert np.isnan(values).all()


def test_the_stretched_and_the_folded_arm_are_reached() -> None:
    boom, stick, _ = inverse_kinematics(LENGTHS, np.array([2.6709999, 0.7690001]), np.zeros(2))
    assert np.isfinite(boom).all()
    assert stick == pytest.approx([0.0, -np.pi], abs=2e-3)


def test_bad_poses_and_elbows_are_refused() -> None:
    with pytest.raises(ValueError, match="position must have shape 2"):
        SunPose(np.zeros(3), 0.0, 0.0, 0.0, 0.0, 0.0, LENGTHS)
    with pytest.raises(ValueError, match="finite"):
        SunPose(np.zeros(2), np.nan, 0.0, 0.0, 0.0, 0.0, LENGTHS)
    with pytest.raises(ValueError, match="greater than 0"):
        SunPose(np.zeros(2), 0.0, 0.0, 0.0, 0.0, 0.0, np.array([1.0, 0.0, 1.0, 1.0]))
    with pytest.raises(ValueError, match="elbow"):
        inverse_kinematics(LENGTHS, np.ones(1), np.ones(1), elbow=0)
