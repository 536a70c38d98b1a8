"""Polygons: cut into convex parts that are the polygon, covered by rectangles."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import Point, Polygon

from backend.errors import InputError
from backend.gauge.convex import (
    Rectangle,
    convex_parts,
    cover,
    outside_distance,
    polygon_of,
    rectangles,
)
from backend.spatial.types import Array

ELL = Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 9), (0, 9)])
FRAME = Polygon([(0, 0), (8, 0), (8, 6), (0, 6)], [[(2, 2), (2, 4), (6, 4), (6, 2)]])


def star(radii: list[float]) -> Polygon:
    """With corners at these distances from the origin, at equal angles."""
    angles = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    return Polygon(np.stack([np.cos(angles), np.sin(angles)], axis=1) * np.array(radii)[:, None])


def corners(r: Rectangle) -> Array:
    across = np.array([-r.axis[1], r.axis[0]])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * r.half
    return np.asarray(r.center + signs @ np.stack([r.axis, across]))


radii = st.lists(st.floats(1.0, 10.0), min_size=4, max_size=12)


@given(radii)
def test_parts_are_convex_and_together_the_polygon(lengths: list[float]) -> None:
    polygon = star(lengths)
    parts = [Polygon(part) for part in convex_parts(polygon)]
    for part in parts:
        assert part.exterior.is_ccw
        assert part.convex_hull.area == pytest.approx(part.area, rel=1e-6)
    assert sum(part.area for part in parts) == pytest.approx(polygon.area, rel=1e-6)
    assert shapely.union_all(parts).symmetric_difference(polygon).area < 1e-6


def test_few_parts() -> None:
    assert len(convex_parts(Polygon([(0, 0), (2, 0), (4, 0), (4, 3), (0, 3)]))) == 1
    assert len(convex_parts(ELL)) <= 3
    holed = [Polygon(part) for part in convex_parts(FRAME)]
    assert sum(part.area for part in holed) == pytest.approx(FRAME.area)
    assert len(holed) <= 8


@settings(max_examples=15)
@given(radii, st.floats(0.05, 1.0), st.integers(1, 8))
def test_rectangles_cover_a_polygon(lengths: list[float], excess: float, most: int) -> None:
    polygon = star(lengths)
    found = cover(polygon, excess, most)
    union = shapely.union_all([Polygon(corners(r)) for r in found])
    assert polygon.difference(union.buffer(1e-6)).is_empty


@settings(max_examples=12)
@given(radii, st.floats(0.4, 1.0))
def test_rectangles_exceed_a_convex_part_by_no_more(lengths: list[float], excess: float) -> None:
    hull = star(lengths).convex_hull
    found = rectangles(convex_parts(hull)[0], excess, 100)
    assert max(hull.distance(Point(p)) for r in found for p in corners(r)) <= excess + 1e-9


def test_right_angled_shapes_take_their_own_rectangles() -> None:
    for turn in (0.0, 0.3):
        c, s = np.cos(turn), np.sin(turn)
        turned = affinity.affine_transform(ELL, [c, -s, s, c, 0.0, 0.0])
        found = cover(turned, 0.05, 12)
        assert len(found) == 2
        assert sum(4.0 * r.half.prod() for r in found) == pytest.approx(ELL.area, abs=1e-3)
    assert len(cover(FRAME, 0.05, 12)) == 4


@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=1, max_size=10), radii)
def test_distances_are_shapelys(at: list[tuple[float, float]], lengths: list[float]) -> None:
    hull = star(lengths).convex_hull
    got = outside_distance(np.array(at), convex_parts(hull)[0])
    np.testing.assert_allclose(got, [hull.distance(Point(p)) for p in at], atol=1e-6)


@pytest.mark.parametrize(
    "ring", [[(0, 0), (1, 0)], [(0, 0), (4, 4), (4, 0), (0, 4)], [(0, 0), (1, 1), (2, 2)]]
)
def test_what_is_no_polygon_is_refused(ring: list[tuple[float, float]]) -> None:
    with pytest.raises(InputError, match="yard: the polygon crosses itself or encloses nothing"):
        polygon_of(np.array(ring, dtype=float), "yard")
