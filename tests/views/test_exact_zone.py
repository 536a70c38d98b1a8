"""Exact zones on the ground: holes, three kinds of outline, age, and Sun's zone in their place."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import toy_site as toy
import viser
from viewing import counted, handle

from cockpit.views import palette
from cockpit.views.exact_zone import LINES, outline
from cockpit.views.shapes import dashed, filled_geometry, rings
from cockpit.views.zone import OwnNodes

RING = shapely.Point(2.0, 0.5).buffer(3.0).difference(shapely.Point(2.0, 0.5).buffer(1.2))
TWO = shapely.union_all([RING, shapely.box(8.0, 0.0, 9.0, 2.0)])
KEY = "left<-right"
ROOT = "/own/exact/right"


def zones(state_time: float = 0.0, **other: shapely.Geometry | None) -> toy.ExactZone:
    found = {"as_is": RING, "any_swing": RING.buffer(1.0), "any_posture": RING.buffer(2.0)}
    return toy.ExactZone(state_time, **{**found, **other})


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    corners = vertices[faces].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] >= 0.0).all()
    return float(normals[:, 2].sum() / 2)


@pytest.mark.parametrize("shape", [RING, TWO, shapely.box(0, 0, 2, 1)])
def test_holes_stay_open(shape: shapely.Geometry) -> None:
    vertices, faces = filled_geometry(shape)
    assert area(vertices, faces) == pytest.approx(shape.area, rel=1e-5)
    middles = shapely.points(vertices[faces].mean(axis=1)[:, :2].astype(float))
    assert shapely.covers(shape.buffer(1e-4), middles).all()


def test_nothing_and_lines_have_no_area() -> None:
    for shape in (shapely.Polygon(), shapely.LineString([(0, 0), (1, 1)]), shapely.Point(1, 1)):
        assert len(filled_geometry(shape)[1]) == 0
        assert rings(shape) == []
    assert rings(None) == []


def test_every_ring_is_outlined() -> None:
    assert len(rings(TWO)) == 3
    solid = outline(TWO, None)
    lengths = np.linalg.norm(np.diff(solid, axis=1)[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(TWO.length, rel=1e-5)
    assert outline(None, None).shape == outline(shapely.Polygon(), (0.1, 0.1)).shape == (0, 2, 3)


@pytest.mark.parametrize(("on", "off"), [(0.4, 0.25), (0.07, 0.2), (5.0, 5.0)])
def test_dashes_follow_the_outline(on: float, off: float) -> None:
    ring = rings(RING)[0]
    lines = dashed(ring, on, off)
    drawn = np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1).sum()
    whole = shapely.LinearRing(ring)
    assert drawn == pytest.approx(whole.length * on / (on + off), rel=1e-3)
    ends = shapely.points(lines.reshape(-1, 3)[:, :2].astype(float))
    assert shapely.distance(whole, ends).max() < 1e-5
    assert lines.dtype == np.float32
    assert len(dashed(np.zeros((3, 2)), on, off)) == 0


def test_zones_of_people_and_the_site_have_their_colours(server: viser.ViserServer) -> None:
    source, own = toy.Source(), OwnNodes(server.scene, "left", 1.0)
    snapshot = toy.snapshot(time=10.0)
    for layer in ("people", "site"):
        source.images[("zone", f"left<-layer:{layer}")] = zones(9.0)
    own.update(snapshot, source, 0.3, 0.0)
    for layer, color in (("people", palette.PEOPLE), ("site", palette.SITE)):
        fill = handle(server, f"/own/around/{layer}/fill")
        assert fill.visible
        assert tuple(fill.color) == tuple(color)
        lines = handle(server, f"/own/around/{layer}/any_swing")
        assert len(lines.points) > 0
        assert (lines.colors == palette.each(color, lines.points)).all()
    source.images[("zone", "left<-layer:people")] = toy.ExactZone(9.5)  # nobody knows
    own.update(snapshot, source, 0.3, 0.0)
    assert not handle(server, "/own/around/people").visible
    assert handle(server, "/own/around/site").visible
    own.update(snapshot, source, 0.3, 0.0, "sun")
    assert not handle(server, "/own/around/site").visible


def test_all_variants_are_drawn(server: viser.ViserServer) -> None:
    source, own = toy.Source(), OwnNodes(server.scene, "left", 1.0)
    source.images[("zone", KEY)] = zones(9.0)
    source.images[("sun", KEY)] = toy.Zone(toy.ring_zone(), 9.9)
    snapshot = toy.snapshot(time=10.0)
    own.update(snapshot, source, 0.3, 0.0)
    fill = handle(server, f"{ROOT}/fill")
    assert fill.visible
    assert fill.opacity == pytest.approx(0.30)
    assert area(fill.vertices, fill.faces) == pytest.approx(RING.area, rel=0.01)
    assert handle(server, ROOT).position[2] == pytest.approx(0.315)
    for variant, (dash, _) in LINES.items():
        node = handle(server, f"{ROOT}/{variant}")
        assert node.visible
        assert tuple(node.colors[0, 0]) == palette.line(palette.PARTNER)
        assert node.colors.shape == node.points.shape
        drawn = np.linalg.norm(np.diff(node.points, axis=1)[:, 0], axis=1).sum()
        share = 1.0 if dash is None else dash[0] / sum(dash)
        shape = source.images[("zone", KEY)].zones[variant]
        assert drawn == pytest.approx(share * shape.length, rel=0.01)
    # Sun's zone gives way.
    assert server.scene.get_handle_by_name("/own/zone/right") is None
    assert not counted(server, lambda: own.update(snapshot, source, 0.3, 0.0))


def test_an_old_zone_is_grey_without_a_fill(server: viser.ViserServer) -> None:
    source, own = toy.Source(), OwnNodes(server.scene, "left", 1.0)
    source.images[("zone", KEY)] = zones(8.1)
    own.update(toy.snapshot(time=10.0), source, 0.0, 0.0)
    fill, edge = (handle(server, f"{ROOT}/{part}") for part in ("fill", "any_swing"))
    assert fill.visible
    own.update(toy.snapshot(time=10.0), source, 0.0, lost=0.2)
    assert not fill.visible
    assert tuple(edge.colors[0, 0]) == palette.line(palette.STALE)
    source.images[("zone", KEY)] = zones(10.0)
    own.update(toy.snapshot(time=10.4), source, 0.0, 0.0)
    assert fill.visible
    assert tuple(edge.colors[0, 0]) == palette.line(palette.PARTNER)


def test_unknown_and_empty_variants(server: viser.ViserServer) -> None:
    source, own = toy.Source(), OwnNodes(server.scene, "left", 1.0)
    source.images[("zone", KEY)] = zones(any_swing=None, as_is=shapely.Polygon())
    own.update(toy.snapshot(), source, 0.0, 0.0)
    shown = {part: handle(server, f"{ROOT}/{part}").visible for part in ("fill", *LINES)}
    assert shown == {"fill": False, "as_is": False, "any_swing": False, "any_posture": True}


def test_suns_zone_is_drawn_when_chosen_or_alone(server: viser.ViserServer) -> None:
    source, own = toy.Source(), OwnNodes(server.scene, "left", 1.0)
    source.images[("zone", KEY)] = zones()
    source.images[("sun", KEY)] = toy.Zone(toy.ring_zone())
    snapshot = toy.snapshot()

    def shown(kind: str) -> tuple[bool, bool]:
        own.update(snapshot, source, 0.0, 0.0, kind)
        nodes = (server.scene.get_handle_by_name(n) for n in (ROOT, "/own/zone/right"))
        exact, sun = (node is not None and node.visible for node in nodes)
        return exact, sun

    assert shown("exact") == (True, False)
    assert shown("sun") == (False, True)
    assert shown("exact") == (True, False)
    source.images[("zone", KEY)] = zones(as_is=None)
    assert shown("exact") == (False, True)
    del source.images[("sun", KEY)]
    assert shown("exact") == (False, False)


def test_leaving_takes_the_zone_along(server: viser.ViserServer) -> None:
    source, own = toy.Source(), OwnNodes(server.scene, "left", 1.0)
    source.images[("zone", KEY)] = zones()
    own.update(toy.snapshot(), source, 0.0, 0.0)
    own.remove()
    assert server.scene.get_handle_by_name(ROOT) is None
    assert server.scene.get_handle_by_name(f"{ROOT}/fill") is None
