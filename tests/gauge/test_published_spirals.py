"""Spirals whose end others have published: the laws are those that railways and programs use."""

from __future__ import annotations

import math

import numpy as np
import pytest

from backend.gauge.spirals import DirectSpiral, IntegratedSpiral
from backend.gauge.transitions import DIRECT, INTEGRATED


def end(law: str, length: float, radius: float) -> tuple[float, float, float]:
    """x, y and heading of the end of a direct spiral from a straight to a radius."""
    bend, over_tangent = DIRECT[law]
    xy, heading, _ = DirectSpiral(bend, length, 1 / radius, False, over_tangent).local(
        np.array([length])
    )
    return float(xy[0, 0]), float(xy[0, 1]), float(heading[0])


@pytest.mark.parametrize(
    ("length", "radius", "directions"),
    [
        (168.0, 981.0, (300.029098, 305.459945)),
        (157.0, 1002.0, (305.459945, 300.488045)),
        (170.0, 1002.0, (292.469064, 287.088369)),
    ],
)
def test_biquadratic_parabolas_of_a_finnish_line(
    length: float, radius: float, directions: tuple[float, float]
) -> None:
    """Directions [gon] to 1e-6 as a track alignment of the Finnish Transport Infrastructure Agency
    states them."""
    turn = abs(directions[1] - directions[0]) * math.pi / 200
    assert end("biquadraticParabola", length, radius)[2] == pytest.approx(turn, abs=2e-8)


def test_a_sine_half_wave_of_civil_3d() -> None:
    """theta, totalX, totalY and the short tangent as Autodesk Civil 3D states them, whose X = L -
    0.0226689 L³ / R² ends the series that the arc length gives after its first term."""
    x, y, heading = end("sineHalfWave", 70.0, 500.0)
    assert math.degrees(heading) == pytest.approx(4.002400, abs=1e-5)
    assert (x, y) == (pytest.approx(69.968898, abs=1e-4), pytest.approx(1.455758, abs=1e-5))
    _, y, heading = end("sineHalfWave", 50.0, 250.0)
    assert y / math.sin(heading) == pytest.approx(14.928353346451, abs=1e-4)


def test_laws_of_curvature_turn_by_half() -> None:
    """Each turns by L / 2R, and begins and ends as the literature has it."""
    for name, law in INTEGRATED.items():
        _, heading, curvature = IntegratedSpiral(law, 80.0, 0.0, 1 / 300).local(
            np.array([0.0, 40.0, 80.0])
        )
        assert heading[2] == pytest.approx(80 / 600), name
        np.testing.assert_allclose(curvature, [0.0, 1 / 600, 1 / 300], atol=1e-15)


@pytest.mark.parametrize(("k0", "k1"), [(0.0, 4.0), (1.0, -1.0)])
def test_spirals_that_turn_too_far_are_refused(k0: float, k1: float) -> None:
    with pytest.raises(ValueError, match="two circles"):
        IntegratedSpiral(INTEGRATED["clothoid"], 80.0, k0, k1)
    with pytest.raises(ValueError, match="45 degrees"):
        DirectSpiral(*DIRECT["cubic"][:1], 80.0, k1, False, False)
