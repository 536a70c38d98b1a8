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
from backend.cspace.rows_angles import ERROR, arc_cosine, bearing
from backend.spatial.types import AnyArray, Array, IntArray

ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
SLACK = 1e-12  # [m] more than rounding moves a line


class Polygons(NamedTuple):
    """Convex polygons in the arm's plane. body slab and obstacle: (k,); sides: (k,) corners;
    x, z: (k, v) [m]; normal_x, normal_z, offset: (k, v) edges n . x <= offset; bearing: (k, v)
    of n [rad]; low, high: (k, 2)
    bounding rectangles.
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


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _arc(center: float, half: float, row: Row, keep: bool, exact: bool, mask: AnyArray) -> bool:
    """The cells of the row within `half` of `center` [rad], on the circle: with `keep` clear all
    others in mask, else set these. False when an end is too near to a cell to tell on which side.
    """
    inverse = 1.0 / row.step
    period = abs(2.0 * math.pi * inverse)
    middle = 0.5 * (row.n - 1)
    c = (center - row.start) * inverse
    c -= period * math.floor((c - middle) / period + 0.5)
    h = half * abs(inverse)
    low, high = c - h, c + h
    c += -period if c > middle else period
    again_low, again_high = c - h, c + h
    if not exact:
        close = ERROR * abs(inverse)
        for end in (low, high, again_low, again_high):
            if abs(end - math.floor(end + 0.5)) < close and -1.0 < end < row.n:
                return False
    first, last = math.floor(low) + 1, math.ceil(high) - 1
    again_first, again_last = math.floor(again_low) + 1, math.ceil(again_high) - 1
    for w in range(len(mask)):
        word = _range_word(first, last, w) | _range_word(again_first, again_last, w)
        if keep:
            mask[w] &= word
        else:
            mask[w] |= word
    return True


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
    full: AnyArray,
    work: Array,
    words: AnyArray,
    out: AnyArray,
) -> None:
    """Set the bits of `out` where body b with its pivot at (px, pz) is not apart from polygon k.

    full: the words of a row with all its cells set. Scratch: work (3, corners of the largest
    polygon); words (2 or more, words of out).
    """
    edges = polygons.sides[k]
    inside = body.depth[b] <= 0.0
    for i in range(edges):
        c = polygons.offset[k, i] - polygons.normal_x[k, i] * px - polygons.normal_z[k, i] * pz
        c += margin
        if c < -body.reach[b]:
            return
        work[0, i] = c
        inside = inside and c >= 0.0
    if inside:  # the pivot lies in both
        out[:] = ALL
        return
    free, mask = words[0], words[1]
    if not _free(body, b, polygons, k, px, pz, row, margin, turn, False, full, work, free, mask):
        _free(body, b, polygons, k, px, pz, row, margin, turn, True, full, work, free, mask)
    for w in range(len(out)):
        out[w] |= ~free[w]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _free(
    body: Profiles,
    b: int,
    polygons: Polygons,
    k: int,
    px: float,
    pz: float,
    row: Row,
    margin: float,
    turn: float,
    exact: bool,
    full: AnyArray,
    work: Array,
    free: AnyArray,
    mask: AnyArray,
) -> bool:
    """Set free to the cells in which some edge separates; False when `exact` is needed to tell.

    work[0]: offsets of the polygon's edges as seen from the pivot.
    """
    corners, edges = body.sides[b], polygons.sides[k]
    free[:] = 0
    for i in range(edges):
        c = work[0, i]
        if c >= body.depth[b] + SLACK:
            continue
        normal = polygons.bearing[k, i]
        mask[:] = ALL
        for v in range(corners):
            r = body.radius[b, v]
            if c <= -r:
                continue
            half = arc_cosine(c / r, exact) - turn if c < r else -1.0
            if half <= 0.0:
                mask[:] = 0
                break
            if half < math.pi and not _arc(
                normal - body.bearing[b, v], half, row, True, exact, mask
            ):
                return False
        done = True
        for w in range(len(free)):
            free[w] |= mask[w]
            done = done and free[w] & full[w] == full[w]
        if done:
            return True
    nearest = math.inf
    for v in range(edges):
        x, z = polygons.x[k, v] - px, polygons.z[k, v] - pz
        work[1, v] = math.sqrt(x * x + z * z)
        nearest = min(nearest, work[1, v])
    least = math.inf
    for j in range(corners):
        least = min(least, body.offset[b, j] + margin)
    if least >= nearest:
        return True
    for v in range(edges):
        work[2, v] = bearing(polygons.x[k, v] - px, polygons.z[k, v] - pz, exact)
    for j in range(corners):
        e = body.offset[b, j] + margin
        if e >= nearest:
            continue
        if e >= 0.0 and turn >= 0.0:
            # Arcs of at most half a turn each meet in one arc, near the first one's middle.
            low, high = -math.inf, math.inf
            for v in range(edges):
                half = arc_cosine(e / work[1, v], exact) - turn
                offset = work[2, v] - work[2, 0]
                offset -= 2.0 * math.pi * math.floor(offset / (2.0 * math.pi) + 0.5)
                low, high = max(low, offset - half), min(high, offset + half)
                if low >= high:
                    break
            if low < high:
                center = work[2, 0] + 0.5 * (low + high) - body.normal[b, j]
                if not _arc(center, 0.5 * (high - low), row, False, exact, free):
                    return False
            continue
        mask[:] = ALL
        for v in range(edges):
            r = work[1, v]
            if e <= -r:
                continue
            half = arc_cosine(e / r, exact) - turn if e < r else -1.0
            if half <= 0.0:
                mask[:] = 0
                break
            if half < math.pi and not _arc(
                work[2, v] - body.normal[b, j], half, row, True, exact, mask
            ):
                return False
        for w in range(len(free)):
            free[w] |= mask[w]
    return True


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def rectangle_distance(low: Array, high: Array, px: float, pz: float) -> float:
    """Squared distance of a point to a rectangle."""
    dx = max(low[0] - px, 0.0, px - high[0])
    dz = max(low[1] - pz, 0.0, pz - high[1])
    return float(dx * dx + dz * dz)
