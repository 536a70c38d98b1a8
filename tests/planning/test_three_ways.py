"""The three ways to act near limits, on toy scenes and random ones."""

from __future__ import annotations

import numpy as np
import pytest
from gauge_runs import DRIVING, RAIL
from scipy.optimize import minimize

from backend.errors import InputError
from backend.machine.pose import tool_jacobian
from backend.planning import constrained, potential
from backend.planning.act import act, sight, task_rates
from backend.planning.careless import careless_drive
from backend.planning.cushion import cushioned, rate_bounds
from backend.planning.proximity import Limits, Sight, gradients, near_points, posed
from backend.planning.records import (
    Settings,
    State,
    Thresholds,
    Wish,
    damper_rate,
)
from backend.planning.velocity_scaling import distances_ahead
from backend.spatial.boxes import NO_BOXES, Boxes

Q = np.radians([0.0, 25.0, -80.0, -35.0, 0.0, 0.0])
STILL = State(np.zeros(6))
IDEAL = Settings(rate=1.0 / 0.6)
DT = 0.02


def wall(gap: float, q: np.ndarray = Q) -> Limits:
    """A wall across the machine's front, `gap` [m] ahead of its farthest point."""
    far = Limits(("wall",), Boxes([[40.0, 0.0, 0.0]], [np.eye(3)], [[1.0, 20.0, 20.0]]))
    near = near_points(RAIL, posed(RAIL, q), far, Sight.everywhere(RAIL, 100.0), own=False)
    x = 40.0 - float(near.distance.min()) + gap
    return Limits(("wall",), Boxes([[x, 0.0, 0.0]], [np.eye(3)], [[1.0, 20.0, 20.0]]))


def close(limits: Limits, q: np.ndarray = Q, corners: bool = True):
    return near_points(RAIL, posed(RAIL, q), limits, Sight.everywhere(RAIL, 3.0), corners)


def tool(x: float, y: float, z: float) -> Wish:
    return Wish(twist=np.array([x, y, z, 0.0, 0.0, 0.0]))


# Method A


@pytest.mark.parametrize(("gap", "want"), [(1.0, 1.0), (0.5, 0.5), (0.35, 0.25), (0.15, 0.0)])
def test_scaling_is_linear_between_the_thresholds(gap, want):
    near = close(wall(gap))
    slow = tool(1e-4, 0.0, 0.0)
    free = task_rates(RAIL, posed(RAIL, Q), slow, 0.1)
    done = act("scaling", RAIL, Q, slow, near, STILL, DT)
    assert done.scale == pytest.approx(want, abs=1e-4)
    np.testing.assert_allclose(done.rates, want * free, atol=1e-8)
    assert bool(done.why) == (want < 1.0)
    if done.why:
        assert "wall" in done.why[0]


@pytest.mark.parametrize("gap", [0.5, 0.21, 0.1])
def test_moving_away_is_at_full_speed(gap):
    near = close(wall(gap))
    back = tool(-0.3, 0.0, 0.0)
    done = act("scaling", RAIL, Q, back, near, STILL, DT)
    np.testing.assert_array_equal(done.rates, task_rates(RAIL, posed(RAIL, Q), back, 0.1))
    assert done.scale == 1.0


def test_levers_are_slowed_one_by_one():
    """Raising the stick reaches out, lowering it draws in; the swing passes along the wall."""
    near = close(wall(0.2))
    out = act("scaling", RAIL, Q, Wish(rates=np.array([0.3, 0, 0.4, 0, 0, 0])), near, STILL, DT)
    assert out.rates[2] == 0.0
    draw = act("scaling", RAIL, Q, Wish(rates=np.array([0.3, 0, -0.4, 0, 0, 0])), near, STILL, DT)
    assert draw.rates[2] == -0.4


def test_one_step_never_oversteps_the_lower_threshold():
    random = np.random.default_rng(0)
    for gap in random.uniform(0.2, 0.8, 40):
        limits = wall(float(gap))
        fast = tool(*random.uniform(-3.0, 3.0, 3))
        done = act("scaling", RAIL, Q, fast, close(limits), STILL, DT)
        after = close(limits, Q + done.rates * DT)
        outer = after.distance[after.obstacle >= 0]
        assert outer.min() >= 0.2 - 1e-6


