"""Alignments come back from a file as they were laid out, in any units and with any spiral."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from gauge_oracle import CURVATURE, INFRAMODEL, LANDXML, OFFSET, UNITS, Course, alignment, document
from scipy.special import fresnel

from backend.gauge.alignment import Alignment
from backend.gauge.elements import Spiral
from backend.gauge.landxml import parse
from backend.gauge.records import Model

R, L = 300.0, 80.0


def course(spiral: str) -> Course:
    """A straight, a curve to the left and one to the right, each between two spirals."""
    return Course(
        [
            ("line", 120.0, 0.0, 0.0),
            (spiral, L, 0.0, 1 / R),
            ("curve", 95.0, 1 / R, 1 / R),
            (spiral, 60.0, 1 / R, 0.0),
            ("line", 40.0, 0.0, 0.0),
            (spiral, 70.0, 0.0, -1 / 450),
            ("curve", 150.0, -1 / 450, -1 / 450),
            (spiral, L, -1 / 450, 0.0),
            ("line", 25.0, 0.0, 0.0),
        ]
    )


def only(model: Model) -> Alignment:
    assert model.skipped == ()
    assert len(model.alignments) == 1
    return model.alignments[0]


def agrees(found: Alignment, wanted: Course) -> None:
    """Joints within 0.1 mm and 1e-6 rad, from either side; lengths within 0.01 mm."""
    assert len(found.elements) == len(wanted.pieces)
    np.testing.assert_allclose(found.starts, wanted.joints[:-1], atol=1e-5)
    assert found.length == pytest.approx(wanted.joints[-1], abs=1e-5)
    for i, element in enumerate(found.elements):
        xy, heading, curvature = element.at(np.array([0.0, element.length]))
        poses = np.array(wanted.poses[i : i + 2])
        np.testing.assert_allclose(xy, poses[:, :2], atol=1e-4)
        turn = np.angle(np.exp(1j * (heading - poses[:, 2])))
        np.testing.assert_allclose(turn, 0.0, atol=1e-6)
        kind, _, k0, k1 = wanted.pieces[i]
        loose = 4e-2 / R if kind in OFFSET else 1e-8  # a parabola's y'' is not its curvature
        np.testing.assert_allclose(curvature, [k0, k1], atol=loose)


@pytest.mark.parametrize("spiral", [*CURVATURE, *OFFSET])
def test_every_spiral(spiral: str) -> None:
    wanted = course(spiral)
    model = parse(document(alignment(wanted)), "f.xml")
    agrees(only(model), wanted)
    assert model.conflicts == ()


@pytest.mark.parametrize("space", [LANDXML, INFRAMODEL, LANDXML.replace("1.2", "1.1")])
@pytest.mark.parametrize("unit", list(UNITS))
def test_every_unit_and_namespace(unit: str, space: str) -> None:
    wanted = course("clothoid")
    model = parse(document(alignment(wanted, unit, start=1000.0), unit, space), "f.xml")
    found = only(model)
    agrees(found, wanted)
    assert found.stations.start == pytest.approx(1000.0, abs=1e-6)
    assert model.conflicts == ()
    assert model.format == ("Inframodel 1.2" if space == INFRAMODEL else "LandXML 1.2")


def test_a_clothoid_is_fresnel_s() -> None:
    wanted = Course([("clothoid", L, 0.0, 1 / R)], (0.0, 0.0, 0.0))
    found = only(parse(document(alignment(wanted)), "f.xml"))
    t = np.linspace(0.0, L, 33)
    a = math.sqrt(math.pi * R * L)
    sine, cosine = fresnel(t / a)
    line = found.at(t)
    np.testing.assert_allclose(line.xyz[:, 0], a * cosine, atol=1e-6)
    np.testing.assert_allclose(line.xyz[:, 1], a * sine, atol=1e-6)
    np.testing.assert_allclose(line.heading, t**2 / (2 * R * L), atol=1e-8)
    np.testing.assert_allclose(line.curvature, t / (R * L), atol=1e-12)


@pytest.mark.parametrize("spiral", list(CURVATURE))
def test_compound_spirals_between_two_curves(spiral: str) -> None:
    wanted = Course([("curve", 50.0, 1 / 500, 1 / 500), (spiral, L, 1 / 500, 1 / 200)])
    agrees(only(parse(document(alignment(wanted)), "f.xml")), wanted)


@pytest.mark.parametrize("spiral", [*CURVATURE, *OFFSET])
@pytest.mark.parametrize("ends", [(0.0, 1 / R), (-1 / R, 0.0)])
def test_heading_and_curvature_are_the_derivatives(spiral: str, ends: tuple[float, float]) -> None:
    wanted = Course([(spiral, L, *ends)], (0.0, 0.0, 0.3))
    found = only(parse(document(alignment(wanted)), "f.xml"))
    s = np.linspace(1.0, L - 1.0, 79)
    h = 1e-3
    before, here, after = found.at(s - h), found.at(s), found.at(s + h)
    step = (after.xyz - before.xyz)[:, :2] / (2 * h)
    np.testing.assert_allclose(np.linalg.norm(step, axis=1), 1.0, atol=1e-8)
    way = np.stack([np.cos(here.heading), np.sin(here.heading)], axis=1)
    np.testing.assert_allclose(step, way, atol=1e-7)
    bend = (after.heading - before.heading) / (2 * h)
    np.testing.assert_allclose(bend, here.curvature, atol=1e-8)


def test_more_than_half_a_circle_and_half_a_circle() -> None:
    for turn in (0.02, math.pi / 2, math.pi - 1e-9, math.pi, math.pi + 1e-3, 1.6 * math.pi):
        for side in (1.0, -1.0):
            wanted = Course([("curve", 50.0 * turn, side / 50, side / 50)])
            agrees(only(parse(document(alignment(wanted)), "f.xml")), wanted)


def test_a_curve_without_its_centre_is_the_smaller_arc() -> None:
    wanted = Course([("curve", 100.0, -1 / 80, -1 / 80)])
    data = document(alignment(wanted)).decode()
    begin, end = data.index("<Center>"), data.index("</Center>") + len("</Center>")
    agrees(only(parse((data[:begin] + data[end:]).encode(), "f.xml")), wanted)


def test_radii_are_the_files_own() -> None:
    found = only(parse(document(alignment(course("bloss"))), "f.xml"))
    spirals = [e for e in found.elements if isinstance(e, Spiral)]
    assert [s.radii for s in spirals[:2]] == [(math.inf, R), (R, math.inf)]
    assert {s.law for s in spirals} == {"bloss"}


@pytest.mark.parametrize("law", ["weinerBogen", "radioid", "revBloss", "banana", ""])
def test_what_is_not_defined_is_skipped_and_leaves_a_hole(law: str) -> None:
    wanted = course("clothoid")
    text = document(alignment(wanted)).decode().replace('"clothoid"', f'"{law}"', 1)
    model = parse(text.encode(), "f.xml")
    (skipped,) = model.skipped
    assert 'Alignment "A", line 5 / Spiral, line 5' in skipped.where
    assert law in skipped.why
    found = model.alignments[0]
    assert len(found.elements) == len(wanted.pieces) - 1
    assert found.length == pytest.approx(wanted.joints[-1], abs=1e-5)
    inside = found.at(np.array([110.0, 160.0, 230.0]))
    assert np.isfinite(inside.xyz[:, 0]).tolist() == [True, False, True]
    assert np.isfinite(inside.heading).tolist() == [True, False, True]


def test_a_parabola_between_two_curves_is_not_defined() -> None:
    wanted = Course([("clothoid", L, 1 / 500, 1 / 200), ("line", 10.0, 0.0, 0.0)])
    text = document(alignment(wanted)).decode().replace('"clothoid"', '"cubicParabola"')
    (skipped,) = parse(text.encode(), "f.xml").skipped
    assert "one end must be straight" in skipped.why


def test_elements_may_refer_to_named_points() -> None:
    points = (
        '<CgPoints name="poles"><CgPoint name="a">100 200 3</CgPoint>'
        '<CgPoint name="b">100 260 4.5</CgPoint></CgPoints>'
    )
    body = points + (
        '<Alignments><Alignment name="r" staStart="0"><CoordGeom>'
        '<Line><Start pntRef="a"/><End pntRef="b"/></Line>'
        '<Line><Start pntRef="b"/><End pntRef="c"/></Line></CoordGeom></Alignment></Alignments>'
    )
    model = parse(document(body), "f.xml")
    (found,) = model.alignments
    assert found.length == pytest.approx(60.0)
    np.testing.assert_allclose(found.at(np.array([40.0])).xyz, [[240.0, 100.0, 4.0]])
    (skipped,) = model.skipped
    assert 'no point "c"' in skipped.why
    (group,) = model.features
    assert (group.name, group.kind, group.points.tolist()) == (
        "poles",
        "points",
        [[200.0, 100.0, 3.0], [260.0, 100.0, 4.5]],
    )


def test_polylines_with_heights_make_their_own_profile() -> None:
    body = (
        '<Alignments state="existing"><Alignment name="p" staStart="5"><CoordGeom><IrregularLine>'
        "<Start>0 0 10</Start><End>40 30 16</End>"
        "<PntList3D>0 0 10 0 30 13 0 30 13 40 30 16</PntList3D>"
        "</IrregularLine></CoordGeom></Alignment></Alignments>"
    )
    found = only(parse(document(body), "f.xml"))
    assert found.state == "existing"
    assert found.length == pytest.approx(70.0)
    line = found.at(np.array([15.0, 50.0, 70.0]))
    np.testing.assert_allclose(line.xyz, [[15, 0, 11.5], [30, 20, 14.5], [30, 40, 16]])
    np.testing.assert_allclose(line.heading, [0.0, math.pi / 2, math.pi / 2])
    np.testing.assert_allclose(line.gradient, [0.1, 0.075, 0.075])


@pytest.mark.parametrize("unit", list(UNITS))
def test_directions_need_not_be_stated(unit: str) -> None:
    wanted = course("clothoid")
    text = re.sub(r' dir\w*="[^"]*"', "", document(alignment(wanted, unit), unit).decode())
    model = parse(text.encode(), "f.xml")
    agrees(only(model), wanted)
    assert model.conflicts == ()


def test_heights_that_are_all_zero_are_no_heights() -> None:
    body = (
        '<Alignments><Alignment name="p" staStart="0"><CoordGeom><Line><Start>0 0 0</Start>'
        "<End>0 9 0</End></Line></CoordGeom></Alignment></Alignments>"
    )
    found = only(parse(document(body), "f.xml"))
    assert np.isnan(found.at(np.array([3.0])).xyz[0, 2])
    assert any("heights are unknown" in note for note in found.notes)
