"""Time to collision against an integration step by step; warning index; levels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from swings import DT, END, cases, grazes, integrated

from backend.safety.swing_risk import (
    Boundaries,
    Risk,
    Swing,
    risk,
    time_to_collision,
    warning_index,
)


def test_against_integration() -> None:
    for swing, place, velocity, clearance in cases(1_000, 1):
        found = time_to_collision(swing, place[None], velocity[None], np.array([clearance]))[0]
        true = integrated(swing, place, velocity, clearance)
        if np.isinf(true):
            # Nothing within the time that was integrated; grazing may be a step off.
            assert found > END - 2 * DT or grazes(swing, place, velocity, clearance)
        else:
            assert found == pytest.approx(true, abs=5 * DT) or grazes(
                swing, place, velocity, clearance
            )
            assert found <= true + DT  # never later than it happens


def test_by_hand() -> None:
    swing = Swing(0.0, 0.5, 0.0, 1.0, 1.0)
    place = np.array([[0.0, 4.0], [4.0, 0.0], [0.0, -4.0]])
    found = time_to_collision(swing, place, np.zeros((3, 2)), np.full(3, 0.4))
    np.testing.assert_allclose(found, [(np.pi / 2 - 0.1) / 0.5, 0.0, (1.5 * np.pi - 0.1) / 0.5])
    # From rest at 1 rad/s^2 up to 1 rad/s: half a radian is done after 1 s.
    faster = Swing(0.0, 0.0, 1.0, 1.0, 1.0)
    found = time_to_collision(faster, place[:1], np.zeros((1, 2)), np.full(1, 0.4))
    np.testing.assert_allclose(found, 1.0 + (np.pi / 2 - 0.1 - 0.5))
    still = time_to_collision(
        Swing(0.0, 0.0, 0.0, 1.0, 1.0), place[:1], np.zeros((1, 2)), np.ones(1)
    )
    assert np.isinf(still[0])


def test_somebody_who_walks_into_a_standing_arm() -> None:
    still = Swing(0.0, 0.0, 0.0, 1.0, 1.0)
    place, velocity = np.array([[0.0, 4.0]]), np.array([[1.0, 0.0]])
    found = time_to_collision(still, place, velocity, np.array([0.4]))
    np.testing.assert_allclose(found, (np.pi / 2 - 0.1) / 0.25)


def test_warning_index_by_hand() -> None:
    swing = Swing(0.0, 0.5, 0.0, 1.0, 1.0)
    place, radius, clearance = np.array([[0.0, 4.0]]), np.array([0.3]), np.array([0.5])
    c = 4.0 * np.pi / 2 - 0.5
    safety = 4.0 * np.arcsin((0.3 + 0.2 + 0.5) / 4.0)
    found = warning_index(swing, place, radius, clearance, 0.2, 0.5)
    np.testing.assert_allclose(found, (c - safety) / (4.0 * 0.25 / 2.0))
    still = Swing(0.0, 0.0, 0.0, 1.0, 1.0)
    assert warning_index(still, place, radius, clearance, 0.2, 0.5)[0] == np.inf
    near = np.array([[0.9, 0.0]])  # the safety clearance has no end there
    assert warning_index(swing, near, radius, clearance, 0.2, 0.5)[0] == -np.inf


def test_levels_and_their_boundaries() -> None:
    ttc = np.array([9.0, 9.0, 9.0, 1.0, 3.0, 0.5, np.inf, np.nan, 9.0])
    x = np.array([9.0, 2.0, 1.0, 9.0, 9.0, 9.0, np.inf, 9.0, np.nan])
    E, W, S = Risk.EMERGENCY, Risk.WARNING, Risk.SAFE
    assert list(risk(ttc, x)) == [S, W, E, E, W, E, S, E, E]
    assert list(risk(ttc[:1], x[:1], Boundaries(index=(10.0, 20.0)))) == [E]


def test_what_is_not_known_is_an_emergency() -> None:
    swing = Swing(0.0, 0.5, 0.0, 1.0, 1.0)
    bad = np.array([[np.nan, 1.0]])
    assert time_to_collision(swing, bad, np.zeros((1, 2)), np.ones(1))[0] == 0.0
    assert warning_index(swing, bad, np.ones(1), np.ones(1), 0.1, 0.1)[0] == -np.inf


@pytest.mark.parametrize("field", ["angle", "rate", "acceleration", "fastest", "deceleration"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_swing_that_is_not_known_is_an_emergency(field: str, bad: float) -> None:
    swing = replace(Swing(0.0, 0.5, 0.1, 1.0, 1.0), **{field: bad})
    place, still, one = np.array([[0.0, 9.0]]), np.zeros((1, 2)), np.ones(1)
    with np.errstate(all="raise"):
        ttc = time_to_collision(swing, place, still, one)
        index = warning_index(swing, place, one, one, 0.1, 0.1)
    assert (ttc[0], index[0]) == (0.0, -np.inf)
    assert risk(ttc, index)[0] == Risk.EMERGENCY


def test_a_clearance_that_is_not_known_is_an_emergency() -> None:
    swing, place = Swing(0.0, 0.5, 0.1, 1.0, 1.0), np.array([[0.0, 9.0]])
    assert time_to_collision(swing, place, np.zeros((1, 2)), np.array([np.nan]))[0] == 0.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("what", ["place", "velocity", "clearance", "radius", "uncertainty"])
def test_an_object_that_is_not_known_is_an_emergency_and_no_other(what: str, bad: float) -> None:
    swing = Swing(0.0, 0.5, 0.1, 1.0, 1.0)
    given = {
        "place": np.array([[0.0, 9.0], [0.0, -9.0]]),
        "velocity": np.zeros((2, 2)),
        "clearance": np.ones(2),
        "radius": np.ones(2),
    }
    uncertainty = bad if what == "uncertainty" else 0.1
    if what in given:
        given[what][0] = bad
    place, velocity, clearance, radius = given.values()
    with np.errstate(all="raise"):
        ttc = time_to_collision(swing, place, velocity, clearance)
        index = warning_index(swing, place, radius, clearance, uncertainty, 0.1)
        levels = risk(ttc, index)
    assert levels[0] == Risk.EMERGENCY
    assert levels[1] == (Risk.EMERGENCY if what == "uncertainty" else Risk.SAFE)


def test_a_swing_that_cannot_stop() -> None:
    place, one = np.array([[0.0, 9.0]]), np.ones(1)
    for rate, left in ((0.5, 0.0), (0.0, np.inf)):
        with np.errstate(all="raise"):
            index = warning_index(Swing(0.0, rate, 0.0, 1.0, 0.0), place, one, one, 0.1, 0.1)
        assert index[0] == left
