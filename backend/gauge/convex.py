"""Polygons in the plane: cut into convex parts, stood for by rectangles, distances to them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from backend.errors import InputError
from backend.spatial.types import Array, BoolArray

FLAT = 1e-9
"""Corners that turn by no more than this (sine) are no corners."""
SAME = 1e-9
"""Corners that are no farther apart than this are one [m]."""
NEAR = 1e-4
"""Nothing is cut between corners that are no farther apart than this [m]."""


@dataclass(frozen=True)
class Rectangle:
    """center: (2,); axis: (2,) unit vector of its first side; half: (2,) [m]."""

    center: Array
    axis: Array
    half: Array


def polygon_of(points: Array, where: str) -> Polygon:
    """The polygon of a ring (k, 2); raises InputError unless it is one that encloses an area."""
    polygon = Polygon(points) if len(points) >= 3 else Polygon()
    if polygon.is_empty or not polygon.is_valid or polygon.area < 1e-6:
        raise InputError(
            f"{where}: the polygon crosses itself or encloses nothing; allowed are three or more "
            "corners in order around an area."
        )
    return polygon


def convex_parts(shape: BaseGeometry) -> list[Array]:
    """Convex polygons (k, 2), counter-clockwise, that together are `shape` and do not overlap.

    Triangles of a constrained Delaunay triangulation, merged across sides while the result is
    convex (Hertel and Mehlhorn 1983: at most four times the fewest parts).
    """
    parts: list[Array] = []
    for polygon in shapely.get_parts(shape):
        if isinstance(polygon, Polygon) and polygon.area > 1e-9:
            parts += _parts(polygon)
    return parts


def _parts(polygon: Polygon) -> list[Array]:
    whole = _corners(np.array(polygon.exterior.coords)[:-1, :2])
    if not polygon.interiors and _is_convex(whole):
        return [whole]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    rings = [_counter_clockwise(np.array(t.exterior.coords)[:-1, :2]) for t in triangles]
    rings = [ring for ring in rings if abs(_area(ring)) > 1e-9]
    merged = True
    while merged:
        merged = False
        for i in range(len(rings)):
            for j in range(i + 1, len(rings)):
                both = _merged(rings[i], rings[j])
                if both is not None:
                    rings[i] = both
                    del rings[j]
                    merged = True
                    break
            if merged:
                break
    return [_corners(ring) for ring in rings]


def _merged(a: Array, b: Array) -> Array | None:
    """Two rings that share a side as one, if it is convex."""
    for i in range(len(a)):
        start, end = a[i], a[(i + 1) % len(a)]
        for j in range(len(b)):
            if (b[j] == end).all() and (b[(j + 1) % len(b)] == start).all():
                rest = np.roll(b, -(j + 2), axis=0)[: len(b) - 2]
                ring = np.concatenate([np.roll(a, -(i + 1), axis=0), rest])
                return ring if _is_convex(ring) else None
    return None


def _turns(ring: Array) -> Array:
    """Sine of the turn at every corner (k,)."""
    before = ring - np.roll(ring, 1, axis=0)
    after = np.roll(ring, -1, axis=0) - ring
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.asarray(cross / (np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)))


def _is_convex(ring: Array) -> bool:
    return bool((_turns(ring) >= -FLAT).all())


def _area(ring: Array) -> float:
    x, y = ring.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _counter_clockwise(ring: Array) -> Array:
    return ring if _area(ring) > 0.0 else ring[::-1].copy()


def _corners(ring: Array) -> Array:
    """Counter-clockwise and without points along its sides."""
    ring = _counter_clockwise(ring)
    ring = ring[np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1) > SAME]
    back = ((ring - np.roll(ring, 1, axis=0)) * (np.roll(ring, -1, axis=0) - ring)).sum(axis=1) < 0
    # A needle's ends turn back, and are corners.
    return np.asarray(ring[(np.abs(_turns(ring)) > FLAT) | back])


def outside_distance(points: Array, polygons: Array) -> Array:
    """(..., n) from points (..., n, 2) to convex polygons (..., k, 2), counter-clockwise; 0 inside.

    Sides may have no length.
    """
    start = polygons[..., None, :, :]
    side = np.roll(polygons, -1, axis=-2)[..., None, :, :] - start
    to = points[..., :, None, :] - start
    length2 = np.maximum((side**2).sum(-1), 1e-30)
    along = np.clip((to * side).sum(-1) / length2, 0.0, 1.0)
    apart = np.linalg.norm(to - along[..., None] * side, axis=-1).min(axis=-1)
    left = side[..., 0] * to[..., 1] - side[..., 1] * to[..., 0]
    return np.asarray(np.where((left >= 0.0).all(axis=-1), 0.0, apart))


def cover(shape: BaseGeometry, max_excess: float, most: int) -> list[Rectangle]:
    """Rectangles that together contain the polygons of `shape`, and exceed each convex part that
    they stand for by no more than `max_excess` [m], unless `most` for each are too few.

    The fewest of three ways to cut it up: into `convex_parts`, and into strips between its corners
    along and across its longest side, which find the rectangles that buildings are made of.
    """
    found: list[Rectangle] = []
    for polygon in shapely.get_parts(shape):
        if isinstance(polygon, Polygon) and polygon.area > 1e-9:
            ways = [_parts(polygon), *(_slabs(polygon, axis) for axis in _main_axes(polygon))]
            ways = [way for way in ways if _complete(way, polygon)]
            if not ways:
                ways = [[_corners(shapely.get_coordinates(polygon.convex_hull)[:-1])]]
            covers: list[list[Rectangle]] = [
                [r for part in way for r in rectangles(part, max_excess, most)] for way in ways
            ]
            found += covers[int(np.argmin([len(rectangles) for rectangles in covers]))]
    return found


def _complete(parts: list[Array], polygon: Polygon) -> bool:
    """Whether nothing was lost: overlays of almost coincident sides may go wrong."""
    lost = polygon.area - sum(_area(part) for part in parts)
    return bool(lost <= 1e-6 * max(polygon.length, 1.0))


def rectangles(part: Array, max_excess: float, most: int) -> list[Rectangle]:
    """Rectangles that cover the convex polygon `part` (k, 2).

    The smallest rectangle around it, or strips of it: as few as exceed the polygon by no more than
    `max_excess` [m], and no more than `most`.
    """
    directions = np.roll(part, -1, axis=0) - part
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    best = min(directions, key=lambda axis: _strips(part, axis, 1)[1])
    across = np.array([-best[1], best[0]])
    for count in range(1, most + 1):
        tried = [_strips(part, axis, count) for axis in (best, across)]
        found, _, excess = min(tried, key=lambda strips: strips[2])
        if excess <= max_excess:
            break
    return found


def _main_axes(polygon: Polygon) -> tuple[Array, Array]:
    """Unit vectors along and across the longest side."""
    ring = np.array(polygon.exterior.coords)[:, :2]
    sides = np.diff(ring, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    x, y = sides[lengths.argmax()] / lengths.max()
    return np.array([x, y]), np.array([-y, x])


def _slabs(polygon: Polygon, axis: Array) -> list[Array]:
    """Convex parts between neighbouring corners' coordinates along `axis`."""
    R = np.stack([axis, [-axis[1], axis[0]]], axis=1)
    local = shapely.transform(polygon, lambda points: points @ R)
    rings = [local.exterior, *local.interiors]
    x = np.unique(np.concatenate([np.array(ring.coords)[:, 0] for ring in rings]))
    x = x[np.concatenate([[True], np.diff(x) > NEAR])]  # no needles between corners side by side
    _, low, _, high = local.bounds
    parts = []
    for left, right in pairwise([x[0] - 1.0, *x[1:-1], x[-1] + 1.0]):
        strip = shapely.box(left, low - 1.0, right, high + 1.0)
        parts += [part @ R.T for part in convex_parts(local.intersection(strip))]
    return parts


