"""Jayasekara and Arisumi 2015, Eqs. (1)-(11): boundary conditions of every trajectory."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from surmounting import HOLDING, STEPS, climbing

from backend.surmount.judge import course_of
from backend.surmount.laws import rise, smooth_step
from backend.surmount.outline import lean, leans, on_both, rear_wheel
from backend.surmount.records import SEQUENCES, Spline

PAPER = Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
"""Eq. (3) of u = t / t_f."""
ENDS = np.array([0.0, 1.0])


def test_the_law_is_the_papers_polynomial() -> None:
    u = np.linspace(0.0, 1.0, 1001)
    law = smooth_step(u)
    for k, values in enumerate(law):
        assert values == pytest.approx(PAPER.deriv(k)(u) if k else PAPER(u), abs=1e-12)


def test_boundary_conditions_of_the_law() -> None:
    law = smooth_step(ENDS)
    assert np.abs(law.value - ENDS).max() <= 1e-12
    for values in law[1:]:
        assert np.abs(values).max() <= 1e-12


@pytest.mark.parametrize("spline", [None, Spline(0.4, 0.9)])
def test_boundary_conditions_of_the_rise(spline: Spline | None) -> None:
    assert np.abs(rise(ENDS, spline) - ENDS).max() <= 1e-12
    if spline is None:
        cubic = Polynomial([0.0, 0.0, 3.0, -2.0])
        s = np.linspace(0.0, 1.0, 101)
        assert rise(s) == pytest.approx(cubic(s), abs=1e-12)
        assert np.abs(cubic.deriv()(ENDS)).max() <= 1e-12
    else:
        tiny = 1e-6
        assert float(rise(np.array([tiny]), spline)[0]) < 1e-9
        assert 1.0 - float(rise(np.array([1.0 - tiny]), spline)[0]) < 1e-9
    # The spline with the cubic's own values is the cubic.
    s = np.linspace(0.0, 1.0, 101)
    assert rise(s, Spline()) == pytest.approx(rise(s), abs=1e-12)


@pytest.mark.parametrize("name", list(STEPS))
def test_boundary_conditions_of_the_sequences(name: str) -> None:
    climber, step = climbing(name)
    p = HOLDING[name]
    x_f, z_f, e = on_both(p.alpha_f, step.height, climber.a, climber.r)
    one, two, three = (course_of(s, climber, step, p, ENDS) for s in SEQUENCES)
    size = max(1.0, climber.a)
    # Where each begins and ends: (1), (2), (5), (6), and (8)-(11) with their offsets.
    assert np.abs(one.x - [-p.p1, x_f]).max() <= 1e-12 * size
    assert np.abs(one.z - [0.0, z_f]).max() <= 1e-12 * size
    assert np.abs(one.alpha - [0.0, p.alpha_f]).max() <= 1e-9
    assert np.abs(two.x - [x_f, -e]).max() <= 1e-12 * size
    assert np.abs(two.z - [z_f, step.height]).max() <= 1e-12 * size
    assert np.abs(two.alpha - [p.alpha_f, 0.0]).max() <= 1e-9
    assert np.abs(three.x - [-e, p.p4]).max() <= 1e-12 * size
    assert np.abs(three.z - step.height).max() <= 1e-12 * size
    assert np.abs(two.belt).max() == 0.0
    assert three.belt[-1] == pytest.approx(p.p4 + e, abs=1e-12)


@pytest.mark.parametrize("name", list(STEPS))
def test_the_crawler_keeps_to_ground_and_edge(name: str) -> None:
    climber, step = climbing(name)
    p, u = HOLDING[name], np.linspace(0.0, 1.0, 201)
    a, r, h = climber.a, climber.r, step.height
    one, two, _ = (course_of(s, climber, step, p, u) for s in SEQUENCES)
    # Sequence 1: the rear wheel's centre stays at its radius over the ground.
    centre = one.z - a * np.sin(one.alpha) + r * np.cos(one.alpha)
    assert np.abs(centre - r).max() < 1e-12
    # Sequence 2-1: the underside goes through the edge, at the same place of the belt (9).
    along = -two.x * np.cos(two.alpha) + (h - two.z) * np.sin(two.alpha)
    beside = two.x * np.sin(two.alpha) + (h - two.z) * np.cos(two.alpha)
    assert np.abs(beside).max() < 1e-9
    assert np.ptp(along) < 1e-9


@pytest.mark.parametrize("name", list(STEPS))
def test_the_wheels_roll_without_slipping(name: str) -> None:
    """(16), (17) with their time derivatives put right: the point of the belt on the ground is at
    rest."""
    climber, step = climbing(name)
    u = np.linspace(0.0, 1.0, 4001)
    one = course_of(SEQUENCES[0], climber, step, HOLDING[name], u)
    a, r = climber.a, climber.r
    wheel = np.gradient(rear_wheel(one.x, one.alpha, a, r), u)
    turning = np.gradient(one.alpha, u)
    belt = np.gradient(one.belt, u)
    assert np.abs(wheel + r * turning - belt).max() < 1e-9
    # (16) as it should read.
    printed = np.gradient(one.x, u) - np.gradient(a * np.cos(one.alpha) + r * np.sin(one.alpha), u)
    assert np.abs(wheel - printed).max() < 1e-9


def test_the_least_lean_of_the_shovel_is_the_papers() -> None:
    """16.75 degrees, where the paper's searches begin and end, is where the edge meets the foremost
    point of the underside; the base that is assumed was chosen so."""
    climber, step = climbing("shovel")
    low, high = leans(step.height, climber.a, climber.r)
    assert np.degrees(low) == pytest.approx(16.75, abs=0.01)
    assert on_both(low, step.height, climber.a, climber.r)[2] == pytest.approx(climber.a, abs=1e-9)
    assert on_both(high, step.height, climber.a, climber.r)[2] == pytest.approx(0.0, abs=1e-9)
    assert float(lean(np.array([0.0]), climber.a, climber.r)[0]) == pytest.approx(0.0, abs=1e-12)