def test_distances_ahead_of_a_wall_are_exact_for_corners():
    limits = wall(0.4)
    near = close(limits)
    q = Q + np.array([0.0, 0.01, 0.02, 0.0, 0.0, 0.0])
    ahead = distances_ahead(RAIL, posed(RAIL, Q), posed(RAIL, q), near)
    outer = near.obstacle >= 0
    there = close(limits, q)
    assert ahead[outer].min() == pytest.approx(there.distance[there.obstacle >= 0].min(), abs=1e-9)


# Method B


def test_repulsion_speed_is_minus_the_gradient_of_the_potential():
    thresholds, mu = Thresholds(), 0.01

    def U(p: float) -> float:
        return 0.5 * mu * (1.0 / p - 1.0 / 0.8) ** 2

    for p in (0.1, 0.3, 0.6, 0.79):
        want = -(U(p + 1e-6) - U(p - 1e-6)) / 2e-6
        assert potential.repulsion_speed(p, mu, thresholds) == pytest.approx(want, rel=1e-5)
    assert potential.repulsion_speed(0.8, mu, thresholds) == 0.0
    assert potential.repulsion_speed(5.0, mu, thresholds) == 0.0


@pytest.mark.parametrize("gap", [0.1, 0.4, 0.75])
@pytest.mark.parametrize("projector", ["first joints", "position kept", "printed"])
def test_what_is_nearest_repels_unless_the_projector_is_as_printed(gap, projector):
    limits = wall(gap)
    near = close(limits, corners=False)
    near = near.take(np.flatnonzero(near.obstacle >= 0))
    J = tool_jacobian(RAIL, Q)
    points = near.take(potential.obstacle_avoidance_points(RAIL, near))
    away = potential.repulsion(RAIL, posed(RAIL, Q), points, J, 0.01, Thresholds(), 0.1, projector)
    k = int(np.argmin(near.distance))
    parting = float(gradients(RAIL, posed(RAIL, Q), near)[k] @ away)
    if projector == "printed":
        assert np.abs(away).max() < 1e-9
        return
    assert parting > 1e-5
    if projector == "first joints":
        assert np.abs(away[3:]).max() == 0.0
    else:
        assert np.abs(J[:3] @ away).max() < 1e-9


def test_beyond_the_upper_threshold_the_task_alone_counts():
    near = close(wall(0.9))
    near = near.take(np.flatnonzero(near.distance > 0.8))
    wish = tool(0.1, 0.2, 0.0)
    done = act("potential", RAIL, Q, wish, near, STILL, DT)
    np.testing.assert_array_equal(done.rates, task_rates(RAIL, posed(RAIL, Q), wish, 0.1))


# Method C


def test_far_from_everything_the_wish_is_done():
    nothing = near_points(
        RAIL, posed(RAIL, Q), Limits((), NO_BOXES), Sight.everywhere(RAIL, 0.3), True
    )
    for wish in (tool(0.1, 0.2, 0.1), Wish(rates=np.array([0.1, 0.2, -0.3, 0.1, 0.0, 0.5]))):
        done = act("constrained", RAIL, Q, wish, nothing, STILL, DT, IDEAL)
        np.testing.assert_allclose(
            done.rates, task_rates(RAIL, posed(RAIL, Q), wish, 0.1), atol=1e-9
        )
        assert done.scale == pytest.approx(1.0)
        assert done.why == ()


def test_along_a_wall_the_tool_slides():
    near = close(wall(0.2))
    near = near.take(np.flatnonzero(near.obstacle >= 0))
    done = act("constrained", RAIL, Q, tool(0.3, 0.0, 0.3), near, STILL, DT, IDEAL)
    velocity = tool_jacobian(RAIL, Q)[:3] @ done.rates
    assert (gradients(RAIL, posed(RAIL, Q), near) @ done.rates >= -1e-6 - near.distance + 0.2).all()
    assert velocity[2] > 0.2
    assert "wall" in done.why[0]


def test_inside_it_retreats_even_against_the_wish():
    near = close(wall(0.1))
    near = near.take(np.flatnonzero(near.obstacle >= 0))
    done = act("constrained", RAIL, Q, tool(0.5, 0.0, 0.0), near, STILL, DT, IDEAL)
    k = int(np.argmin(near.distance))
    want = min(IDEAL.retreat, (0.2 - 0.1) / 0.6)
    assert gradients(RAIL, posed(RAIL, Q), near)[k] @ done.rates >= want - 1e-6


