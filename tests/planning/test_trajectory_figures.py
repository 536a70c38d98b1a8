"""What the figures of trajectories plot, against direct sums."""

from __future__ import annotations

import numpy as np
import pytest

from backend.machine.kinematics import end_point
from backend.machine.load import load_machine
from backend.planning.trajectory.figures import initial_motion, motion_of, seen_motion
from backend.planning.trajectory.plan import plan
from backend.planning.trajectory.records import Obstacles, Task, Trajectory
from backend.stability.dynamics import centres
from backend.stability.masses import mass_model

MINI = load_machine("mini")
START = np.array([0.0, 0.6, -1.2, -0.4])
GOAL = np.array([1.4, 1.0, -1.0, -0.6])


def carried(q: np.ndarray, payload: float) -> np.ndarray:  # type: ignore[type-arg]
    """(m, 3) centre of what boom, stick, bucket and load are, summed here."""
    model = mass_model(MINI, payload)
    at = centres(model, q)
    chain = [b for b in range(len(model.masses)) if model.joints[b] >= 1]
    weight = model.masses[chain]
    return np.einsum("b,bmx->mx", weight, at[chain]) / weight.sum()


def test_the_simple_one_is_straight_and_as_fast_as_joints_allow() -> None:
    task = Task(START, end_point(MINI, GOAL))
    made = initial_motion(MINI, task, GOAL, step=0.01)
    np.testing.assert_allclose(made.q[0], START, atol=1e-12)
    np.testing.assert_allclose(made.q[-1], GOAL, atol=1e-9)
    along = (made.q - START) @ (GOAL - START) / np.sum((GOAL - START) ** 2)
    np.testing.assert_allclose(made.q, START + along[:, None] * (GOAL - START), atol=1e-9)
    rates = np.diff(made.q, axis=0) / np.diff(made.time)[:, None]
    shares = np.abs(rates).max(axis=0) / MINI.max_velocity
    hard = np.abs(np.diff(rates[:-1], axis=0) / 0.01).max(axis=0) / MINI.max_acceleration
    assert max(shares.max(), hard.max()) == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(
        np.gradient(made.q[:, 0], made.time)[5:-5], made.swing[5:-5], atol=0.01
    )
    slower = initial_motion(MINI, Task(START, task.p_root, speeds=0.1 * MINI.max_velocity), GOAL)
    assert slower.time[-1] > 3.0 * made.time[-1]


def test_lift_is_the_moving_masses_and_the_planned_keeps_within_the_limits() -> None:
    task = Task(START, end_point(MINI, GOAL), payload=60.0)
    made = plan(MINI, task, Obstacles())
    assert isinstance(made, Trajectory)
    found = motion_of(MINI, 60.0, made.time, made.q, made.rates, made.accelerations)
    fine = np.linspace(0.0, made.duration, 4001)
    q = np.stack([np.interp(fine, made.time, column) for column in made.q.T], axis=1)
    height = carried(q, 60.0)[:, 2]
    # Over the whole way the speed that the accelerations sum up to: it begins and ends at rest.
    speed = np.gradient(height, fine)
    summed = np.concatenate(
        [[0.0], np.cumsum(0.5 * (found.lift[1:] + found.lift[:-1]) * np.diff(made.time))]
    )
    np.testing.assert_allclose(np.interp(made.time, fine, speed)[2:-2], summed[2:-2], atol=0.06)
    np.testing.assert_array_equal(found.swing, made.rates[:, 0])
    assert np.all(found.critical_lift > 0.0)
    assert np.all(found.critical_swing > 0.0)


def test_what_sensors_saw_of_it_is_the_same_within_their_noise() -> None:
    task = Task(START, end_point(MINI, GOAL))
    made = plan(MINI, task, Obstacles())
    assert isinstance(made, Trajectory)
    t = np.arange(0.0, made.duration, 0.02)
    rng = np.random.default_rng(1)
    q = np.stack([np.interp(t, made.time, column) for column in made.q.T], axis=1)
    noisy = q + np.radians(0.02) * rng.standard_normal(q.shape)
    rates = np.stack([np.interp(t, made.time, column) for column in made.rates.T], axis=1)
    picked = np.arange(0, len(t), 3)
    found = seen_motion(MINI, 0.0, t, noisy, rates, picked)
    planned = motion_of(MINI, 0.0, made.time, made.q, made.rates, made.accelerations)
    assert len(found.time) == len(picked)
    middle = slice(5, -5)
    smooth = np.convolve(np.interp(t, planned.time, planned.lift), np.ones(25) / 25, "same")[picked]
    assert np.abs(found.lift[middle] - smooth[middle]).mean() < 0.15
    np.testing.assert_allclose(
        found.critical_lift[middle],
        np.interp(t[picked], planned.time, planned.critical_lift)[middle],
        rtol=0.05,
    )
    few = seen_motion(MINI, 0.0, t[:2], noisy[:2], rates[:2], np.array([0, 1]))
    assert np.isnan(few.lift).all()
    none = seen_motion(MINI, 0.0, t[:0], noisy[:0], rates[:0], np.zeros(0, np.int64))
    assert len(none.time) == 0


def test_of_masses_that_are_not_known_nothing_is_said() -> None:
    from dataclasses import replace

    vague = replace(MINI, masses_trusted=False)
    rows = np.tile(START, (3, 1))
    found = motion_of(vague, 0.0, np.arange(3.0), rows, 0.0 * rows, 0.0 * rows)
    assert np.isnan(found.lift).all()
    assert np.isnan(found.critical_swing).all()
    np.testing.assert_array_equal(found.swing, np.zeros(3))
