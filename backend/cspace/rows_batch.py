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

from backend.cspace.exact_levels import EXACT, Level
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows import ALL, SLACK, Polygons
from backend.cspace.rows_angles import ERROR
from backend.cspace.rows_vector import (
    along,
    arcs_before_line,
    arcs_between,
    arcs_of_corner,
    aside,
    bearings,
    both,
    from_limit,
    greatest,
    greatest_below,
    higher,
    inverses,
    least,
    lower,
    mark,
    narrow,
    offsets,
    offsets_within,
    without,
)
from backend.spatial.types import AnyArray, Array, IntArray

SIZE = 128
"""Rows of a batch: what they need stays in the cache."""
_LANES = 16


class Batch(NamedTuple):
    """Rows of one body and one polygon, and room to work.

    x, z: (m,) pivots [m]; origin: (m,) angles of the first cells [rad]; margin: (m,) how far the
    pivots can be from there [m]; lever_x, lever_z: (m,) see Level; place: (m,) which rows of the
    image they are; blocked, mask: (words, m); doubt: (m,) distance of an arc's end from a cell, in
    cells; work: (9, m); corners: (2, v, m) one over their distances, directions.
    """

    x: Array
    z: Array
    origin: Array
    margin: Array
    lever_x: Array
    lever_z: Array
    place: IntArray
    blocked: AnyArray
    mask: AnyArray
    doubt: Array
    work: Array
    corners: Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def new_batch(words: int, corners: int) -> Batch:
    """An empty batch for rows of `words` and polygons of up to `corners`."""
    return Batch(
        np.empty(SIZE), np.empty(SIZE), np.empty(SIZE), np.empty(SIZE), np.zeros(SIZE),
        np.zeros(SIZE), np.empty(SIZE, np.int64), np.empty((words, SIZE), np.uint64),
        np.empty((words, SIZE), np.uint64), np.empty(SIZE), np.empty((9, SIZE)),
        np.empty((2, corners, SIZE)),
    )  # fmt: skip


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def touched_rows(
    body: Profiles,
    b: int,
    polygons: Polygons,
    k: int,
    level: Level,
    batch: Batch,
    count: int,
    full: AnyArray,
) -> int:
    """Set batch.blocked to the cells where body b is not apart from polygon k, and batch.doubt to
    below 0 where that is not sure. Rows with none are dropped from the first `count`; how many are
    left. full: (words,) the cells that count.
    """
    close = ERROR / abs(level.step)
    n = _fill(batch, count)
    batch.blocked[:, :n] = ALL
    batch.doubt[:n] = math.inf
    batch.work[0, :n] = math.inf
    front = _beyond_polygon(body, b, polygons, k, level, batch, n)
    count = _kept(batch, count, full, close)
    if count == 0:
        return 0
    _beyond_body(body, b, polygons, k, level, batch, _fill(batch, count), front)
    nearest, inside = batch.work[0], body.depth[b] <= 0.0
    for r in range(count):
        within = inside and nearest[r] >= 0.0  # the pivot lies in both
        if within or nearest[r] < -body.reach[b]:
            batch.doubt[r] = math.inf
            batch.blocked[:, r] = ALL if within else np.uint64(0)
        batch.doubt[r] -= close
    return count


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _kept(batch: Batch, count: int, full: AnyArray, close: float) -> int:
    """Move the rows in which something may still be blocked to the front; how many."""
    kept = 0
    for r in range(count):
        some = batch.doubt[r] < close
        for w in range(len(full)):
            some = some or batch.blocked[w, r] & full[w] != 0
        if not some:
            continue
        batch.x[kept], batch.z[kept], batch.place[kept] = batch.x[r], batch.z[r], batch.place[r]
        batch.origin[kept], batch.margin[kept] = batch.origin[r], batch.margin[r]
        batch.lever_x[kept], batch.lever_z[kept] = batch.lever_x[r], batch.lever_z[r]
        batch.doubt[kept], batch.work[0, kept] = batch.doubt[r], batch.work[0, r]
        for w in range(len(full)):
            batch.blocked[w, kept] = batch.blocked[w, r]
        kept += 1
    return kept


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill(batch: Batch, count: int) -> int:
    """Repeat the first row up to whole vectors, so that none is left to scalar code; how many."""
    n = (count + _LANES - 1) // _LANES * _LANES
    for r in range(count, n):
        batch.x[r], batch.z[r] = batch.x[0], batch.z[0]
        batch.origin[r], batch.margin[r] = batch.origin[0], batch.margin[0]
        batch.lever_x[r], batch.lever_z[r] = batch.lever_x[0], batch.lever_z[0]
    return n


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _widest(turn: float) -> float:
    """More than half of the arcs in which a line beyond the pivot is crossed or not."""
    return 0.5 * math.pi + abs(turn) + 1e-9


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _beyond_polygon(
    body: Profiles,
    b: int,
    polygons: Polygons,
    k: int,
    level: Level,
    batch: Batch,
    n: int,
) -> int:
    """Clear `blocked` where an edge of the polygon separates, and lower work[0] to the distances of
    the edges' lines. Bits of the edges that some pivot is in front of.
    """
    depth, turn, step, cells = body.depth[b] + SLACK, level.turn, level.step, level.cells
    nearest, c, half, center = (
        batch.work[0, :n], batch.work[1, :n], batch.work[2, :n], batch.work[3, :n]
    )  # fmt: skip
    mask, doubt, margin = batch.mask, batch.doubt[:n], batch.margin[:n]
    before = max(margin.max(), 0.0) + SLACK
    center[:] = -batch.origin[:n]
    front = 0
    for i in range(polygons.sides[k]):
        nx, nz = polygons.normal_x[k, i], polygons.normal_z[k, i]
        offsets(batch.x[:n], batch.z[:n], nx, nz, polygons.offset[k, i], c)
        if level.kind != EXACT:
            offsets_within(
                batch.x[:n], batch.z[:n], margin, batch.lever_x[:n], batch.lever_z[:n], nx, nz,
                level.boom_x, level.boom_z, level.boom, level.stick, level.bend, level.kind, c,
            )  # fmt: skip
        lower(nearest, c)
        lowest = least(c)
        if lowest < before:
            front |= 1 << i
        if lowest >= depth:
            continue
        highest = greatest_below(c, depth)
        from_limit(c, depth, mask)
        widest = _widest(turn) if highest < 0.0 else math.inf
        for v in range(body.sides[b]):
            radius = body.radius[b, v]
            if highest <= -radius:
                continue
            arcs_before_line(c, radius, turn, half)
            away = polygons.bearing[k, i] - body.bearing[b, v] + math.pi
            mark(center, away, half, widest, step, cells, mask, doubt)
        both(batch.blocked, mask, n)
    return front


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _beyond_body(
    body: Profiles,
    b: int,
    polygons: Polygons,
    k: int,
    level: Level,
    batch: Batch,
    n: int,
    front: int,
) -> None:
    """Clear `blocked` where an edge of the body separates. front: edges of the polygon that some
    pivot is in front of; only their corners bound what a line beyond the pivot separates.
    """
    edges, turn, step, cells = polygons.sides[k], level.turn, level.step, level.cells
    x, z, mask, doubt = batch.x[:n], batch.z[:n], batch.mask, batch.doubt[:n]
    e, half, center = batch.work[1, :n], batch.work[2, :n], batch.work[3, :n]
    ux, uz, middle, low, high = (
        batch.work[4, :n], batch.work[5, :n], batch.work[6, :n], batch.work[7, :n],
        batch.work[8, :n],
    )  # fmt: skip
    ux[:] = polygons.x[k, :edges].mean() - x
    uz[:] = polygons.z[k, :edges].mean() - z
    bearings(ux, uz, 0.0, middle)
    middle -= batch.origin[:n]
    low[:] = 0.0
    # Beyond an edge that passes behind the pivot, any corner of the polygon may be the last; and
    # seen from inside of the polygon, all of them show that no line separates.
    corners = front | front << 1 | front >> (edges - 1)
    smallest = min(least(batch.margin[:n]), 0.0)
    behind = body.offset[b, : body.sides[b]].min() + least(batch.margin[:n]) <= -SLACK
    if behind or greatest(batch.work[0, :n]) >= smallest - SLACK:
        corners = -1
    for v in range(edges):
        if not (corners >> v) & 1:
            continue
        inverse, at = batch.corners[0, v, :n], batch.corners[1, v, :n]
        px, pz = polygons.x[k, v], polygons.z[k, v]
        inverses(x, z, px, pz, inverse)
        higher(low, inverse)
        # Directions are measured from the one to the middle of the polygon: seen from a pivot
        # outside of it, none is half a turn away.
        along(x, z, px, pz, ux, uz, half)
        aside(x, z, px, pz, ux, uz, center)
        bearings(half, center, 0.0, at)
    farthest = 1.0 / least(low)
    for j in range(body.sides[b]):
        e[:] = body.offset[b, j] + batch.margin[:n]
        if abs(least(e)) < SLACK:
            e[:] = np.maximum(e, 0.0)
        lowest = least(e)
        if lowest >= farthest:
            continue
        mask[:] = 0
        away = -body.normal[b, j]
        if lowest >= 0.0:
            low[:], high[:] = -math.pi, math.pi
            for v in range(edges):
                if (corners >> v) & 1:
                    narrow(e, batch.corners[0, v, :n], batch.corners[1, v, :n], low, high)
            arcs_between(low, high, turn, center, half)
            center += middle
            mark(center, away, half, _widest(turn), step, cells, mask, doubt)
            without(batch.blocked, mask, n)
        else:
            widest = _widest(turn) if greatest(e) <= 0.0 else math.inf
            for v in range(edges):
                arcs_of_corner(e, batch.corners[0, v, :n], turn, half)
                center[:] = middle + batch.corners[1, v, :n]
                mark(center, away + math.pi, half, widest, step, cells, mask, doubt)
            both(batch.blocked, mask, n)