def test_dampers_and_bounds_hold_and_nothing_nearer_to_the_wish_does():
    """Random scenes and sticks; SLSQP finds nothing better."""
    random = np.random.default_rng(1)
    compared = 0
    for seed in range(12):
        plan = careless_drive(RAIL, seed, 1.0)
        q, T = plan.q_start, posed(RAIL, plan.q_start)
        wish = random.choice([-1.0, 1.0], 6) * RAIL.max_velocity
        sees = sight(RAIL, T, "constrained", IDEAL, STILL, DT)
        near = near_points(RAIL, T, plan.limits, sees, True)
        done = act("constrained", RAIL, q, Wish(rates=wish), near, STILL, DT, IDEAL)
        G = gradients(RAIL, T, near)
        least = constrained.damper_bounds(near.distance, IDEAL, 1.0 / 0.6)
        low, high = rate_bounds(RAIL, q, np.zeros(6), DT, False)
        assert (G @ done.rates >= least - 1e-7).all()
        assert (done.rates >= low - 1e-9).all()
        assert (done.rates <= high + 1e-9).all()
        H, g = constrained.nearest_to_rates(wish, RAIL.max_velocity)
        other = minimize(
            lambda x, H=H, g=g: 0.5 * x @ H @ x + g @ x,
            np.zeros(6),
            jac=lambda x, H=H, g=g: H @ x + g,
            bounds=list(zip(low, high, strict=True)),
            constraints=[{"type": "ineq", "fun": lambda x, G=G, b=least: G @ x - b}],
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 300},
        )
        if other.success:
            compared += 1
            np.testing.assert_allclose(done.rates, other.x, atol=2e-3)
    assert compared >= 8


def test_rows_that_contradict_each_other_are_missed_alike():
    H, g = constrained.nearest_to_rates(np.zeros(2), np.ones(2))
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    found = constrained.constrain(H, g, G, np.array([0.2, 0.4]), -np.ones(2), np.ones(2))
    assert not found.kept
    np.testing.assert_allclose(found.rates, [-0.1, 0.0], atol=1e-4)


def test_standing_still_keeps_every_damper_outside_of_the_limits():
    settings = Settings()
    distance = np.array([0.2, 0.3, 5.0])
    assert (constrained.damper_bounds(distance, settings, 1.0) <= 0.0).all()


def test_the_dampers_slope_asks_for_no_more_than_the_joints_decelerations():
    rate = damper_rate(RAIL)
    assert (rate * RAIL.max_velocity <= RAIL.max_acceleration + 1e-12).all()
    assert rate > 0.5


# All of them


def test_end_cushions_are_never_left_faster_than_the_joint_can_brake():
    """At the highest rate allowed, step after step: it stops at the end, braking by a at most."""
    q, rate = np.zeros(6), np.zeros(6)
    q[1:5] = [0.0, -1.5, 0.0, 0.0]
    for _ in range(600):
        _, high = rate_bounds(RAIL, q, rate, DT, True)
        assert (rate - high <= RAIL.max_acceleration * DT + 1e-9).all()
        q, rate = q + high * DT, high
        assert (q <= RAIL.upper + 1e-9).all()
    np.testing.assert_allclose(q[1:5], RAIL.upper[1:5], atol=0.01)
    low, high = cushioned(RAIL, RAIL.upper.clip(max=0.0) + 0.01, DT)
    assert (low < 0.0).all()
    assert (high[[2]] == 0.0).all()


@pytest.mark.parametrize("method", ["scaling", "potential", "constrained"])
def test_accelerations_are_kept_where_asked(method):
    near = close(wall(2.0))
    done = act(method, RAIL, Q, Wish(rates=RAIL.max_velocity), near, STILL, DT, DRIVING)
    assert (np.abs(done.rates) <= RAIL.max_acceleration * DT + 1e-12).all()


def test_what_is_not_allowed_is_said_in_a_sentence():
    near = close(wall(2.0))
    with pytest.raises(InputError, match="scaling, potential, constrained"):
        act("guess", RAIL, Q, tool(0, 0, 0), near, STILL, DT)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="exactly one"):
        Wish()
    with pytest.raises(InputError, match="p_l < p_u"):
        Thresholds(0.2, 0.8)
