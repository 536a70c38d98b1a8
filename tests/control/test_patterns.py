"""What the sticks mean, on machines whose joints turn either way."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from backend.control.patterns import (
    DEAD_ZONE,
    FINE,
    Method,
    Pattern,
    Setting,
    Sticks,
    deflection,
    neutral,
    velocities,
    with_method,
    with_pattern,
)
from backend.machine import kinematics
from backend.machine.load import load_machine

ISO, SAE = Setting(Pattern.ISO), Setting(Pattern.SAE)
MODELS = ("mini", "ex13")


def tip_motion(model: str, sticks: Sticks, setting: Setting) -> np.ndarray:
    """Velocity of the bucket tip in the root frame with the arm half stretched ahead [m/s]."""
    machine = load_machine(model)
    q = np.clip(np.array([0.0, 0.3, -1.2, -0.4]), machine.lower, machine.upper)
    q = q * np.array([1.0, *np.sign(machine.sun.signs)])
    v, _ = velocities(machine, sticks, setting)
    J = kinematics.jacobian(machine, q, None, machine.end_link, machine.end_point)
    return J @ v


@pytest.mark.parametrize("model", MODELS)
def test_iso(model: str) -> None:
    assert tip_motion(model, Sticks(left_x=-1), ISO)[1] > 0  # swings to the left
    assert tip_motion(model, Sticks(left_y=1), ISO)[0] > 0  # stick out
    assert tip_motion(model, Sticks(right_y=1), ISO)[2] < 0  # boom down
    assert tip_motion(model, Sticks(right_x=1), ISO)[2] > 0  # dumps: the tip rises


@pytest.mark.parametrize("model", MODELS)
def test_sae_swaps_boom_and_stick(model: str) -> None:
    machine = load_machine(model)
    for one, other in (
        (Sticks(left_y=0.7), Sticks(right_y=0.7)),
        (Sticks(right_y=-0.7), Sticks(left_y=-0.7)),
    ):
        for a, b in zip(
            velocities(machine, one, ISO), velocities(machine, other, SAE), strict=True
        ):
            np.testing.assert_array_equal(a, b)
    for same in (Sticks(left_x=0.5), Sticks(right_x=0.5)):
        np.testing.assert_array_equal(
            velocities(machine, same, ISO)[0], velocities(machine, same, SAE)[0]
        )


def test_full_deflection_is_full_speed_and_fine_is_a_share() -> None:
    machine = load_machine("mini")
    full = Sticks(-1.0, 1.0, 1.0, -1.0, 1.0, -1.0)
    joints, tracks = velocities(machine, full, ISO)
    np.testing.assert_allclose(np.abs(joints), machine.max_velocity)
    np.testing.assert_allclose(tracks, [machine.tracks.max_speed, -machine.tracks.max_speed])
    fine, slow = velocities(machine, full, replace(ISO, fine=True))
    np.testing.assert_allclose(fine, FINE * joints)
    np.testing.assert_allclose(slow, FINE * tracks)


def test_dead_zone_is_continuous_and_monotone() -> None:
    values = [deflection(v) for v in np.linspace(-1.5, 1.5, 601)]
    assert (np.diff(values) >= 0.0).all()
    assert max(np.diff(values)) < 0.01
    assert deflection(DEAD_ZONE) == 0.0
    assert deflection(2.0) == 1.0
    assert deflection(math.nan) == 0.0


def test_not_a_number_is_no_neutral() -> None:
    assert neutral(Sticks(left_x=DEAD_ZONE))
    assert not neutral(Sticks(left_x=DEAD_ZONE + 1e-6))
    assert not neutral(Sticks(track_left=math.nan))


def test_the_pattern_changes_in_neutral_only() -> None:
    assert with_pattern(ISO, Pattern.SAE, Sticks(left_y=0.5)) is ISO
    assert with_pattern(ISO, Pattern.SAE, Sticks()).pattern is Pattern.SAE


def test_the_method_changes_in_neutral_only() -> None:
    assert with_method(ISO, Method.CONSTRAINED, Sticks(track_left=0.5)) is ISO
    assert with_method(ISO, Method.CONSTRAINED, Sticks()).method is Method.CONSTRAINED
