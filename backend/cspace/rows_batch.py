"""Many rows of an image at once: one body against one polygon, for a batch of pivots.

The same arcs as in `rows`, one step at a time for all rows. Edges and corners that matter to no row
of the batch are left out; and what lies beyond an edge of the body is one arc between two tangents
of the polygon, which needs no angle for each corner. Angles are polynomials: where an arc ends too
near to a cell to tell on which side, the row is in doubt and `rows` decides.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.planar_arm import Profiles
from backend.cspace.rows import ALL, SLACK, Polygons
from backend.cspace.rows_angles import ERROR
from backend.cspace.rows_vector import (
    STEEP,
    arcs_between,
    arcs_beyond_line,
    arcs_of_corner,
    bearings,
    clear,
    crossed,
    greatest_below,
    keep,
    least,
    lower,
    normalise,
    offsets,
    projected,
    squares,
    tangents,
    under,
)
from backend.spatial.types import AnyArray, Array, IntArray

SIZE = 128
"""Rows of a batch: what they need stays in the cache."""
_LANES = 16


class Batch(NamedTuple):
    """Rows of one body and one polygon, and room to work.

    x, z: (m,) pivots [m]; origin: (m,) angles of the first cells [rad]; margin: (m,) how far the
    pivots can be from there [m]; index: (m,) which rows of the image they are; blocked, mask:
    (words, m); doubt: (m,) distance of an arc's end from a cell, in cells; work: (8, m); corners:
    (4, v, m).
    """

    x: Array
    z: Array
    origin: Array
    margin: Array
    index: IntArray
    blocked: AnyArray
    mask: AnyArray
    doubt: Array
    work: Array
    corners: Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def new_batch(words: int, corners: int) -> Batch:
    """An empty batch for rows of `words` and polygons of up to `corners`."""
    return Batch(
        np.empty(SIZE), np.empty(SIZE), np.empty(SIZE), np.empty(SIZE),
        np.empty(SIZE, np.int64), np.empty((words, SIZE), np.uint64),
        np.empty((words, SIZE), np.uint64), np.empty(SIZE), np.empty((8, SIZE)),
        np.empty((4, max(corners, 2), SIZE)),
    )  # fmt: skip


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def touched_rows(
    body: Profiles, b: int, polygons: Polygons, k: int, step: float, cells: int, turn: float,
    batch: Batch, count: int,
) -> None:
    """Set batch.blocked of the first `count` rows to the cells where body b is not apart from
    polygon k, and batch.doubt to below 0 where that is not sure. Bits beyond `cells` mean nothing.
    """  # fmt: skip
    # Vectors are whole: no row is left to scalar code.
    n = (count + _LANES - 1) // _LANES * _LANES
    for values in (batch.x, batch.z, batch.origin, batch.margin):
        values[count:n] = values[0]
    batch.blocked[:, :n] = ALL
    batch.doubt[:n] = math.inf
    batch.work[0, :n] = math.inf
    front = _beyond_polygon(body, b, polygons, k, step, cells, turn, batch, n)
    _beyond_body(body, b, polygons, k, step, cells, turn, batch, n, front)
    nearest, inside = batch.work[0], body.depth[b] <= 0.0
    close = ERROR / abs(step)
    for r in range(count):
        within = inside and nearest[r] >= 0.0  # the pivot lies in both
        if within or nearest[r] < -body.reach[b]:
            batch.doubt[r] = math.inf
            batch.blocked[:, r] = ALL if within else np.uint64(0)
        batch.doubt[r] -= close


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _beyond_polygon(
    body: Profiles, b: int, polygons: Polygons, k: int, step: float, cells: int, turn: float,
    batch: Batch, n: int,
) -> int:
    """Clear `blocked` where an edge of the polygon separates, and lower work[0] to the distances of
    the edges' lines. Bits of the edges that some pivot is in front of.
    """  # fmt: skip
    depth = body.depth[b] + SLACK
    nearest, c, half, center = (
        batch.work[0, :n], batch.work[1, :n], batch.work[2, :n], batch.work[3, :n]
    )  # fmt: skip
    mask, doubt, margin = batch.mask, batch.doubt[:n], batch.margin[:n]
    widest = max(margin.max(), 0.0) + SLACK
    center[:] = -batch.origin[:n]
    front = 0
    for i in range(polygons.sides[k]):
        offsets(
            batch.x[:n], batch.z[:n], margin, polygons.normal_x[k, i], polygons.normal_z[k, i],
            polygons.offset[k, i], c,
        )  # fmt: skip
        lower(nearest, c)
        lowest = least(c)
        if lowest < widest:
            front |= 1 << i
        if lowest >= depth:
            continue
        highest = greatest_below(c, depth)
        under(c, depth, mask)
        for v in range(body.sides[b]):
            radius = body.radius[b, v]
            if highest <= -radius:
                continue
            arcs_beyond_line(c, radius, turn, half)
            away = polygons.bearing[k, i] - body.bearing[b, v]
            keep(center, away, half, step, cells, mask, doubt)
        clear(batch.blocked, mask, n)
    return front


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _beyond_body(
    body: Profiles, b: int, polygons: Polygons, k: int, step: float, cells: int, turn: float,
    batch: Batch, n: int, front: int,
) -> None:
    """Clear `blocked` where an edge of the body separates. front: edges of the polygon that some
    pivot is in front of; only their corners bound what a line beyond the pivot separates.
    """  # fmt: skip
    edges = polygons.sides[k]
    x, z, mask, doubt = batch.x[:n], batch.z[:n], batch.mask, batch.doubt[:n]
    e, half, center = batch.work[1, :n], batch.work[2, :n], batch.work[3, :n]
    ux, uz, middle = batch.work[4, :n], batch.work[5, :n], batch.work[6, :n]
    nearest = batch.work[7, :n]
    # Directions are measured from the one to the middle of the polygon, along u.
    ux[:] = polygons.x[k, :edges].mean() - x
    uz[:] = polygons.z[k, :edges].mean() - z
    bearings(ux, uz, batch.origin[:n], middle)
    normalise(ux, uz)
    nearest[:] = math.inf
    for v in range(edges):
        squares(x, z, polygons.x[k, v], polygons.z[k, v], batch.corners[2, v, :n])
        lower(nearest, batch.corners[2, v, :n])
    farthest = math.sqrt(nearest.max())
    straight = False
    seen = False
    for j in range(body.sides[b]):
        e[:] = body.offset[b, j] + batch.margin[:n]
        if abs(least(e)) < SLACK:
            e[:] = np.maximum(e, 0.0)
        lowest = least(e)
        if lowest >= farthest:
            continue
        mask[:] = ALL
        away = -body.normal[b, j]
        if not straight:
            straight = True
            for v in range(edges):
                px, pz = polygons.x[k, v], polygons.z[k, v]
                projected(x, z, px, pz, ux, uz, batch.corners[0, v, :n])
                crossed(x, z, px, pz, ux, uz, batch.corners[1, v, :n])
        if lowest >= 0.0:
            low, high = batch.corners[3, 0, :n], batch.corners[3, 1, :n]
            low[:], high[:] = -STEEP, STEEP
            for v in range(edges):
                before = v - 1 if v > 0 else edges - 1
                if ((front >> v) | (front >> before)) & 1:
                    tangents(
                        batch.corners[0, v, :n], batch.corners[1, v, :n],
                        batch.corners[2, v, :n], e, low, high,
                    )  # fmt: skip
            arcs_between(low, high, turn, center, half)
            center += middle
            keep(center, away, half, step, cells, mask, doubt)
        else:
            for v in range(edges):
                arcs_of_corner(e, batch.corners[2, v, :n], turn, half)
                px, pz = polygons.x[k, v], polygons.z[k, v]
                center[:], batch.work[7, :n] = px - x, pz - z
                bearings(center, batch.work[7, :n], batch.origin[:n], center)
                keep(center, away, half, step, cells, mask, doubt)
        clear(batch.blocked, mask, n)
