"""Timing along a curve: as fast as a convex solver finds, within every limit."""

from __future__ import annotations

import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.load import load_machine
from backend.planning.trajectory.carry import attitude_of, cylinder
from backend.planning.trajectory.curve import Curve, curve_along
from backend.planning.trajectory.records import Cylindrical, Task
from backend.planning.trajectory.rows import limit_rows
from backend.planning.trajectory.timing import casadi_timing, timed, toppra_timing
from backend.spatial.types import Array
from backend.stability.masses import mass_model
from backend.stability.polygon import shrunk, support_polygon
from backend.stability.zmp import edge_moments
from cockpit.bench_tasks import lifted_curve

EX13 = load_machine("ex13")


def paper_curve() -> tuple[Task, Curve]:
    return lifted_curve()[1:]


@pytest.mark.parametrize("share", [0.0, 0.2, 0.45])
def test_the_papers_task_takes_no_longer_than_by_a_convex_solver(share: float) -> None:
    task, curve = paper_curve()
    masses, support = mass_model(EX13, task.payload), shrunk(support_polygon(EX13), share)
    rows = limit_rows(EX13, task, curve, 160, masses, support)
    ours, theirs = toppra_timing(rows), casadi_timing(rows)
    assert ours is not None
    assert theirs is not None
    assert ours.t[-1] == pytest.approx(theirs.t[-1], rel=2e-3)
    for found in (ours, theirs):
        kept = rows.a[:-1] * found.u[:, None] + rows.b[:-1] * found.speed[:-1, None] ** 2
        assert (kept - rows.c[:-1]).max() < 1e-4
        assert (found.speed**2 - rows.most).max() < 1e-6


def test_tipping_limits_slow_the_machine_down_and_are_kept_by_the_full_model() -> None:
    task, curve = paper_curve()
    heavy = mass_model(EX13, 1500.0)
    whole = support_polygon(EX13)
    support = shrunk(whole, 0.45)
    slow = toppra_timing(limit_rows(EX13, task, curve, 200, heavy, support))
    free = toppra_timing(limit_rows(EX13, task, curve, 200, None, support))
    assert slow is not None
    assert free is not None
    assert slow.t[-1] > free.t[-1] * 1.01
    t = np.linspace(0, slow.t[-1], 3000)
    motion = slow.sampled(curve, t)
    weight = 9.81 * heavy.total
    # Between grid points up to a few millimetres of the weight's lever are lost.
    assert edge_moments(heavy, support, *motion).min() / weight > -5e-3
    hasty = free.sampled(curve, np.linspace(0, free.t[-1], 3000))
    assert edge_moments(heavy, support, *hasty).min() / weight < -5e-3


def test_limits_along_theta_r_z_hold_by_differences() -> None:
    task, curve = paper_curve()
    limits = Cylindrical(np.array([0.3, 0.2, 0.25]), np.array([0.2, 0.1, 0.15]))
    task = Task(task.q, task.p_root, cylindrical=limits)
    found = toppra_timing(limit_rows(EX13, task, curve, 240, None, support_polygon(EX13)))
    assert found is not None
    h = 0.01
    t = np.arange(0.0, found.t[-1], h)
    where = cylinder(EX13, found.sampled(curve, t)[0])
    speed = np.abs(np.diff(where, axis=0)).max(axis=0) / h
    assert (speed <= limits.speed * 1.02).all()
    assert speed[2] > 0.2  # it lifts as fast as it may
    # Averaged over a tenth of a second, as the acceleration jumps.
    wide = 10
    hard = np.abs(where[2 * wide :] - 2 * where[wide:-wide] + where[: -2 * wide]) / (wide * h) ** 2
    assert (hard.max(axis=0) <= limits.acceleration * 1.1).all()


def test_one_joint_alone_follows_the_trapezoid() -> None:
    q = np.array([0.0, 0.6, -1.2, -0.4])
    mini = load_machine("mini")
    points = q + np.linspace(0, 1, 5)[:, None] * [2.0, 0, 0, 0]
    curve = curve_along(points, 1.0 / mini.max_velocity, 0.3)
    task = Task(q, np.zeros(3))
    found = toppra_timing(limit_rows(mini, task, curve, 400, None, support_polygon(mini)))
    assert found is not None
    v, a = mini.max_velocity[0], mini.max_acceleration[0]
    assert found.t[-1] == pytest.approx(2.0 / v + v / a, rel=5e-3)
    values, rates, hard = found.sampled(curve, np.array([0.0, found.t[-1] / 2, found.t[-1]]))
    np.testing.assert_allclose(values[[0, -1]], points[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(rates[:, 0], [0.0, v, 0.0], atol=1e-6)
    assert hard[0, 0] == pytest.approx(a, rel=1e-5)


def test_sampled_motion_is_the_derivative_of_itself() -> None:
    task, curve = paper_curve()
    found = toppra_timing(limit_rows(EX13, task, curve, 160, None, support_polygon(EX13)))
    assert found is not None
    t, h = np.linspace(0.1, found.t[-1] - 0.1, 50), 1e-5
    q0, q1 = (found.sampled(curve, t + d)[0] for d in (-h, h))
    np.testing.assert_allclose((q1 - q0) / (2 * h), found.sampled(curve, t)[1], atol=1e-4)
    slow = found.slowed(2.0)
    np.testing.assert_allclose(slow.sampled(curve, 2 * t)[0], found.sampled(curve, t)[0], atol=1e-9)
    np.testing.assert_allclose(
        slow.sampled(curve, 2 * t)[2], found.sampled(curve, t)[2] / 4, atol=1e-6
    )


def test_a_curve_keeps_straight_legs_and_is_twice_differentiable() -> None:
    corners: Array = np.array([[0.0, 0, 0, 0], [1.0, 0.2, 0, 0], [1.0, 0.2, 0.8, 0.1]])
    curve = curve_along(corners, np.ones(4), 0.1)
    s = np.linspace(0, curve.length, 500)
    q = curve.at(s)
    np.testing.assert_allclose(q[[0, -1]], corners[[0, -1]], atol=1e-12)
    early = s < 0.6
    np.testing.assert_allclose(q[early], s[early, None] * corners[1], atol=1e-9)
    assert np.abs(np.diff(curve.at(s, 2), axis=0)).max() < 0.2 * curve.most_bent.max()
    assert (np.abs(curve.at(s, 2)).max(axis=0) <= curve.most_bent + 1e-9).all()


def test_the_attitude_is_kept_on_the_way() -> None:
    _, curve = paper_curve()
    control = curve.spline.c
    np.testing.assert_allclose(attitude_of(EX13, control), -1.9, atol=1e-9)


def test_times_from_speeds() -> None:
    task, curve = paper_curve()
    rows = limit_rows(EX13, task, curve, 4, None, support_polygon(EX13))
    x = np.array([0.0, 1.0, 1.0, 1.0, 0.0])
    step = curve.length / 4
    np.testing.assert_allclose(timed(rows, x).t, np.array([0, 2, 3, 4, 6]) * step)


def test_limits_must_be_above_zero() -> None:
    with pytest.raises(InputError, match="three numbers above 0"):
        Cylindrical(np.array([0.3, 0.0, 1.0]))
