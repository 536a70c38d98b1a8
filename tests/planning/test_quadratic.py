"""Quadratic programs against their optimality conditions, SLSQP and a linear program."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from backend.planning.quadratic import minimise, minimise_softly


def program(random: np.random.Generator, rows: int) -> tuple[np.ndarray, ...]:
    n = int(random.integers(1, 8))
    M = random.normal(size=(n, n))
    H = M @ M.T + 0.1 * np.eye(n)
    shift = random.choice([0.3, 1.5])
    return (
        H,
        3.0 * random.normal(size=n),
        random.normal(size=(rows, n)),
        (random.normal(size=rows) - shift),
    )


def feasible(A: np.ndarray, b: np.ndarray) -> bool:
    found = linprog(np.zeros(A.shape[1]), A_ub=-A, b_ub=-b, bounds=(None, None), method="highs")
    return found.status == 0


def test_random_programs_meet_the_conditions_of_karush_kuhn_and_tucker():
    random = np.random.default_rng(0)
    met = failed = 0
    for _ in range(300):
        H, g, A, b = program(random, int(random.integers(0, 25)))
        found = minimise(H, g, A, b)
        assert found.feasible == feasible(A, b)
        if not found.feasible:
            failed += 1
            continue
        met += 1
        slack = A @ found.x - b
        np.testing.assert_allclose(H @ found.x + g, A.T @ found.multipliers, atol=1e-7)
        assert slack.min(initial=0.0) > -1e-8
        assert found.multipliers.min(initial=0.0) >= -1e-9
        assert np.abs(found.multipliers * slack).max(initial=0.0) < 1e-6
    assert met > 80
    assert failed > 50


def test_random_programs_against_slsqp():
    random = np.random.default_rng(1)
    compared = 0
    while compared < 25:
        H, g, A, b = program(random, 12)
        found = minimise(H, g, A, b)
        if not found.feasible:
            continue
        compared += 1

        def value(x: np.ndarray, H: np.ndarray = H, g: np.ndarray = g) -> float:
            return float(0.5 * x @ H @ x + g @ x)

        other = minimize(
            value,
            np.zeros(len(g)),
            jac=lambda x, H=H, g=g: H @ x + g,
            constraints=[
                {"type": "ineq", "fun": lambda x, A=A, b=b: A @ x - b, "jac": lambda x, A=A: A}
            ],
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 500},
        )
        if other.success:
            assert value(found.x) <= other.fun + 1e-6 * max(1.0, abs(other.fun))
            np.testing.assert_allclose(found.x, other.x, atol=1e-3)


def test_repeated_and_dependent_rows_are_no_trouble():
    H, g = np.eye(3), np.array([-5.0, -5.0, 0.0])
    A = np.array([[-1.0, 0, 0], [-1.0, 0, 0], [-2.0, 0, 0], [-1.0, -1.0, 0], [0, -1.0, 0]])
    found = minimise(H, g, A, np.array([-1.0, -1.0, -2.0, -2.0, -1.0]))
    assert found.feasible
    np.testing.assert_allclose(found.x, [1.0, 1.0, 0.0], atol=1e-9)


def test_soft_rows_are_missed_by_as_little_as_may_be():
    # x >= 2 (soft), x <= 1 (hard): the miss is 1, and it is shared by all soft rows.
    A, b = np.array([[1.0], [-1.0]]), np.array([2.0, -1.0])
    assert not minimise(np.eye(1), np.zeros(1), A, b).feasible
    found = minimise_softly(np.eye(1), np.zeros(1), A, b, np.array([True, False]), 1e6)
    assert found.feasible
    assert found.x[0] == pytest.approx(1.0, abs=1e-5)
