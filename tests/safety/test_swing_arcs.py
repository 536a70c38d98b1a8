"""Swinging bodies against people: the times agree with turning the boxes in small steps."""

from __future__ import annotations

import numpy as np
import pytest

from backend.safety.swing_arcs import Objects, judge_swing
from backend.safety.swing_risk import Boundaries, Risk, Swing
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import rz

DT = 0.002
LONGEST = 8.0


def box(rng: np.random.Generator) -> Boxes:
    """An upright box that is carried around the axis."""
    center = np.array([[rng.uniform(0.5, 5.0), rng.uniform(-0.5, 0.5), rng.uniform(0.3, 2.0)]])
    half = np.array([[rng.uniform(0.1, 1.5), rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.5)]])
    return Boxes(center, rz(np.array([rng.uniform(-0.4, 0.4)])), half)


def gap(b: Boxes, turned: float, place: np.ndarray) -> float:
    """Distance from a point on the ground to the footprint of a box that turned about the axis."""
    c, s = np.cos(-turned), np.sin(-turned)
    local = np.array([c * place[0] - s * place[1], s * place[0] + c * place[1]])
    off = b.rotations[0, :2, :2].T @ (local - b.centers[0, :2])
    return float(np.linalg.norm(np.maximum(np.abs(off) - b.half_extents[0, :2], 0.0)))


def met(b: Boxes, swing: Swing, place: np.ndarray, velocity: np.ndarray, radius: float) -> float:
    """When the box first comes within `radius` of an object that keeps its turn about the axis."""
    rate, angle, t = swing.rate, 0.0, 0.0
    far = np.linalg.norm(place)
    turning = (place[0] * velocity[1] - place[1] * velocity[0]) / far**2
    start = np.arctan2(place[1], place[0])
    while t < LONGEST:
        at = start + turning * t
        if gap(b, angle, far * np.array([np.cos(at), np.sin(at)])) <= radius:
            return t
        after = float(np.clip(rate + swing.acceleration * DT, -swing.fastest, swing.fastest))
        angle += 0.5 * (rate + after) * DT
        rate, t = after, t + DT
    return np.inf


def one(place: np.ndarray, velocity: np.ndarray, radius: float) -> Objects:
    ends = np.array([0.0]), np.array([1.8])
    return Objects(place[None], velocity[None], np.array([radius]), *ends, np.zeros(1))


def judged(b: Boxes, swing: Swing, objects: Objects, horizon: float = 1.0):  # type: ignore[no-untyped-def]
    return judge_swing(b.corners(), swing, objects, objects, horizon, Boundaries(), 0.0)


@pytest.mark.parametrize("seed", range(60))
def test_times_are_never_later_than_turning_in_steps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    b, radius = box(rng), rng.uniform(0.2, 0.5)
    at = rng.uniform(-np.pi, np.pi)
    place = rng.uniform(1.0, 6.0) * np.array([np.cos(at), np.sin(at)])
    velocity = rng.uniform(-1.0, 1.0, 2) if seed % 2 else np.zeros(2)
    swing = Swing(0.0, rng.uniform(-0.8, 0.8), rng.choice([0.0, 0.5, -0.5]), 1.0, 0.6)
    true = met(b, swing, place, velocity, radius)
    found = float(judged(b, swing, one(place, velocity, radius)).ttc[0])
    assert found <= true + 2 * DT
    # Early by what the samples on the edges leave between them.
    if np.isfinite(true):
        spaced = 0.5 * 2.0 * b.half_extents.max() / 6.0
        assert found >= met(b, swing, place, velocity, radius + spaced + 0.01) - 2 * DT


def test_a_second_ahead_is_judged_where_the_swing_will_be() -> None:
    b = Boxes(np.array([[3.0, 0.0, 1.0]]), np.eye(3)[None], np.array([[0.5, 0.2, 0.5]]))
    swing = Swing(0.0, 0.5, 0.0, 1.0, 0.5)
    there = one(3.0 * np.array([np.cos(0.5), np.sin(0.5)]), np.zeros(2), 0.3)
    risks = judged(b, swing, there)
    assert risks.ttc_ahead[0] == 0.0
    assert risks.ttc[0] > 0.0
    assert risks.level[0] == Risk.EMERGENCY
    assert risks.side[0] == 1


def test_below_a_raised_boom_nobody_is_met() -> None:
    b = Boxes(np.array([[3.0, 0.0, 4.0]]), np.eye(3)[None], np.array([[0.5, 0.2, 0.5]]))
    risks = judged(b, Swing(0.0, 0.5, 0.0, 1.0, 0.5), one(np.array([2.9, 0.8]), np.zeros(2), 0.3))
    assert risks.level[0] == Risk.SAFE
    assert np.isinf(risks.ttc[0])


def test_out_of_the_ring_nobody_is_met() -> None:
    b = Boxes(np.array([[3.0, 0.0, 1.0]]), np.eye(3)[None], np.array([[0.5, 0.2, 0.5]]))
    risks = judged(b, Swing(0.0, 0.5, 0.0, 1.0, 0.5), one(np.array([0.0, 6.0]), np.zeros(2), 0.3))
    assert risks.level[0] == Risk.SAFE


def test_the_nearer_side_is_the_dangerous_one_at_rest() -> None:
    b = Boxes(np.array([[3.0, 0.0, 1.0]]), np.eye(3)[None], np.array([[0.5, 0.2, 0.5]]))
    still = Swing(0.0, 0.0, 0.0, 1.0, 0.5)
    for sign, side in ((1.0, 1), (-1.0, 0)):
        place = 3.0 * np.array([np.cos(0.3), sign * np.sin(0.3)])
        assert judged(b, still, one(place, np.zeros(2), 0.3)).side[0] == side


def test_what_is_not_a_number_is_an_emergency() -> None:
    b = Boxes(np.array([[3.0, 0.0, 1.0]]), np.eye(3)[None], np.array([[0.5, 0.2, 0.5]]))
    swing = Swing(0.0, float("nan"), 0.0, 1.0, 0.5)
    risks = judged(b, swing, one(np.array([0.0, 3.0]), np.zeros(2), 0.3))
    assert risks.level[0] == Risk.EMERGENCY


def test_without_swinging_bodies_or_people_nothing_is_judged() -> None:
    b = Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    swing = Swing(0.0, 0.1, 0.0, 1.0, 0.5)
    assert judged(b, swing, one(np.array([1.0, 0.0]), np.zeros(2), 0.3)).level[0] == Risk.SAFE
    empty = Objects(np.zeros((0, 2)), np.zeros((0, 2)), *(np.zeros(0),) * 4)
    boxes = Boxes(np.array([[3.0, 0.0, 1.0]]), np.eye(3)[None], np.array([[0.5, 0.2, 0.5]]))
    assert len(judged(boxes, swing, empty).level) == 0


@pytest.mark.parametrize("number", [np.nan, np.inf, 1e300])
def test_what_is_no_place_is_an_emergency(number: float) -> None:
    b = box(np.random.default_rng(0))
    swing = Swing(0.0, 0.0, 0.0, 1.0, 1.0)
    far_away = one(np.array([100.0, 0.0]), np.zeros(2), 0.3)
    assert judged(b, swing, far_away).level[0] == Risk.SAFE
    strange = far_away._replace(place=np.array([[number, 0.0]]))
    assert judged(b, swing, strange).level[0] == Risk.EMERGENCY
    strange = far_away._replace(sigma=np.array([number]))
    assert judged(b, swing, strange).level[0] == Risk.EMERGENCY
