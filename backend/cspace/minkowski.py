"""Convex regions of the driving plane: where one convex body, moved without turning, meets another.

For convex bodies a and b the translations t for which b + t meets a are the Minkowski difference
a - b = {p - s : p in a, s in b} (de Berg et al., Computational Geometry, 3rd ed., Theorem 13.3).
Driving moves in x and y only, so the slice of that solid at height 0 counts: a convex polygon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numba import njit
from shapely.geometry.base import BaseGeometry

from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

MOST = 64
"""Room for the vertices of one slice: the difference of two boxes has at most 30 faces."""

_SPECK = 1e-6
"""A free place smaller than this counts as taken: rounding of the overlay can make such [m^2]."""


def box_slices(a: Boxes, b: Boxes) -> tuple[Array, IntArray, IntArray]:
    """All translations (x, y) that bring a box of b into contact with a box of a.

    a, b: boxes in one frame with z up. Returns points (k, 2) [m] of the convex polygons one after
    the other, counter-clockwise, where each begins and the last ends (p + 1,), and the pair (p, 2)
    of indices of each. Pairs that miss each other in height have no polygon. Exact up to rounding.
    """
    points, start, index = _box_slices(
        *(np.ascontiguousarray(v) for v in (a.centers, a.rotations, a.half_extents)),
        *(np.ascontiguousarray(v) for v in (b.centers, b.rotations, b.half_extents)),
    )
    return points, start, index


def polygons(points: Array, start: IntArray) -> list[shapely.Polygon]:
    """Shapely polygons of rings stored one after the other: points (k, 2), start (p + 1,)."""
    ring = np.repeat(np.arange(len(start) - 1), np.diff(start))
    if len(ring) == 0:
        return []
    made: list[shapely.Polygon] = np.asarray(
        shapely.polygons(shapely.linearrings(points, indices=ring))
    ).tolist()
    return made


def union(pieces: list[shapely.Polygon]) -> BaseGeometry:
    """The union as a Polygon or MultiPolygon; an empty Polygon for no pieces."""
    return shapely.union_all(pieces) if pieces else shapely.Polygon()


@dataclass(frozen=True)
class Pieces:
    """Convex polygons, some with a convex hole, stored one after the other; see `box_slices`.

    points: (k, 2) [m], start: (p + 1,); holes: (h, 2) [m], hole_start: (p + 1,), equal neighbours
    where a piece has no hole.
    """

    points: Array
    start: IntArray
    holes: Array
    hole_start: IntArray


def slice_pieces(a: Boxes, b: Boxes) -> Pieces:
    """`box_slices` as pieces without holes."""
    points, start, _ = box_slices(a, b)
    return Pieces(points, start, np.zeros((0, 2)), np.zeros_like(start))


def joined_pieces(parts: list[Pieces]) -> Pieces:
    """All pieces of several lists."""

    def ends(name: str) -> IntArray:
        counts = [np.diff(getattr(p, name)) for p in parts]
        return np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int64)

    return Pieces(
        np.concatenate([p.points for p in parts]),
        ends("start"),
        np.concatenate([p.holes for p in parts]),
        ends("hole_start"),
    )


def cover(pieces: Pieces) -> BaseGeometry:
    """The union of all pieces.

    Few outlines matter, those that lie in no other one. A free place within their union lies in
    the holes of these few; what the pieces near it leave of it is cut out again.
    """
    if len(pieces.start) < 2:
        return shapely.Polygon()
    every = np.array(polygons(pieces.points, pieces.start), dtype=object)
    outer = outermost(pieces.points, pieces.start, np.ones(len(every), dtype=np.bool_))
    outline = union(list(every[outer]))
    has = np.diff(pieces.hole_start) > 0
    if not (outer & has).any():
        return outline
    filled = pieces.hole_start[np.append(True, has)]
    hole = np.full(len(every), None, dtype=object)
    hole[has] = polygons(pieces.holes, np.unique(filled))
    free = union(list(hole[outer & has]))
    # Largest first, solid before hollow: most free places are gone after a few.
    for k in np.lexsort((-shapely.area(every), has)):
        if free.is_empty:
            return outline
        if not shapely.intersects(every[k], free):
            continue
        free = (
            shapely.difference(free, every[k])
            if not has[k]
            else shapely.union(
                shapely.difference(free, every[k]), shapely.intersection(free, hole[k])
            )
        )
    parts = [g for g in shapely.get_parts(free) if g.geom_type == "Polygon" and g.area > _SPECK]
    return shapely.difference(outline, union(parts)) if parts else outline


def outermost(points: Array, start: IntArray, solid: BoolArray) -> BoolArray:
    """False for polygons that lie in another one, which can be left out of a union.

    points, start: convex counter-clockwise polygons as of `box_slices`; solid: (p,) whether a
    polygon covers all of its inside (only such ones make others superfluous).
    """
    if len(start) < 2:
        return np.zeros(0, dtype=np.bool_)
    low = np.minimum.reduceat(points, start[:-1])
    high = np.maximum.reduceat(points, start[:-1])
    order = np.argsort(-np.prod(high - low, axis=1), kind="stable")
    return np.asarray(_outermost(points, start, solid, low, high, order))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def convex_hull(points: Array, n: int, out: Array) -> int:
    """Hull of points[:n] (n, 2) into out, counter-clockwise; the number of its vertices.

    Andrew's monotone chain; vertices closer to a chord than rounding are left out.
    """
    if n < 3:
        return 0
    order = np.argsort(points[:n, 0])
    # Equal x need the order of y: points of one x stand together after the sort.
    for i in range(1, n):
        k, j = order[i], i - 1
        while j >= 0 and points[order[j], 0] == points[k, 0] and points[order[j], 1] > points[k, 1]:
            order[j + 1] = order[j]
            j -= 1
        order[j + 1] = k
    chain = np.empty(2 * n + 2, np.int64)
    m = 0
    for turn in range(2):
        floor = m + 1 if turn == 0 else m
        for i in range(n):
            if turn == 1 and i == 0:
                continue
            k = order[i] if turn == 0 else order[n - 1 - i]
            while m > floor:
                p, q = chain[m - 2], chain[m - 1]
                ux, uy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
                vx, vy = points[k, 0] - points[p, 0], points[k, 1] - points[p, 1]
                if ux * vy - uy * vx > 1e-13 * (abs(ux) + abs(uy)):
                    break
                m -= 1
            chain[m] = k
            m += 1
    m -= 1
    for i in range(m):
        out[i] = points[chain[i]]
    return m if m >= 3 else 0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _box_slices(
    ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array
) -> tuple[Array, IntArray, IntArray]:
    pairs = len(ca) * len(cb)
    points = np.empty((pairs * MOST, 2))
    start = np.zeros(pairs + 1, np.int64)
    index = np.empty((pairs, 2), np.int64)
    vertex, crossing = np.empty((64, 3)), np.empty((400, 2))
    g = np.empty((6, 3))
    made = 0
    for i in range(len(ca)):
        for j in range(len(cb)):
            for k in range(3):
                g[k] = Ra[i, :, k] * ha[i, k]
                g[k + 3] = Rb[j, :, k] * hb[j, k]
            c = ca[i] - cb[j]
            if abs(c[2]) > np.abs(g[:, 2]).sum():
                continue
            # The difference of two boxes is the zonotope c + sum of s_k g_k, |s_k| <= 1. Its edges
            # are among the 192 edges of the six-dimensional cube of signs.
            for v in range(64):
                vertex[v] = c
                for k in range(6):
                    if v >> k & 1:
                        vertex[v] += g[k]
                    else:
                        vertex[v] -= g[k]
            n = 0
            for v in range(64):
                for k in range(6):
                    w = v | (1 << k)
                    z, up = vertex[v, 2], vertex[w, 2]
                    if w == v or min(z, up) > 0.0 or max(z, up) < 0.0:
                        continue
                    if abs(up - z) < 1e-12:
                        crossing[n] = vertex[v, :2]
                        crossing[n + 1] = vertex[w, :2]
                        n += 2
                    else:
                        crossing[n] = vertex[v, :2] + z / (z - up) * (vertex[w, :2] - vertex[v, :2])
                        n += 1
            size = convex_hull(crossing, n, points[start[made] :])
            if size:
                index[made] = i, j
                start[made + 1] = start[made] + size
                made += 1
    return points[: start[made]].copy(), start[: made + 1].copy(), index[:made].copy()


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _inside(points: Array, first: int, last: int, x: float, y: float) -> bool:
    """Whether (x, y) lies in the convex polygon points[first:last]: bisection of its fan."""
    ox, oy = points[first, 0], points[first, 1]
    dx, dy = x - ox, y - oy
    low, high = first + 1, last - 1
    if (points[low, 0] - ox) * dy - (points[low, 1] - oy) * dx < 0.0:
        return False
    if (points[high, 0] - ox) * dy - (points[high, 1] - oy) * dx > 0.0:
        return False
    while high - low > 1:
        middle = (low + high) // 2
        if (points[middle, 0] - ox) * dy - (points[middle, 1] - oy) * dx >= 0.0:
            low = middle
        else:
            high = middle
    ex, ey = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    return bool(ex * (y - points[low, 1]) - ey * (x - points[low, 0]) >= 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _outermost(
    points: Array, start: IntArray, solid: BoolArray, low: Array, high: Array, order: IntArray
) -> BoolArray:
    keep = np.zeros(len(order), np.bool_)
    containers = np.empty(len(order), np.int64)
    count = 0
    for p in order:
        hidden = False
        for c in range(count):
            q = containers[c]
            if (
                low[p, 0] < low[q, 0]
                or low[p, 1] < low[q, 1]
                or high[p, 0] > high[q, 0]
                or high[p, 1] > high[q, 1]
            ):
                continue
            hidden = True
            for v in range(start[p], start[p + 1]):
                if not _inside(points, start[q], start[q + 1], points[v, 0], points[v, 1]):
                    hidden = False
                    break
            if hidden:
                break
        if not hidden:
            keep[p] = True
            if solid[p]:
                containers[count] = p
                count += 1
    return keep
