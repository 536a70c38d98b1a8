"""Yamashita's two-mass limits: the corrected forms put the ZMP on the edge, the printed do not."""

from __future__ import annotations

import numpy as np
import pytest

from backend.stability.masses import GRAVITY, mass_model
from backend.stability.polygon import support_polygon
from backend.stability.simple_model import (
    TwoMasses,
    critical_lift,
    critical_swing,
    two_masses,
    zmp_of_two,
)
from backend.stability.zmp import zmp

CASES = 2000


def random_cases(seed: int) -> TwoMasses:
    random = np.random.default_rng(seed)
    r = random.uniform([-7.0, -7.0, -0.5], [7.0, 7.0, 3.0], (CASES, 3))
    return TwoMasses(
        M=random.uniform(1e3, 3e4, CASES),
        m=random.uniform(2e2, 8e3, CASES),
        H=random.uniform(0.6, 1.5, CASES),
        r_TB=r,
        half=random.uniform(0.4, 2.5, (CASES, 2)),
    )


def zmp_by_cross_products(two: TwoMasses, a_z, omega, a_r):
    """Eq. (3): all of the wrench, then along f to the ground; nothing of Eq. (4)."""
    g = np.array([0.0, 0.0, -GRAVITY])
    r, m, M = two.r_TB, two.m[:, None], two.M[:, None]
    rho = np.linalg.norm(r[:, :2], axis=1)
    flat = r * [1.0, 1.0, 0.0]
    f = m * np.stack([0 * a_z, 0 * a_z, a_z], axis=1) - m * g
    f = f - m * (omega**2)[:, None] * flat + m * (a_r / rho)[:, None] * flat
    whole = f - M * g
    tau = np.cross(r, f)
    point = np.cross(whole, tau) / (whole**2).sum(axis=1, keepdims=True)
    kappa = (-two.H - point[:, 2]) / whole[:, 2]
    return (point + kappa[:, None] * whole)[:, :2]


def test_eq_4_is_eq_3_at_the_ground():
    two, random = random_cases(1), np.random.default_rng(2)
    a_z, omega, a_r = (random.uniform(low, 2.0, CASES) for low in (-2.0, 0.0, -2.0))
    got = zmp_of_two(two, a_z, omega, a_r)
    np.testing.assert_allclose(got, zmp_by_cross_products(two, a_z, omega, a_r), atol=1e-9)


def test_the_critical_swing_puts_the_zmp_on_the_edge():
    two, random = random_cases(3), np.random.default_rng(4)
    a_z, a_r = random.uniform(-1.0, 1.0, CASES), random.uniform(-1.0, 1.0, CASES)
    omega = critical_swing(two, a_z, a_r)
    tested = 0
    for axis in range(2):
        real = np.isfinite(omega[:, axis]) & (omega[:, axis] > 0.0)
        at = zmp_by_cross_products(two, a_z, np.where(real, omega[:, axis], 0.0), a_r)
        off = np.abs(at[:, axis]) - two.half[:, axis]
        np.testing.assert_allclose(off[real], 0.0, atol=1e-9)
        tested += int(real.sum())
        none = omega[:, axis] == 0.0  # tips without turning
        assert (off[none] >= -1e-12).all()
    assert tested > CASES


def test_the_critical_lift_puts_the_zmp_on_the_edge():
    two = random_cases(5)
    a = critical_lift(two)
    still, tested = np.zeros(CASES), 0
    for axis in range(2):
        real = np.isfinite(a[:, axis]) & (a[:, axis] > 0.0)
        at = zmp_by_cross_products(two, np.where(real, a[:, axis], 0.0), still, still)
        off = np.abs(at[:, axis]) - two.half[:, axis]
        np.testing.assert_allclose(off[real], 0.0, atol=1e-9)
        tested += int(real.sum())
        inside = np.abs(two.r_TB[:, axis]) <= two.half[:, axis]
        assert np.isinf(a[inside, axis]).all()
        hard = zmp_by_cross_products(two, np.full(CASES, 50.0), still, still)
        assert (np.abs(hard[inside, axis]) <= two.half[inside, axis]).all()
    assert tested > 0.5 * CASES


def test_printed_eq_9_lies_seven_times_too_high():
    M, m, H, half, r, r_z = 11e3, 3e3, 1.0, 1.1, 5.0, 0.5
    two = TwoMasses(*(np.array(x) for x in (M, m, H, [r, 0.0, r_z], [half, half])))
    correct = critical_swing(two)[0]
    above = GRAVITY * (half * (1.0 + M / m) / 2.0 - r)
    below = r * -H - (half / 2.0 - r) * r_z
    printed = np.sqrt(max(above / below, 0.0))
    assert correct == pytest.approx(0.42, abs=0.005)
    assert printed == pytest.approx(2.93, abs=0.005)
    assert zmp_of_two(two, 0.0, correct)[0] == pytest.approx(half, abs=1e-12)
    assert zmp_of_two(two, 0.0, printed)[0] > 2.0 * half


def test_printed_eq_7_calls_a_load_between_the_tracks_dangerous():
    M, m, half, r = 11e3, 3e3, 1.1, 0.2
    two = TwoMasses(
        *(np.array(x) for x in (M, m, 1.0, [r, 0.0, 0.5], [half, half])),
    )
    printed = max(-GRAVITY * (half * (m + M) - m * r) / (m * (half - r)), 0.0)
    assert printed == 0.0  # "a risk of tipping over, regardless of the operations"
    assert np.isinf(critical_lift(two)).all()


def test_on_the_swing_axis_no_rate_tips():
    two = TwoMasses(*(np.array(x) for x in (1e4, 2e3, 1.0, [0.0, 0.0, 1.0], [1.0, 1.0])))
    assert np.isinf(critical_swing(two)).all()


def test_a_machine_at_rest_is_the_same_as_its_two_masses(machine, draw):
    q, _, _ = draw(machine, np.random.default_rng(6), 30)
    model, support = mass_model(machine, 300.0), support_polygon(machine)
    two = two_masses(model, support, q)
    assert np.allclose(two.M + two.m, model.total)
    whole = zmp(model, q, 0 * q, 0 * q)
    outwards = np.where(two.r_TB[:, :2] >= 0.0, 1.0, -1.0)
    edge = support.vertices.max(axis=0)
    left = two.half - outwards * zmp_of_two(two)
    np.testing.assert_allclose(left, edge - outwards * whole, atol=1e-9)
