"""One row of an image: the angles at which a body turning about its pivot touches a polygon.

Two convex polygons are apart exactly when an edge normal of one of them separates them. While the
body turns, each corner p lies beyond an edge line n . x = c of the polygon where
|p| cos(psi + angle(p) - angle(n)) > c, and each corner q of the polygon beyond an edge m . x = e of
the body where |q| cos(angle(q) - angle(m) - psi) > e: arcs of a circle, with ends in closed form.
So the free angles are the union over edges of the intersection over corners of arcs, and a row of
cells is that many operations on words of 64 bits.

A cell holds for all of its configurations when the lines are shifted by `margin` (how far the
pivot can be from where it is taken to be) and the arcs' ends by `turn` (how much the angle can
differ). Positive values leave only what is free throughout the cell, negative ones only what is
blocked throughout.

This is the plain form, for one row at a time; `rows_batch` does the same for many.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.planar_arm import Profiles
from backend.spatial.types import AnyArray, Array, IntArray

ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
SLACK = 1e-12  # [m] more than rounding moves a line


class Polygons(NamedTuple):
    """Convex polygons in the arm's plane. body slab and obstacle: (k,); sides: (k,) corners;
    x, z: (k, v) [m]; normal_x, normal_z, offset: (k, v) edges n . x <= offset; bearing: (k, v)
    of n [rad]; low, high: (k, 2) bounding rectangles.
    """

    slab: IntArray
    obstacle: IntArray
    sides: IntArray
    x: Array
    z: Array
    normal_x: Array
    normal_z: Array
    offset: Array
    bearing: Array
    low: Array
    high: Array


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _fill(words: AnyArray, value: np.uint64) -> None:
    for w in range(len(words)):
        words[w] = value


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _range_word(first: int, last: int, word: int) -> np.uint64:
    """Bits first..last of the row that fall into this word."""
    low, high = max(first - 64 * word, 0), min(last - 64 * word, 63)
    if low > high:
        return np.uint64(0)
    return (ALL << np.uint64(low)) & (ALL >> np.uint64(63 - high))


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _keep(center: float, half: float, step: float, cells: int, mask: AnyArray) -> None:
    """Clear the cells that are not within `half` of `center` (from the first cell), on the circle,
    both [rad].
    """
    period = abs(2.0 * math.pi / step)
    middle = 0.5 * (cells - 1)
    c = center / step
    c -= period * math.floor((c - middle) / period + 0.5)
    h = half / abs(step)
    again = c - period if c > middle else c + period
    first, last = math.floor(c - h) + 1, math.ceil(c + h) - 1
    first2, last2 = math.floor(again - h) + 1, math.ceil(again + h) - 1
    for w in range(len(mask)):
        mask[w] &= _range_word(first, last, w) | _range_word(first2, last2, w)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _keep_beyond(
    c: float, radius: float, center: float, turn: float, step: float, cells: int, mask: AnyArray
) -> bool:
    """Clear the cells in which a corner at `radius` is not beyond a line at distance c; center: the
    angle at which it is farthest. Whether there may be others.
    """
    if c <= -radius:
        return True
    half = math.acos(c / radius) - turn if c < radius else -1.0
    if half <= 0.0:
        _fill(mask, np.uint64(0))
        return False
    if half < math.pi:
        _keep(center, half, step, cells, mask)
    return True


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def touched(
    body: Profiles,
    b: int,
    polygons: Polygons,
    k: int,
    px: float,
    pz: float,
    origin: float,
    step: float,
    cells: int,
    margin: float,
    turn: float,
    room: AnyArray,
    polar: Array,
    out: AnyArray,
) -> None:
    """Set the bits of `out` (words,) where body b with its pivot at (px, pz) is not apart from
    polygon k.

    origin: angle of the first cell; step: from cell to cell [rad]. Bits beyond `cells` mean
    nothing. room: (2, words), polar: (2, v) to work.
    """
    corners, edges = body.sides[b], polygons.sides[k]
    free, mask, words = room[0], room[1], len(out)
    _fill(free, np.uint64(0))
    inside = body.depth[b] <= 0.0
    for i in range(edges):
        c = polygons.offset[k, i] - polygons.normal_x[k, i] * px - polygons.normal_z[k, i] * pz
        c += margin
        if c < -body.reach[b]:
            return
        inside = inside and c >= 0.0
        if c >= body.depth[b] + SLACK:
            continue
        _fill(mask, ALL)
        for v in range(corners):
            center = polygons.bearing[k, i] - body.bearing[b, v] - origin
            if not _keep_beyond(c, body.radius[b, v], center, turn, step, cells, mask):
                break
        for w in range(words):
            free[w] |= mask[w]
    if inside:  # the pivot lies in both
        _fill(out, ALL)
        return
    nearest = math.inf
    for v in range(edges):
        x, z = polygons.x[k, v] - px, polygons.z[k, v] - pz
        polar[0, v], polar[1, v] = math.hypot(x, z), math.atan2(z, x)
        nearest = min(nearest, polar[0, v])
    for j in range(corners):
        e = body.offset[b, j] + margin
        if e >= nearest:
            continue  # that corner is never beyond this edge
        _fill(mask, ALL)
        for v in range(edges):
            center = polar[1, v] - body.normal[b, j] - origin
            if not _keep_beyond(e, polar[0, v], center, turn, step, cells, mask):
                break
        for w in range(words):
            free[w] |= mask[w]
    for w in range(words):
        out[w] |= ~free[w]


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def rectangle_distance(low: Array, high: Array, px: float, pz: float) -> float:
    """Squared distance of a point to a rectangle."""
    dx = max(low[0] - px, 0.0, px - high[0])
    dz = max(low[1] - pz, 0.0, pz - high[1])
    return float(dx * dx + dz * dz)
