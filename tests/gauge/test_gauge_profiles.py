"""Profiles: parabolas and circles against their own formulas."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from gauge_oracle import Course, alignment, document

from backend.gauge.alignment import Alignment
from backend.gauge.landxml import parse
from backend.gauge.profile import Pvi, build
from backend.gauge.records import Model

STRAIGHT = Course([("line", 1000.0, 0.0, 0.0)])


def read(points: str, unit: str = "grads", start: float = 0.0) -> Model:
    profile = f'<Profile><ProfAlign name="p">{points}</ProfAlign></Profile>'
    return parse(document(alignment(STRAIGHT, unit, profile, start), unit), "f.xml")


def heights(model: Model, s: Any) -> tuple[Any, Any]:
    found: Alignment = model.alignments[0]
    line = found.at(np.atleast_1d(np.array(s, dtype=float)))
    return line.xyz[:, 2], line.gradient


def test_a_symmetric_parabola() -> None:
    model = read('<PVI>0 10</PVI><ParaCurve length="200">400 30</ParaCurve><PVI>1000 0</PVI>')
    assert model.skipped == ()
    g1, g2 = 0.05, -0.05
    s = np.linspace(0.0, 1000.0, 201)
    x = np.clip(s - 300.0, 0.0, 200.0)
    wanted = 25.0 + g1 * np.minimum(s - 300.0, x) + (g2 - g1) * x**2 / 400.0
    wanted += np.where(s > 500.0, g2 * (s - 500.0), 0.0)
    z, gradient = heights(model, s)
    np.testing.assert_allclose(z, wanted, atol=1e-9)
    np.testing.assert_allclose(gradient, g1 + (g2 - g1) * x / 200.0, atol=1e-12)


def test_an_unsymmetric_parabola_meets_in_the_middle() -> None:
    points = (
        '<PVI>0 0</PVI><UnsymParaCurve lengthIn="60" lengthOut="140">400 -12</UnsymParaCurve>'
        "<PVI>1000 12</PVI>"
    )
    model = read(points)
    g1, g2 = -0.03, 0.04
    offset = 60 * 140 * (g2 - g1) / (2 * 200)  # of the curve above the point, by any textbook
    h = 1e-6
    (begin, before, at, after, end), gradient = heights(model, [340, 400 - h, 400, 400 + h, 540])
    assert begin == pytest.approx(-12 - g1 * 60)
    assert end == pytest.approx(-12 + g2 * 140)
    assert at == pytest.approx(-12 + offset)
    assert [before, after] == pytest.approx([at, at], abs=1e-6)
    middle = g1 + 2 * offset / 60
    assert gradient == pytest.approx([g1, middle, middle, middle, g2], abs=1e-7)


@pytest.mark.parametrize("after", [0.04, -0.05])
def test_a_circle_touches_both_grades_and_is_round(after: float) -> None:
    before, radius = 0.01, 3000.0
    turn = math.atan(after) - math.atan(before)
    length = radius * abs(turn)
    points = (
        f'<PVI>0 5</PVI><CircCurve length="{length:.6f}" radius="{math.copysign(radius, turn)}">'
        f"500 10</CircCurve><PVI>1000 {10 + 500 * after}</PVI>"
    )
    model = read(points)
    assert model.conflicts == ()
    tangent = radius * math.tan(abs(turn) / 2)
    begin = 500 - tangent * math.cos(math.atan(before))
    end = 500 + tangent * math.cos(math.atan(after))
    s = np.linspace(begin, end, 51)
    z, gradient = heights(model, s)
    assert z[0] == pytest.approx(10 - before * (500 - begin), abs=1e-8)
    assert z[-1] == pytest.approx(10 + after * (end - 500), abs=1e-8)
    assert [gradient[0], gradient[-1]] == pytest.approx([before, after], abs=1e-9)
    center = np.array([begin, z[0]]) + math.copysign(radius, turn) * np.array(
        [-math.sin(math.atan(before)), math.cos(math.atan(before))]
    )
    np.testing.assert_allclose(np.hypot(s - center[0], z - center[1]), radius, atol=1e-7)


def test_gradient_is_the_derivative() -> None:
    points = (
        '<PVI>0 5</PVI><CircCurve radius="2000">250 9</CircCurve>'
        '<ParaCurve length="150">600 4</ParaCurve><PVI>1000 12</PVI>'
    )
    model = read(points)
    s, h = np.linspace(1.5, 998.5, 500), 1e-4
    slope = (heights(model, s + h)[0] - heights(model, s - h)[0]) / (2 * h)
    np.testing.assert_allclose(slope, heights(model, s)[1], atol=1e-6)


def test_stations_count_from_the_alignments_own() -> None:
    model = read("<PVI>2000 1</PVI><PVI>3000 11</PVI>", start=2000.0)
    assert heights(model, [0, 500])[0] == pytest.approx([1, 6])


def test_feet_of_elevation() -> None:
    foot = 1200 / 3937
    model = read(f"<PVI>0 100</PVI><PVI>{1000 / foot} 200</PVI>", "survey feet")
    assert heights(model, [0, 1000])[0] == pytest.approx([100 * foot, 200 * foot])


def test_heights_end_with_the_profile() -> None:
    model = read("<PVI>100 1</PVI><PVI>600 11</PVI>")
    z, gradient = heights(model, [99.0, 99.95, 600.05, 601.0])
    assert np.isnan(z).tolist() == [True, False, False, True]
    assert np.isnan(gradient).tolist() == [True, False, False, True]
    assert any("covers 100.000 to 600.000" in note for note in model.alignments[0].notes)


def test_curves_that_do_not_fit_are_told_and_left_out() -> None:
    points = (
        '<PVI>0 0</PVI><ParaCurve length="900">100 5</ParaCurve>'
        '<CircCurve radius="90000" length="5000">500 5</CircCurve>'
        "<PVI>700 40</PVI><Wave>750 1</Wave><PVI>nonsense 3</PVI><PVI>NaN 3</PVI>"
        "<PVI>700 41</PVI><PVI>1e308 3</PVI><PVI>1000 10</PVI>"
    )
    model = read(points)
    why = " ".join(s.why for s in model.skipped)
    for words in ("parabola of 900 m does not fit", "circle (radius 90000 m", "kind Wave"):
        assert words in why
    assert "nonsense" in why
    assert "repeat the station" in why
    assert "beyond 1e+08 m" in why
    assert heights(model, [100, 500, 700])[0] == pytest.approx([5, 5, 40])


def test_where_the_radius_does_not_fit_the_length_counts() -> None:
    points = '<PVI>0 0</PVI><CircCurve radius="50000" length="100">100 0</CircCurve>'
    model = read(points + "<PVI>1000 9</PVI>")
    (conflict,) = model.conflicts
    assert conflict.what == "radius of the vertical curve"
    assert conflict.stated == 50000
    assert conflict.used == pytest.approx(100 / math.atan(0.01))
    assert heights(model, [0, 40, 160])[0] == pytest.approx([0, 0, 0.6], abs=1e-3)


def test_a_length_that_contradicts_the_radius_is_told() -> None:
    points = '<PVI>0 0</PVI><CircCurve radius="5000" length="80">500 0</CircCurve>'
    (conflict,) = read(points + "<PVI>1000 5</PVI>").conflicts
    assert (conflict.stated, conflict.used) == (80, pytest.approx(5000 * math.atan(0.01)))


def test_a_profile_needs_two_points() -> None:
    with pytest.raises(ValueError, match="fewer than two"):
        build("p", [Pvi(0.0, 1.0)], lambda *_: None, lambda *_: None)
    model = read("<PVI>0 1</PVI>")
    assert "fewer than two points" in model.skipped[0].why
    assert model.alignments[0].profile is None
