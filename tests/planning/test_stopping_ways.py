"""Stopping ways against simulated braking, thresholds in words, and stops looked ahead."""

from __future__ import annotations

import numpy as np
import pytest
import separating_axes
from gauge_runs import RAIL

from backend.planning.records import Thresholds
from backend.planning.stopping import (
    braking_path,
    stoppable,
    stopping_ways,
    sufficient_thresholds,
    threshold_warnings,
)

STRETCHED = np.radians([0.0, 20.0, -40.0, -20.0, 0.0, 0.0])
FOLDED = np.radians([0.0, 60.0, -140.0, -20.0, 0.0, 0.0])


def corners(q: np.ndarray) -> np.ndarray:
    """(bodies, 8, 3) placed by the tests' own kinematics."""
    own = separating_axes.placed(RAIL, q[None])
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    local = signs * own.halves[:, None]
    return own.centers[0][:, None] + np.einsum("bij,bkj->bki", own.rotations[0], local)


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("latency", [0.0, 0.3])
def test_the_way_is_what_the_farthest_corner_travels(joint, latency):
    """Braked in small steps; the length of its way is that of the arc."""
    v, a, dt = RAIL.max_velocity[joint], RAIL.max_acceleration[joint], 1e-3
    q = STRETCHED.copy()
    way = np.zeros(corners(q).shape[:2])
    t = 0.0
    before = corners(q)
    while v > 0.0:
        q[joint] += v * dt
        t += dt
        if t >= latency:
            v = max(v - a * dt, 0.0)
        if round(t / dt) % 10 == 0 or v == 0.0:
            after = corners(q)
            way += np.linalg.norm(after - before, axis=2)
            before = after
    want = way[RAIL.body_joints[:, joint]].max()
    got = stopping_ways(RAIL, STRETCHED, latency)[joint]
    assert got == pytest.approx(want, rel=0.01)


def test_thresholds_that_are_too_small_are_told_in_words():
    said = threshold_warnings(RAIL, STRETCHED, Thresholds(), 0.0)
    assert any(s.startswith("swing at full speed needs") and "enters the limit" in s for s in said)
    assert all("p_u must be at least" in s for s in said)
    enough = sufficient_thresholds(RAIL, STRETCHED, 0.2)
    assert enough.upper > 2.0
    assert threshold_warnings(RAIL, STRETCHED, enough, 0.0) == ()
    # A folded arm needs less, and latency more.
    assert sufficient_thresholds(RAIL, FOLDED, 0.2).upper < enough.upper
    assert sufficient_thresholds(RAIL, STRETCHED, 0.2, 0.2).upper > enough.upper


def test_scaling_down_along_sufficient_thresholds_asks_for_no_more_than_a():
    """d' = -v (d - p_l)/(p_u - p_l) of the swing's farthest corner, integrated."""
    enough = sufficient_thresholds(RAIL, STRETCHED, 0.2)
    lever = stopping_ways(RAIL, STRETCHED, 0.0)[0] * 2 * RAIL.max_acceleration[0]
    lever /= RAIL.max_velocity[0] ** 2
    d, rate, dt = enough.upper, RAIL.max_velocity[0], 1e-3
    for _ in range(20_000):
        d -= rate * lever * dt
        slower = RAIL.max_velocity[0] * (d - enough.lower) / (enough.upper - enough.lower)
        assert rate - slower <= RAIL.max_acceleration[0] * dt * (1 + 1e-6)
        rate = slower
    assert d >= enough.lower


def test_the_braking_path_ends_where_braking_in_steps_does():
    random = np.random.default_rng(0)
    for _ in range(4):
        rates = random.uniform(-1.0, 1.0, 6) * RAIL.max_velocity
        path = braking_path(RAIL, STRETCHED, rates, 0.02)
        np.testing.assert_allclose(path[0], STRETCHED + 0.02 * rates)
        q, v = path[0].copy(), rates.copy()
        for _ in range(4_000):
            v = np.sign(v) * np.maximum(np.abs(v) - RAIL.max_acceleration * 1e-3, 0.0)
            q += v * 1e-3
        np.testing.assert_allclose(path[-1], q, atol=1e-3)


def test_a_stop_that_is_not_clear_is_done_at_once():
    rates = np.array([0.5, 0.0, -0.2, 0.0, 0.0, 0.0])
    faster = rates + 0.01

    def falls(q: np.ndarray) -> np.ndarray:
        return 1.0 - 2.0 * np.abs(q - STRETCHED).max(axis=1)

    def clear(q: np.ndarray) -> np.ndarray:
        return np.full(len(q), 0.3)

    kept, as_asked = stoppable(RAIL, STRETCHED, rates, faster, 0.02, clear, 0.2)
    assert as_asked
    np.testing.assert_array_equal(kept, faster)
    braked, as_asked = stoppable(RAIL, STRETCHED, rates, faster, 0.02, falls, 0.9)
    assert not as_asked
    assert (
        np.abs(braked) <= np.maximum(np.abs(rates) - RAIL.max_acceleration * 0.02, 0) + 1e-12
    ).all()
    # Where it stands too near already, whatever does not come nearer is free.
    near = stoppable(RAIL, STRETCHED, rates, faster, 0.02, lambda q: np.full(len(q), 0.1), 0.2)
    assert near[1]
