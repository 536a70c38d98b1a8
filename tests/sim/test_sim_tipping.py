"""A simulated machine tips when it must, falls back when it may, lies on what meets the ground."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, standstill, step
from backend.shell.sim.tipping import UPRIGHT, Lean, leaned, stance_of, tip
from backend.spatial import transform
from backend.stability.zmp import edge_moments

MACHINE = load_machine("ex13")
DT = 0.005
OUT = np.array([math.pi / 2, 0.5, -0.9, -0.4])  # over the left track, far out


def standing(q=OUT, pitch=0.0, roll=0.0):
    return SimState(
        np.array(q), np.zeros(4), np.array([5.0, 3.0, 1.0]), 0.4, pitch, roll, np.zeros(2)
    )


def run(stance, state, seconds, demand=None):
    """(state as if standing, lean) of every step."""
    demand = demand or (lambda _: standstill(MACHINE))
    lean, found = UPRIGHT, []
    for k in range(round(seconds / DT)):
        after = step(state, demand(k * DT), limits_of(MACHINE), Hydraulics(), DT)
        lean = tip(lean, state, after, stance, DT)
        state = after
        found.append((state, lean))
    return found


def heaviest(q, edge=1):
    """The payload at which a resting machine is about to tip over an edge [kg]."""

    def least(payload):
        stance = stance_of(MACHINE, payload)
        return edge_moments(stance.model, stance.support, q, 0 * q, 0 * q)[edge]

    low, high = 0.0, 2e4
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if least(middle) > 0.0 else (low, middle)
    return low


def test_at_rest_it_tips_just_when_two_corners_bear_nothing():
    limit = heaviest(OUT)
    assert 500.0 < limit < 1e4
    assert run(stance_of(MACHINE, 0.999 * limit), standing(), 3.0)[-1][1] == UPRIGHT
    tipped = run(stance_of(MACHINE, 1.01 * limit), standing(), 3.0)
    assert tipped[-1][1].edge == 1
    assert tipped[-1][1].angle > math.radians(3.0)


def test_it_turns_about_its_edge_and_stops_when_something_reaches_the_ground():
    stance = stance_of(MACHINE, 1.3 * heaviest(OUT))
    found = run(stance, standing(roll=0.02), 6.0)
    state, lean = found[-1]
    assert lean.rate == 0.0
    at = leaned(state, lean, stance)
    corners = stance.support.vertices[[1, 2]]
    edge = np.column_stack([corners, np.zeros(2)])
    np.testing.assert_allclose(
        transform.apply(at.T_site_root, edge), transform.apply(state.T_site_root, edge), atol=1e-9
    )
    poses = link_poses(MACHINE, at.q, at.T_site_root)
    low = transform.apply(
        transform.inverse(state.T_site_root), body_boxes(MACHINE, poses).corners().reshape(-1, 3)
    )
    assert low[:, 2].min() == pytest.approx(0.0, abs=0.1)
    angles = [one.angle for _, one in found]
    assert all(b >= a for a, b in pairwise(angles))
    assert at.roll < state.roll - math.radians(3.0)  # to the left: its left goes down


def test_a_start_too_hard_lifts_the_tracks_and_they_come_down_again():
    stance = stance_of(MACHINE, 0.95 * heaviest(OUT))

    def raising(t):
        rate = MACHINE.max_velocity[1] if t < 0.2 else 0.0
        return Demand(np.array([0.0, rate, 0.0, 0.0]), np.zeros(2))

    found = run(stance, standing(), 2.0, raising)
    assert max(one.angle for _, one in found) > 0.01
    assert found[-1][1] == UPRIGHT


def test_nothing_is_known_without_masses():
    assert stance_of(replace(MACHINE, masses_trusted=False), 0.0) is None
    state, stance = standing(), stance_of(MACHINE, 0.0)
    assert leaned(state, UPRIGHT, stance) is state
    assert leaned(state, Lean(1, 0.1), stance).roll < -0.05
