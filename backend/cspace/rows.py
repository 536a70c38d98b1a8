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
    """Convex polygons in the arm's plane. body slab and obstacle: (k,); count: (k,) corners;
    x, z: (k, v) [m]; normal_x, normal_z, offset: (k, v) edges n . x <= offset; low, high: (k, 2)
    bounding rectangles.
    """

    slab: IntArray
    obstacle: IntArray
    count: IntArray
    x: Array
    z: Array
    normal_x: Array
    normal_z: Array
    offset: Array
    low: Array
    high: Array


class Row(NamedTuple):
    """Cells of a joint: n cells at start + i step [rad], as angles in the arm's plane."""

    start: float
    step: float
    n: int


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def _range_word(first: int, last: int, word: int) -> np.uint64:
    """Bits first..last of the row that fall into this word."""
    low, high = max(first - 64 * word, 0), min(last - 64 * word, 63)
    if low > high:
        return np.uint64(0)
    return (ALL << np.uint64(low)) & (ALL >> np.uint64(63 - high))


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def _keep_arc(center: float, half: float, row: Row, mask: AnyArray) -> None:
    """Clear the cells of mask that are not within `half` of `center` [rad], on the circle."""
    inverse = 1.0 / row.step
    period = abs(2.0 * math.pi * inverse)
    middle = 0.5 * (row.n - 1)
    c = (center - row.start) * inverse
    c -= period * math.floor((c - middle) / period + 0.5)
    h = half * abs(inverse)
    first, last = math.floor(c - h) + 1, math.ceil(c + h) - 1
    c += -period if c > middle else period
    again_first, again_last = math.floor(c - h) + 1, math.ceil(c + h) - 1
    for w in range(len(mask)):
        mask[w] &= _range_word(first, last, w) | _range_word(again_first, again_last, w)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def touched(
    body: Profiles,
    b: int,
    polygons: Polygons,
    k: int,
    px: float,
    pz: float,
    row: Row,
    margin: float,
    turn: float,
    free: AnyArray,
    mask: AnyArray,
    out: AnyArray,
) -> None:
    """Set the bits of `out` where body b with its pivot at (px, pz) is not apart from polygon k.

    free, mask: scratch words, as many as out.
    """
    words = len(out)
    corners, edges = body.count[b], polygons.count[k]
    free[:] = 0
    reach, depth = body.reach[b], body.depth[b] + SLACK
    for i in range(edges):
        nx, nz = polygons.normal_x[k, i], polygons.normal_z[k, i]
        c = polygons.offset[k, i] - nx * px - nz * pz + margin
        if c >= depth:
            continue
        if c < -reach:
            return
        normal = math.atan2(nz, nx)
        mask[:] = ALL
        for v in range(corners):
            r = body.radius[b, v]
            if c <= -r:
                continue
            half = math.acos(c / r) - turn if c < r else -1.0
            if half <= 0.0:
                mask[:] = 0
                break
            if half < math.pi:
                _keep_arc(normal - body.bearing[b, v], half, row, mask)
        for w in range(words):
            free[w] |= mask[w]
    for j in range(corners):
        e = body.offset[b, j] + margin
        beyond = True
        for v in range(edges):
            x, z = polygons.x[k, v] - px, polygons.z[k, v] - pz
            if e >= 0.0 and x * x + z * z <= e * e:
                beyond = False
                break
        if not beyond:
            continue
        mask[:] = ALL
        for v in range(edges):
            x, z = polygons.x[k, v] - px, polygons.z[k, v] - pz
            r = math.sqrt(x * x + z * z)
            if e <= -r:
                continue
            half = math.acos(e / r) - turn if e < r else -1.0
            if half <= 0.0:
                mask[:] = 0
                break
            if half < math.pi:
                _keep_arc(math.atan2(z, x) - body.normal[b, j], half, row, mask)
        for w in range(words):
            free[w] |= mask[w]
    for w in range(words):
        out[w] |= ~free[w]


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def rectangle_distance(low: Array, high: Array, px: float, pz: float) -> float:
    """Squared distance of a point to a rectangle."""
    dx = max(low[0] - px, 0.0, px - high[0])
    dz = max(low[1] - pz, 0.0, pz - high[1])
    return dx * dx + dz * dz
