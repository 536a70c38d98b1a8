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

from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

MOST = 64
"""Room for the vertices of one slice: the difference of two boxes has at most 30 faces."""


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


@dataclass(frozen=True)
class Pieces:
    """Convex polygons, some with holes, stored one after the other; see `box_slices`.

    points: (k, 2) [m], start: (p + 1,); holes: (m, 2) [m], hole_start: (h + 1,), owner: (h,) the
    piece of each hole, ascending; simple polygons. A hole may reach beyond its piece;
    a piece may have several.
    """

    points: Array
    start: IntArray
    holes: Array
    hole_start: IntArray
    owner: IntArray

    def __len__(self) -> int:
        return len(self.start) - 1


def solid_pieces(points: Array, start: IntArray) -> Pieces:
    """Pieces without holes: points (k, 2) [m], start (p + 1,)."""
    none = np.zeros(0, dtype=np.int64)
    return Pieces(points, start, np.zeros((0, 2)), np.zeros(1, dtype=np.int64), none)


def slice_pieces(a: Boxes, b: Boxes) -> Pieces:
    """`box_slices` as pieces without holes."""
    points, start, _ = box_slices(a, b)
    return solid_pieces(points, start)


def joined_pieces(parts: list[Pieces]) -> Pieces:
    """All pieces of several lists."""

    def ends(starts: list[IntArray]) -> IntArray:
        counts = np.concatenate([np.diff(s) for s in starts])
        return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

    first = np.cumsum([0, *(len(p) for p in parts)])
    return Pieces(
        np.concatenate([p.points for p in parts]),
        ends([p.start for p in parts]),
        np.concatenate([p.holes for p in parts]),
        ends([p.hole_start for p in parts]),
        np.concatenate([p.owner + n for p, n in zip(parts, first[:-1], strict=True)]),
    )


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
