"""Cant and stations of an alignment."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gauge_oracle import Course, alignment, document

from backend.gauge.landxml import parse
from backend.gauge.records import Model
from backend.gauge.stations import Equation, Stations

TRACK = Course(
    [
        ("line", 100.0, 0.0, 0.0),
        ("clothoid", 100.0, 0.0, -1 / 500),
        ("curve", 100.0, -1 / 500, -1 / 500),
        ("clothoid", 100.0, -1 / 500, 0.0),
    ]
)
LEVEL = '<Profile><ProfAlign name="p"><PVI>0 7</PVI><PVI>400 7</PVI></ProfAlign></Profile>'


def read(cant: str, attributes: str = 'gauge="1.524"', unit: str = "grads") -> Model:
    extra = f'<Cant name="c" {attributes}>{cant}</Cant>{LEVEL}'
    return parse(document(alignment(TRACK, unit, extra), unit), "f.xml")


def rows(*values: tuple[float, float], more: str = 'curvature="cw"') -> str:
    return "".join(f'<CantStation station="{s}" appliedCant="{v}" {more}/>' for s, v in values)


RAMP = ((100.0, 0.0), (200.0, 0.12), (300.0, 0.12), (400.0, 0.0))


def test_a_curve_to_the_right_raises_the_left_rail() -> None:
    model = read(rows(*RAMP))
    assert model.skipped == ()
    found = model.alignments[0]
    line = found.at(np.array([50.0, 150.0, 250.0, 350.0]))
    np.testing.assert_allclose(line.cant, [0.0, 0.06, 0.12, 0.06])
    assert line.curvature[2] == pytest.approx(-1 / 500)
    assert (found.gauge, found.gauge_stated) == (1.524, True)


def test_a_curve_to_the_left_is_negative_and_adverse_cant_turns_it_round() -> None:
    left = read(rows(*RAMP, more='curvature="ccw"')).alignments[0]
    assert left.at(np.array([250.0])).cant == pytest.approx([-0.12])
    adverse = read(rows(*RAMP, more='curvature="ccw" adverse="true"')).alignments[0]
    assert adverse.at(np.array([250.0])).cant == pytest.approx([0.12])


def test_without_a_side_it_is_that_of_the_plan() -> None:
    found = read(rows(*RAMP, more="")).alignments[0]
    np.testing.assert_allclose(found.at(np.array([150.0, 250.0])).cant, [0.06, 0.12])
    model = read(rows((50.0, 0.1), more=""))
    assert "to which side" in model.skipped[0].why


@pytest.mark.parametrize(
    ("rail", "rise"),
    [("insideRail", 0.06), ("outsideRail", -0.06), ("center", 0.0), ("leftRail", -0.06)],
)
def test_the_middle_rises_about_the_rail_that_stays(rail: str, rise: float) -> None:
    attributes = f'gauge="1.524" rotationPoint="{rail}"'
    line = read(rows(*RAMP), attributes).alignments[0].at(np.array([250.0]))
    assert line.lift == pytest.approx([rise])
    assert line.xyz[0, 2] == pytest.approx(7.0)
    # With adverse cant the inside rail, on the right here, is the higher one.
    adverse = read(rows(*RAMP, more='curvature="cw" adverse="true"'), attributes)
    assert adverse.alignments[0].at(np.array([250.0])).lift == pytest.approx([-rise])


def test_transition_types_shape_the_ramp() -> None:
    more = 'curvature="cw" transitionType="bloss"'
    found = read(rows(*RAMP, more=more)).alignments[0]
    u = np.array([0.1, 0.25, 0.5, 0.9])
    wanted = 0.12 * (3 * u**2 - 2 * u**3)
    np.testing.assert_allclose(found.at(100.0 + 100.0 * u).cant, wanted, atol=1e-12)


def test_millimetres_and_inches_are_told_from_metres_and_feet() -> None:
    model = read(rows((200.0, 70.0)), 'gauge="1435"')
    found = model.alignments[0]
    assert found.at(np.array([200.0])).cant == pytest.approx([0.07])
    assert found.gauge == pytest.approx(1.435)
    assert any("millimetres" in note for note in model.notes)
    feet = read(rows((200.0 / 0.3048, 4.0)), 'gauge="4.708333"', "feet")
    assert feet.alignments[0].at(np.array([200.0])).cant == pytest.approx([4 * 0.0254])
    assert feet.alignments[0].gauge == pytest.approx(1.4351, abs=1e-4)


def test_missing_cant_and_gauge_are_noted() -> None:
    plain = parse(document(alignment(TRACK, extra=LEVEL)), "f.xml").alignments[0]
    assert plain.at(np.array([250.0])).cant == pytest.approx([0.0])
    assert any("no cant" in note for note in plain.notes)
    assert (plain.gauge, plain.gauge_stated) == (1.435, False)
    empty = read("", "").alignments[0]
    assert any("no stations" in note for note in empty.notes)
    assert any("1.435 m is assumed" in note for note in empty.notes)


def test_unsound_stations_are_skipped_one_by_one() -> None:
    cant = rows((100.0, 0.0), (200.0, 0.1), (200.0, 0.2), (math.nan, 0.1), (300.0, math.nan))
    model = read(
        cant + '<CantStation station="x" appliedCant="1"/>', 'gauge="99" rotationPoint="?"'
    )
    why = " ".join(s.why for s in model.skipped)
    for words in ("repeat", "no station and applied cant", '"x" is not a number', "gauge is"):
        assert words in why
    assert "rotationPoint" in why
    assert model.alignments[0].at(np.array([150.0])).cant == pytest.approx([0.05])


def test_stations_behind_an_equation_count_anew() -> None:
    stations = Stations(
        1000.0, (Equation(1100.0, 1100.0, 5000.0), Equation(1300.0, 5200.0, 1050.0))
    )
    s = np.array([0.0, 99.0, 100.0, 250.0, 300.0, 350.0])
    wanted = [1000.0, 1099.0, 5000.0, 5150.0, 1050.0, 1100.0]
    np.testing.assert_allclose(stations.station(s), wanted)
    for distance, station in zip(s, wanted, strict=True):
        assert distance in stations.distances(station, 400.0)
    assert stations.distances(1060.0, 400.0) == (60.0, 310.0)
    assert stations.distances(3000.0, 400.0) == ()


def test_kilometre_posts_give_addresses_and_tolerate_nan() -> None:
    extra = (
        '<StaEquation staBack="NaN" staAhead="-50" staInternal="-50" desc=" 7 "/>'
        '<StaEquation staBack="250" staAhead="200" staInternal="200" desc="8"/>'
        '<StaEquation staBack="90" staAhead="300" staInternal="300" desc="9"/>'
        '<StaEquation staBack="1" staAhead="NaN" staInternal="nothing" desc="10"/>'
    )
    model = parse(document(alignment(TRACK, extra=extra)), "f.xml")
    stations = model.alignments[0].stations
    assert [e.name for e in stations.equations] == ["7", "8", "9"]
    assert stations.address(10.0) == ("7", 60.0)
    assert stations.address(299.0) == ("8", 99.0)
    np.testing.assert_allclose(stations.station(np.array([10.0, 299.0])), [10.0, 299.0])
    (conflict,) = model.conflicts
    assert (conflict.what, conflict.stated, conflict.used) == ("staBack", 90.0, 100.0)
    assert any("no internal station" in s.why for s in model.skipped)
    assert Stations(20.0).address(5.0) == ("", 25.0)
