"""The penalty method of Yamashita and Kikuuwe 2025: its corrections, and what it reaches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plan_tasks import judged

from backend.errors import InputError
from backend.planning.trajectory import penalty
from backend.planning.trajectory.course import Setting, setting
from backend.planning.trajectory.curve import curve_along
from backend.planning.trajectory.penalty import (
    PERIOD,
    PRINTED_WIDTH,
    W_A,
    W_AT,
    W_PT,
    W_VT,
    Held,
    Iteration,
    Problem,
    after,
    before,
    beyond,
    descent,
    initial,
    slope,
)
from backend.planning.trajectory.plan import MISSED, plan
from backend.planning.trajectory.recheck import recheck
from backend.planning.trajectory.records import Cylindrical, Obstacles, Trajectory
from backend.planning.trajectory.reference import answer, problem
from backend.planning.trajectory.rows import limit_rows
from backend.planning.trajectory.timing import casadi_timing
from backend.spatial.types import Array
from cockpit.bench_tasks import paper_task

EX13, TASK, OBSTACLES = paper_task()


def within() -> Setting:
    found = setting(EX13, TASK, OBSTACLES)
    assert isinstance(found, Setting)
    return found


@pytest.fixture(scope="module")
def told() -> list[Iteration]:
    return []


@pytest.fixture(scope="module")
def solved(told: list[Iteration]) -> Trajectory:
    made = plan(EX13, TASK, OBSTACLES, "penalty", told.append)
    assert isinstance(made, Trajectory)
    return made


def open_problem() -> Problem:
    """Without obstacles and tipping: limits that do not change with the motion."""
    free = np.inf
    return problem(EX13, TASK, Obstacles(), within())._replace(
        critical=lambda P, A: (np.full(len(P), free), np.full(len(P), free)),
        inside=lambda P: (np.full(len(P), free), np.full(len(P), -free)),
    )


def strayed(asked: Problem) -> tuple[Array, Held]:
    """Accelerations (N, 3) that break every kind of limit, and what a step takes as given."""
    rng = np.random.default_rng(0)
    begun = initial(asked)
    A = begun.acceleration + rng.normal(size=begun.acceleration.shape) * [0.05, 4.0, 3.0]
    free = np.full(len(A), np.inf)
    return A, Held(int(begun.duration / PERIOD), free, free, False, True)


def cost(asked: Problem, A: Array, held: Held) -> float:
    """(24a) without the term of the time."""
    V = before(A)
    norms = [np.linalg.norm(X) for X in beyond(asked, A, V, asked.start + before(V), held)]
    return 0.5 * W_A * float((A**2).sum()) + float(np.dot([W_AT, W_VT, W_PT], norms))


def test_sums_are_the_matrix_and_its_transpose() -> None:
    X = np.random.default_rng(1).normal(size=(7, 3))
    D = PERIOD * np.tril(np.ones((7, 7)), -1)  # (16)
    np.testing.assert_allclose(before(X), D @ X, atol=1e-12)
    np.testing.assert_allclose(after(X), D.T @ X, atol=1e-12)


def test_the_slope_is_that_of_the_penalties_and_the_printed_one_is_not() -> None:
    asked = open_problem()
    A, held = strayed(asked)
    V = before(A)
    over = beyond(asked, A, V, asked.start + before(V), held)
    assert min(np.linalg.norm(X) for X in over) > 0.1
    ours, _, norms = slope(A, over, held.last)
    f_A, f_V, f_P = (X / norm for X, norm in zip(over, norms, strict=True))
    printed = W_A * A + W_AT * f_A + before(W_VT * f_V + before(W_PT * f_P))
    rng, off = np.random.default_rng(2), []
    for _ in range(5):
        way, h = rng.normal(size=A.shape), 1e-6
        change = (cost(asked, A + h * way, held) - cost(asked, A - h * way, held)) / (2.0 * h)
        assert float((ours * way).sum()) == pytest.approx(change, rel=1e-4)
        off.append(abs(float((printed * way).sum()) / change - 1.0))
    assert min(off) > 0.05


def test_the_slope_by_time_is_what_one_sample_more_changes() -> None:
    asked = open_problem()
    begun = initial(asked)
    held = Held(int(begun.duration / PERIOD) - 4, *np.full((2, len(begun.t)), np.inf), False, True)
    motion = begun.acceleration, begun.speed, begun.place
    over = beyond(asked, *motion, held)
    _, by_time, norms = slope(begun.acceleration, over, held.last)
    more = beyond(asked, *motion, held._replace(last=held.last + 1))
    # d|X|^2 = 2 |X| d|X|: one row of X is let go. Places are left out: the floor moves with k_F.
    squares = [np.linalg.norm(X) ** 2 - norm**2 for X, norm in zip(more, norms, strict=True)]
    rises = [square / PERIOD / (2.0 * norm) for square, norm in zip(squares, norms, strict=True)]
    assert max(rises[:2]) < 0.0
    rows = [float((X[held.last + 1] ** 2).sum()) for X in over]
    each = [-row / (2.0 * PERIOD * norm) for row, norm in zip(rows, norms, strict=True)]
    np.testing.assert_allclose(each[:2], rises[:2], rtol=1e-9)
    assert by_time == pytest.approx(penalty.W_TF + float(np.dot([W_AT, W_VT, W_PT], each)))


def test_an_obstacle_is_entered_from_the_machine_and_left_upwards() -> None:
    asked = problem(EX13, TASK, OBSTACLES, within())
    quarter = np.pi / 3  # from 30 to 90 degrees
    entry, height = asked.inside(np.array([[quarter, 5.2, 1.0], [quarter, 4.7, 1.0], [0, 5.2, 1]]))
    c, R = EX13.arm.T_root_swing[:3, 3], EX13.arm.T_root_swing[:3, :3]
    np.testing.assert_allclose(R, np.eye(3), atol=1e-9)
    assert entry[0] == pytest.approx(5.2 - 0.3 - TASK.clearance - c[1], abs=0.02)
    assert height[0] == pytest.approx(1.6 + TASK.clearance, abs=1e-9)
    assert (entry[1:] == np.inf).all()
    assert (height[1:] == -np.inf).all()


def test_every_step_is_told(solved: Trajectory, told: list[Iteration]) -> None:
    assert [step.number for step in told] == list(range(1, len(told) + 1))
    assert solved.way.startswith(f"{len(told)} steps")
    assert told[-1].place < 0.05 * max(step.place for step in told)


def test_the_papers_task_takes_two_percent_more_than_by_a_convex_solver_at_most(
    solved: Trajectory,
) -> None:
    assert not solved.violations
    found = judged(EX13, TASK, OBSTACLES, solved)
    assert not found.contact
    assert not found.tipped
    assert found.missed < MISSED
    curve = curve_along(solved.q, 1.0 / EX13.max_velocity, 0.1)
    asked = within()
    theirs = casadi_timing(limit_rows(EX13, TASK, curve, 160, asked.masses, asked.kept))
    assert theirs is not None
    assert 0.998 * theirs.t[-1] < solved.duration < 1.02 * theirs.t[-1]


def test_the_trapezoids_run_into_the_obstacle_and_ours_do_not() -> None:
    asked = within()
    begun = answer(EX13, TASK, asked, initial(problem(EX13, TASK, OBSTACLES, asked)))
    rest = (asked.masses, asked.whole)
    checks = recheck(EX13, TASK, OBSTACLES, asked.sweep, begun.curve, begun.time, *rest)
    assert checks.min_clearance <= 0.0
    assert begun.missed < 1e-3
    assert begun.over < 1.001
    ours = plan(EX13, TASK, OBSTACLES)
    assert isinstance(ours, Trajectory)
    assert ours.checks.min_clearance > 0.8 * TASK.clearance
    found = judged(EX13, TASK, OBSTACLES, ours)
    assert not found.contact
    assert not found.tipped
    assert found.beyond <= 1.001


def test_with_the_printed_step_it_does_not_settle() -> None:
    asked = within()
    found = descent(problem(EX13, TASK, OBSTACLES, asked), width=PRINTED_WIDTH)
    assert answer(EX13, TASK, asked, found).missed > MISSED
    assert found.duration > 1.1 * initial(problem(EX13, TASK, OBSTACLES, asked)).duration


def test_it_needs_limits_of_the_end_point() -> None:
    with pytest.raises(
        InputError, match="must state speeds and accelerations along theta, r and z"
    ):
        plan(EX13, replace(TASK, cylindrical=Cylindrical()), OBSTACLES, "penalty")