def _strips(part: Array, axis: Array, count: int) -> tuple[list[Rectangle], float, float]:
    """`count` rectangles side by side along `axis`, their area and excess."""
    across = np.array([-axis[1], axis[0]])
    local = part @ np.stack([axis, across], axis=1)
    edges = np.linspace(local[:, 0].min(), local[:, 0].max(), count + 1)
    found, area, excess = [], 0.0, 0.0
    for low, high in pairwise(edges):
        y = _range_within(local, low, high)
        middle = np.array([(low + high) / 2.0, (y.min() + y.max()) / 2.0])
        half = np.array([(high - low) / 2.0, (y.max() - y.min()) / 2.0])
        corners = middle + half * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        excess = max(excess, float(outside_distance(corners, local).max()))
        area += 4.0 * float(half.prod())
        found.append(Rectangle(middle[0] * axis + middle[1] * across, axis, half))
    return found, area, excess


def _range_within(ring: Array, low: float, high: float) -> Array:
    """The second coordinates at which the ring's corners and sides lie within [low, high]."""
    after = np.roll(ring, -1, axis=0)
    y = [ring[_between(ring[:, 0], low, high), 1]]
    for x in (low, high):
        crosses = (np.minimum(ring[:, 0], after[:, 0]) <= x) & (
            x <= np.maximum(ring[:, 0], after[:, 0])
        )
        a, b = ring[crosses], after[crosses]
        width = b[:, 0] - a[:, 0]
        t = np.where(width == 0.0, 0.0, (x - a[:, 0]) / np.where(width == 0.0, 1.0, width))
        y.append(a[:, 1] + t * (b[:, 1] - a[:, 1]))
    return np.concatenate(y)


def _between(x: Array, low: float, high: float) -> BoolArray:
    return np.asarray((x >= low) & (x <= high))
