"""Many rows of an image at once: one body against one polygon, for a batch of pivots.

The same arcs as in `rows`, one step at a time for all rows. Edges and corners that matter to no row
of the batch are left out; and what lies beyond an edge of the body is one arc between two tangents
of the polygon, which needs no angle for each corner. Angles are polynomials in single precision:
where an arc ends too near to a cell to tell on which side, the row is in doubt and `rows` decides.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.exact_levels import EXACT, Level
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows import ALL, SLACK, Polygons
from backend.cspace.rows_angles import ERROR, HALF_TURN
from backend.cspace.rows_vector import (
    AWAY,
    BASE,
    BLOCKED,
    CORNERS,
    DOUBT,
    END,
    LEVER_X,
    LEVER_Z,
    LINE,
    MARGIN,
    MASK,
    NEAREST,
    ORIGIN,
    SIZE,
    START,
    UX,
    VX,
    WORD,
    X,
    Z,
    arcs,
    bearings,
    before_edge,
    before_line,
    between,
    both,
    clear_bits,
    corner_directions,
    corner_distances,
    corner_places,
    extremes,
    fill,
    from_limit,
    from_middle,
    lines,
    lines_within,
    narrow,
    nearer,
    nearest,
    remaining,
    set_bits,
    towards,
)
from backend.spatial.types import AnyArray, Array, IntArray

_LANES = 16
ROUNDING = 5.0 * 2.0**-24
"""Places on the circle are rounded by less than this share of it."""


class Batch(NamedTuple):
    """Rows of one body and one polygon, and room to work, see rows_vector: doubles d, singles s and
    words w. place: (SIZE,) which rows of the image they are; shape: (10, v) of the body its
    corners' radius and bearing, its edges' offset and normal, see Profiles; then of the polygon x,
    z, normal_x, normal_z, offset, bearing, see Polygons. polar: (2, v), some, found, order:
    as many as rows or runs, and room: (3, words) to work.
    """

    d: Array
    s: AnyArray
    w: AnyArray
    place: IntArray
    shape: Array
    polar: Array
    some: AnyArray
    found: IntArray
    order: IntArray
    room: AnyArray


class Sizes(NamedTuple):
    """Of a body its corners, depth and reach, see Profiles; of a polygon its corners; words of a
    row.
    """

    sides: int
    depth: float
    reach: float
    edges: int
    words: int


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def new_batch(words: int, corners: int, runs: int) -> Batch:
    """An empty batch for rows of `words` in `runs`, bodies and polygons of up to `corners`."""
    return Batch(
        np.zeros(AWAY + corners * SIZE), np.empty(CORNERS + 2 * corners * SIZE, np.float32),
        np.empty(words * WORD, np.uint64), np.empty(SIZE, np.int64), np.empty((10, corners)),
        np.empty((2, corners)), np.empty(max(runs, SIZE), np.uint8), np.empty(runs, np.int64),
        np.empty(SIZE, np.int64), np.empty((3, words), np.uint64),
    )  # fmt: skip


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def set_body(batch: Batch, body: Profiles, b: int) -> None:
    """Rows are of body b from now on."""
    shape = batch.shape
    for v in range(body.sides[b]):
        shape[0, v], shape[1, v] = body.radius[b, v], body.bearing[b, v]
        shape[2, v], shape[3, v] = body.offset[b, v], body.normal[b, v]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def set_polygon(batch: Batch, polygons: Polygons, k: int) -> None:
    """And against polygon k."""
    shape = batch.shape
    for v in range(polygons.sides[k]):
        shape[4, v], shape[5, v] = polygons.x[k, v], polygons.z[k, v]
        shape[6, v], shape[7, v] = polygons.normal_x[k, v], polygons.normal_z[k, v]
        shape[8, v], shape[9, v] = polygons.offset[k, v], polygons.bearing[k, v]


class Cells(NamedTuple):
    """Rows as places on a circle, in cells.

    scale: cells for an angle, below 0 where the rows run the other way; size: of that; period: of
    the circle; low, high: first and last cell, the one in the middle being 0; turn, step: see Level
    [rad]; again: whether half a turn may come in at both ends of a row; close: an end of an arc
    that is nearer to a cell may be on its other side; moves: kind, boom_x, boom_z, boom, stick and
    bend of the level.
    """

    scale: float
    size: float
    period: float
    low: float
    high: float
    turn: float
    step: float
    again: bool
    close: float
    moves: tuple[int, float, float, float, float, float]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def cells_of(level: Level) -> Cells:
    """The rows of a level."""
    scale = 1.0 / level.step
    size, middle = abs(scale), float(level.cells // 2)
    period = 2.0 * math.pi * size
    widest = (0.5 * math.pi + abs(level.turn) + 10.0 * ERROR) * size
    return Cells(
        scale, size, period, -middle, level.cells - 1.0 - middle, level.turn, level.step,
        widest + middle > 0.5 * period - 0.1, ERROR * size + ROUNDING * period,
        (level.kind, level.boom_x, level.boom_z, level.boom, level.stick, level.bend),
    )  # fmt: skip


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def touched_rows(
    sizes: Sizes, cells: Cells, batch: Batch, count: int, full: AnyArray, known: AnyArray
) -> int:
    """Set BLOCKED to the cells where the body is not apart from the polygon, and DOUBT to below 0
    where that is not sure. Rows with none but `known` ones are dropped from the first `count`; how
    many are left. full: (words,) the cells that count; known: (m, words) blocked anyway.
    """
    d, s, w = batch.d, batch.s, batch.w
    words = sizes.words
    n = _fill(d, count)
    for word in range(words):
        fill(w, word * WORD + BLOCKED, n, ALL)
    fill(s, DOUBT, n, np.float32(math.inf))
    fill(d, NEAREST, n, math.inf)
    front = _beyond_polygon(sizes, cells, d, s, w, batch.shape, n)
    count = _kept(
        d, s, w, batch.place, count, full, known, cells.close, cells.moves[0] != EXACT,
        batch.order, batch.some,
    )  # fmt: skip
    if count == 0:
        return 0
    _beyond_body(sizes, cells, d, s, w, batch.shape, _fill(d, count), front)
    inside, reach, close = sizes.depth <= 0.0, sizes.reach, np.float32(cells.close)
    for r in range(count):
        nearest = d[NEAREST + r]
        within = inside and nearest >= 0.0  # the pivot lies in both
        if within or nearest < -reach:
            s[DOUBT + r] = np.float32(math.inf)
            for word in range(words):
                w[word * WORD + BLOCKED + r] = ALL if within else np.uint64(0)
        s[DOUBT + r] -= close
    return count


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _kept(
    d: Array, s: AnyArray, w: AnyArray, place: IntArray, count: int, full: AnyArray,
    known: AnyArray, close: float, moves: bool, order: IntArray, some: AnyArray,
) -> int:  # fmt: skip
    """Move the rows in which more than `known` may be blocked to the front; how many. moves: their
    pivots do. order, some: (SIZE,) room to work.
    """
    words, kept = len(full), 0
    for r in range(count):
        some[r] = s[DOUBT + r] < close
    for word in range(words):
        bits = full[word]
        for r in range(count):
            some[r] |= w[word * WORD + BLOCKED + r] & bits & ~known[place[r], word] != 0
    for r in range(count):
        order[kept] = r  # what is not kept is written over by the next
        kept += some[r]
    if kept == count:
        return kept
    for value in (X, Z, ORIGIN, NEAREST):
        _move(d, value, order, kept)
    if moves:
        for value in (MARGIN, LEVER_X, LEVER_Z):
            _move(d, value, order, kept)
    for word in range(words):
        _move(w, word * WORD + BLOCKED, order, kept)
    _move(s, DOUBT, order, kept)
    _move(place, 0, order, kept)
    return kept


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _move(values: AnyArray, begin: int, order: IntArray, n: int) -> None:
    if begin < 0 or n > SIZE:
        return
    for r in range(n):
        values[begin + r] = values[begin + order[r]]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _fill(d: Array, count: int) -> int:
    """Repeat the first row up to whole vectors, so that none is left to scalar code; how many."""
    n = (count + _LANES - 1) // _LANES * _LANES
    for r in range(count, n):
        for value in (X, Z, ORIGIN, MARGIN, LEVER_X, LEVER_Z):
            d[value + r] = d[value]
    return n


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _on_circle(angle: float, cells: Cells) -> float:
    """An angle in cells, by less than half a turn."""
    turn = 2.0 * math.pi
    return (angle - turn * math.floor(angle / turn + 0.5)) * cells.scale


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _mark(
    s: AnyArray, w: AnyArray, n: int, base: int, away: float, cells: Cells, words: int,
    again: bool,
) -> None:  # fmt: skip
    """Set the cells of MASK in the arcs of LEFT and RATIO, about the places at `base`, + away."""
    for other in range(2 if again else 1):
        arcs(
            s, n, base, away, cells.turn, cells.size, cells.period, cells.low,
            cells.high, other == 1,
        )  # fmt: skip
        set_bits(s, w, n, words, cells.low)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _beyond_polygon(
    sizes: Sizes, cells: Cells, d: Array, s: AnyArray, w: AnyArray, shape: Array, n: int
) -> int:
    """Clear BLOCKED where an edge of the polygon separates, and lower NEAREST to the distances of
    the edges' lines. Bits of the edges that some pivot is in front of.
    """
    depth, words, sides = sizes.depth + SLACK, sizes.words, sizes.sides
    kind, boom_x, boom_z, boom, stick, bend = cells.moves
    before = SLACK if kind == EXACT else max(extremes(d, MARGIN, n)[1], 0.0) + SLACK
    fill(s, START, n, np.float32(0.0))
    from_middle(d, s, n, cells.scale, cells.period, -cells.low)
    front = 0
    for i in range(sizes.edges):
        nx, nz = shape[6, i], shape[7, i]
        lines(d, n, nx, nz, shape[8, i])
        if kind != EXACT:
            lines_within(d, n, nx, nz, boom_x, boom_z, boom, stick, bend, kind)
        lowest, highest = nearer(d, n, depth)
        if lowest < before:
            front |= 1 << i
        if lowest >= depth:
            continue
        from_limit(d, w, n, words, depth)
        for v in range(sides):
            radius = shape[0, v]
            if highest <= -radius:
                continue
            before_line(d, s, n, radius, depth)
            away = _on_circle(shape[9, i] - shape[1, v] + math.pi, cells)
            _mark(s, w, n, BASE, away, cells, words, cells.again or highest >= 0.0)
        both(w, n, words)
    return front


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _beyond_body(
    sizes: Sizes,
    cells: Cells,
    d: Array,
    s: AnyArray,
    w: AnyArray,
    shape: Array,
    n: int,
    front: int,
) -> None:
    """Clear BLOCKED where an edge of the body separates. front: edges of the polygon that some
    pivot is in front of; only their corners bound what a line beyond the pivot separates.
    """
    edges, sides, words = sizes.edges, sizes.sides, sizes.words
    mx = mz = 0.0
    for v in range(edges):
        mx, mz = mx + shape[4, v] / edges, mz + shape[5, v] / edges
    towards(d, s, n, mx, mz, UX)
    bearings(s, n)
    from_middle(d, s, n, cells.scale, cells.period, -cells.low)
    # Beyond an edge that passes behind the pivot, any corner of the polygon may be the last; and
    # seen from inside of the polygon, all of them show that no line separates.
    corners = front | front << 1 | front >> (edges - 1)
    smallest, largest = (0.0, 0.0) if cells.moves[0] == EXACT else extremes(d, MARGIN, n)
    behind = False
    for j in range(sides):
        behind = behind or shape[2, j] + smallest <= -SLACK
    if behind or extremes(d, NEAREST, n)[1] >= min(smallest, 0.0) - SLACK:
        corners = -1
    fill(d, LINE, n, math.inf)
    for v in range(edges):
        if not (corners >> v) & 1:
            continue
        # Directions are measured from the one to the middle of the polygon: seen from a pivot
        # outside of it, none is half a turn away.
        corner_distances(d, n, v, shape[4, v], shape[5, v])
        nearest(d, n, v)
        towards(d, s, n, shape[4, v], shape[5, v], VX)
        corner_directions(s, n, v)
    farthest = extremes(d, LINE, n)[1]
    for j in range(sides):
        offset = shape[2, j]
        if offset + smallest >= -SLACK:
            if farthest <= offset:
                continue  # in every row a corner is too near to be beyond this edge
            fill(s, START, n, -HALF_TURN)
            fill(s, END, n, HALF_TURN)
            for v in range(edges):
                if (corners >> v) & 1:
                    remaining(d, s, n, v, offset)
                    narrow(s, n, v)
            away = _on_circle(-shape[3, j], cells)
            for other in range(2 if cells.again else 1):
                between(
                    s, n, away, cells.turn, cells.scale, cells.period, cells.low,
                    cells.high, other == 1,
                )  # fmt: skip
                clear_bits(s, w, n, words, cells.low)
            continue
        for word in range(words):
            fill(w, word * WORD + MASK, n, np.uint64(0))
        opposite = _on_circle(math.pi - shape[3, j], cells)
        for v in range(edges):
            before_edge(d, s, n, v, offset)
            corner_places(s, n, v, cells.scale)
            _mark(s, w, n, VX, opposite, cells, words, cells.again or offset + largest > 0.0)
        both(w, n, words)
