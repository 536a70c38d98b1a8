"""Dynamics: limits hold whatever is demanded; first-order lag and tracks against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.machine.load import load_machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step

MACHINE = load_machine("mini")
LIMITS = limits_of(MACHINE)
LAGS = Hydraulics()
DT = 0.005


def rest(q=(0.0, 0.3, -1.2, 0.1)):
    return SimState(np.array(q), np.zeros(4), np.zeros(3), 0.0, 0.0, 0.0, np.zeros(2))


def run(state, demand, seconds):
    states = [state]
    for _ in range(round(seconds / DT)):
        states.append(step(states[-1], demand, LIMITS, LAGS, DT))
    return states


speeds = st.lists(st.floats(-10.0, 10.0), min_size=4, max_size=4).map(np.array)


@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(speeds, st.integers(1, 100)), min_size=1, max_size=6))
def test_limits_hold_whatever_is_demanded(demands):
    state = rest()
    for joints, steps in demands:
        for _ in range(steps):
            after = step(state, Demand(joints, np.zeros(2)), LIMITS, LAGS, DT)
            assert (after.q >= LIMITS.lower).all()
            assert (after.q <= LIMITS.upper).all()
            assert (np.abs(after.qd) <= LIMITS.velocity + 1e-12).all()
            bounded = np.isinf(LIMITS.upper)  # at a limit a joint may stop at once
            change = np.abs(after.qd - state.qd)
            assert (change[bounded] <= LIMITS.acceleration[bounded] * DT + 1e-12).all()
            state = after


def test_joint_brakes_before_its_limit():
    """It arrives at the limit slowly: no stop is harder than the acceleration allows, nearly."""
    states = run(rest(), Demand(np.array([0.0, 10.0, 0.0, 0.0]), np.zeros(2)), 6.0)
    speed = np.array([s.qd[1] for s in states])
    assert states[-1].q[1] == pytest.approx(LIMITS.upper[1], abs=1e-3)
    assert abs(states[-1].qd[1]) < 1e-3
    assert np.abs(np.diff(speed)).max() / DT < 1.3 * LIMITS.acceleration[1]


def test_small_demand_is_a_first_order_lag():
    wanted = 0.01
    states = run(rest(), Demand(np.array([wanted, 0.0, 0.0, 0.0]), np.zeros(2)), 0.5)
    for i in (4, 16, 50, 100):
        exact = wanted * (1.0 - math.exp(-i * DT / LAGS.joint_lag))
        assert states[i].qd[0] == pytest.approx(exact, rel=1e-9)


def test_stop_from_full_swing():
    going = run(rest(), Demand(LIMITS.velocity * [1, 0, 0, 0], np.zeros(2)), 3.0)[-1]
    assert going.qd[0] == pytest.approx(LIMITS.velocity[0], rel=1e-6)
    stopped = run(going, Demand(np.zeros(4), np.zeros(2)), 2.0)[-1]
    assert abs(stopped.qd[0]) < 1e-3


def test_tracks_straight_turn_and_slope():
    still = np.zeros(4)
    slow = 0.1  # below every limit, so that only the lag counts
    state = replace(rest(), yaw=0.5, pitch=0.2)
    ahead = run(state, Demand(still, np.array([slow, slow])), 10.0)[-1]
    way = slow * (10.0 - LAGS.track_lag)
    expected = way * np.array(
        [math.cos(0.5) * math.cos(0.2), math.sin(0.5) * math.cos(0.2), math.sin(0.2)]
    )
    np.testing.assert_allclose(ahead.position, expected, atol=1e-3)
    turned = run(rest(), Demand(still, np.array([-slow, slow])), 5.0)[-1]
    np.testing.assert_allclose(turned.position, 0.0, atol=1e-12)
    rate = 2 * slow / MACHINE.tracks.gauge
    assert turned.yaw == pytest.approx(rate * (5.0 - LAGS.track_lag), abs=1e-3)


def test_tracks_circle_has_the_radius_of_differential_drive():
    state = run(rest(), Demand(np.zeros(4), np.array([0.1, 0.2])), 3.0)[-1]  # past the lag
    radius = 0.5 * MACHINE.tracks.gauge * (0.2 + 0.1) / (0.2 - 0.1)
    center = state.position + radius * np.array([-math.sin(state.yaw), math.cos(state.yaw), 0.0])
    for later in run(state, Demand(np.zeros(4), np.array([0.1, 0.2])), 5.0)[::100]:
        assert np.linalg.norm(later.position - center) == pytest.approx(radius, rel=1e-5)


def test_lags_must_be_positive():
    with pytest.raises(ValueError, match="greater than 0"):
        Hydraulics(joint_lag=0.0)
