from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.fusion.align import (
    POINTS,
    blend,
    bracket,
    extrapolation_sigma,
    recent,
    slope,
    slope_sigma,
    turn,
)
from backend.fusion.plausible import Entry


def series(values: list[float], period: float = 0.05) -> tuple[Entry, ...]:
    return tuple(Entry(k * period, k * period, (v,), (), 0.01) for k, v in enumerate(values))


@given(start=st.floats(-10.0, 10.0), rate=st.floats(-3.0, 3.0))
@settings(max_examples=100, deadline=None)
def test_rate_across_the_wrap_is_exact(start: float, rate: float) -> None:
    stamps = [0.05 * k for k in range(10)]
    rows = [((start + rate * t + math.pi) % (2 * math.pi) - math.pi,) for t in stamps]
    (found,) = slope(stamps, rows, (True,))
    assert found == pytest.approx(rate, abs=1e-9)


@given(a=st.floats(-math.pi, math.pi), step=st.floats(-3.0, 3.0), f=st.floats(0.0, 1.0))
@settings(max_examples=100, deadline=None)
def test_angles_go_the_short_way(a: float, step: float, f: float) -> None:
    b = (a + step + math.pi) % (2 * math.pi) - math.pi
    (found,) = blend((a,), (b,), f, (True,))
    assert turn(found, a + f * step, True) == pytest.approx(0.0, abs=1e-9)


def test_bracket_inside_and_outside() -> None:
    entries = series([0.0, 1.0, 2.0])
    a, b, fraction, gap = bracket(entries, 0.0625)
    assert (a.value, b.value, gap) == ((1.0,), (2.0,), 0.0)
    assert fraction == pytest.approx(0.25)
    assert bracket(entries, 0.13)[3] == pytest.approx(0.03)
    assert bracket(entries, -0.02)[3] == pytest.approx(-0.02)


def test_recent_is_bounded_and_keeps_the_newest() -> None:
    entries = series([float(k) for k in range(200)], 0.005)
    rows = recent(entries, 0.5001, 0.1)
    assert len(rows) <= POINTS
    assert rows[-1].stamp == pytest.approx(0.5)
    assert rows[0].stamp >= 0.4 - 1e-9
    # Slow streams keep three samples, but nothing older than a second.
    assert len(recent(series([0.0, 1.0, 2.0, 3.0], 0.2), 0.6, 0.1)) == 3
    assert len(recent(series([0.0, 1.0, 2.0], 2.0), 4.0, 0.1)) == 1


def test_slope_sigma_by_hand() -> None:
    # Two samples 0.1 s apart: sigma * sqrt(2) / 0.1
    assert slope_sigma([0.0, 0.1], 0.01) == pytest.approx(0.01 * math.sqrt(2) / 0.1)
    assert slope_sigma([0.0], 0.01) == math.inf


def test_extrapolation_grows_faster_beyond_the_limit() -> None:
    inside = extrapolation_sigma(0.1, 0.5, 1.0, 0.1)
    beyond = extrapolation_sigma(0.3, 0.5, 1.0, 0.1)
    assert inside == pytest.approx(1.0 * 0.01 / 6)
    assert beyond == pytest.approx(1.0 * 0.09 / 6 + 0.5 * 0.2)
