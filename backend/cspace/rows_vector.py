"""The loops of `rows_batch`: one step each for all rows of a batch.

Each is so small, and works on so few arrays, that it compiles to vector instructions: a compiler
gives that up where it cannot tell that many arrays do not overlap, and counting who uses slices of
an array takes longer than what is done with them. So all a batch needs lies in three arrays, and a
row in each at a place known beforehand. Single precision, which does twice as many at once, for
everything but where rounding would spoil the ends of arcs.

Rows' kernels make no arrays and keep none: without numba's runtime (_nrt) they do not count who
uses those that they are given. What they call is compiled without it, too, unless it says that it
needs it.

The checks that loops begin with never fail: n is at most SIZE, and polygons have far fewer corners.
They tell the compiler that no index is below 0, which it would test for every value.

Below, a list of n values that begins at NAME is called by that name; cells are places in the rows,
on the circle, 0 the one in the middle, where single precision is best.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from backend.cspace.least import greatest, least
from backend.cspace.rows import ALL
from backend.cspace.rows_angles import ERROR, HALF_TURN, ZERO, arc_cosine, bearing
from backend.spatial.types import AnyArray, Array

SIZE = 256
"""Rows of a batch: what they need stays in the cache."""

X, Z, ORIGIN, MARGIN, LEVER_X, LEVER_Z, NEAREST, LINE, AWAY = range(0, 9 * SIZE, SIZE)
"""Of the doubles: pivots [m], angles of the first cells [rad], how far the pivots can be from there
[m], see Level; least distance of the polygon's lines so far, and of one of them; distances of the
polygon's corners, one list after the other [m].
"""
BASE, LEFT, RATIO, FIRST, LAST, DOUBT, UX, UZ, VX, VZ, START, END, CORNERS = range(
    0, 13 * SIZE, SIZE
)
"""Of the singles: where arcs are counted from, cells; what the cosine of half an arc leaves of 1,
and the cosine; first and last cell of arcs; how near an end of an arc came to a cell, cells;
vectors to the polygon's middle and to a corner; directions between which a corner lies beyond an
edge; and of each corner one over its distance [1/m], then its direction from that to the middle.
"""
BLOCKED, MASK, WORD = 0, SIZE, 2 * SIZE
"""Of the words: cells that are blocked, those of one step; and from each word to the next."""

_ALL_AROUND = np.float32(4.0)  # [rad] half of an arc that holds everything
_NO_ARC = np.float32(-1.0)
_WHOLE_TURN = np.float32(math.pi + ERROR)  # [rad] half of an arc that surely does
_NEARLY = np.float32(-2.0 * ERROR)  # [rad] what is shorter than this is surely no arc
_ONE, _HALF, _LAST, _LEAST = (np.float32(v) for v in (1.0, 0.5, 63.0, 1e-30))
_BEYOND = 0.6  # of a cell, beyond the ends of a row
_DROP, _DROP_SINGLE = 1.5 * 2.0**52, np.float32(1.5 * 2.0**23)
_FAR = 1 << 20  # no list begins farther from the array's beginning

FUSED = {"contract"}
"""Products and sums in one instruction, rounded once."""


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def fill(values: AnyArray, begin: int, n: int, value: Any) -> None:
    """Set n values of any array, from `begin`."""
    if n > SIZE or begin < 0 or begin > _FAR:
        return
    for r in range(n):
        values[begin + r] = value


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def extremes(d: Array, begin: int, n: int) -> tuple[float, float]:
    """Smallest and greatest of n doubles from `begin`."""
    low = high = d[begin]
    if n <= SIZE and 0 <= begin < _FAR:
        for r in range(n):
            low, high = least(low, d[begin + r]), greatest(high, d[begin + r])
    return low, high


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def lines(d: Array, n: int, nx: float, nz: float, offset: float) -> None:
    """LINE: distances of the line n . x = offset from the pivots along its normal."""
    if n > SIZE:
        return
    for r in range(n):
        d[LINE + r] = offset - nx * d[X + r] - nz * d[Z + r]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def lines_within(
    d: Array, n: int, nx: float, nz: float, boom_x: float, boom_z: float, boom: float,
    stick: float, bend: float, sign: int,
) -> None:  # fmt: skip
    """Move LINE along n by how far the pivots can be from where they are, see Level: along n,
    R(d) v - v is at most |d (n x v)| + d^2 |v| / 2. sign: of the margins.
    """
    if n > SIZE:
        return
    for r in range(n):
        by_boom = boom * abs(nz * (d[X + r] - boom_x) - nx * (d[Z + r] - boom_z))
        by_stick = stick * abs(nz * d[LEVER_X + r] - nx * d[LEVER_Z + r])
        d[LINE + r] += sign * min(by_boom + by_stick + bend, sign * d[MARGIN + r])


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def nearer(d: Array, n: int, limit: float) -> tuple[float, float]:
    """Lower NEAREST to LINE. The smallest of LINE, and the greatest under the limit, -1e300 when
    there is none.
    """
    low, high = 1e300, -1e300
    if n <= SIZE:
        for r in range(n):
            line = d[LINE + r]
            d[NEAREST + r] = least(d[NEAREST + r], line)
            low, high = least(low, line), greatest(high, line if line < limit else -1e300)
    return low, high


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def from_limit(d: Array, w: AnyArray, n: int, words: int, limit: float) -> None:
    """MASK: all bits of the rows whose LINE is at or over the limit, none of the others."""
    if n > SIZE:
        return
    for k in range(words):
        for r in range(n):
            w[k * WORD + MASK + r] = ALL if d[LINE + r] >= limit else np.uint64(0)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def both(w: AnyArray, n: int, words: int) -> None:
    """BLOCKED = BLOCKED & MASK."""
    if n > SIZE:
        return
    for k in range(words):
        for r in range(n):
            w[k * WORD + BLOCKED + r] &= w[k * WORD + MASK + r]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def from_middle(d: Array, s: AnyArray, n: int, scale: float, period: float, middle: float) -> None:
    """BASE: the direction START, in cells. scale: cells for an angle; period: of the circle;
    middle: cells before the one in the middle.
    """
    if n > SIZE:
        return
    turns = 1.0 / period
    for r in range(n):
        c = scale * (np.float64(s[START + r]) - d[ORIGIN + r]) - middle
        s[BASE + r] = c - period * ((c * turns + _DROP) - _DROP)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def before_line(d: Array, s: AnyArray, n: int, radius: float, limit: float) -> None:
    """LEFT and RATIO of LINE and a corner at `radius`; at or over the limit, those of no arc."""
    if n > SIZE:
        return
    inverse = 1.0 / max(radius, 1e-300)
    for r in range(n):
        line = d[LINE + r]
        t = line * inverse if line < limit else -2.0
        s[LEFT + r], s[RATIO + r] = 1.0 - abs(t), t


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def before_edge(d: Array, s: AnyArray, n: int, v: int, offset: float) -> None:
    """LEFT and RATIO of the body's edge at `offset` and corner v of the polygon."""
    if n > SIZE or v < 0 or v > SIZE:
        return
    away, inverse = AWAY + v * SIZE, CORNERS + 2 * v * SIZE
    for r in range(n):
        e = d[MARGIN + r] + offset
        s[LEFT + r] = (d[away + r] - abs(e)) * s[inverse + r]
        s[RATIO + r] = e * s[inverse + r]


@njit(cache=True, nogil=True, _nrt=False, fastmath=FUSED)  # type: ignore[untyped-decorator]
def arcs(
    s: AnyArray, n: int, base: int, away: float, turn: float, scale: float, period: float,
    low_end: float, high_end: float, other: bool,
) -> None:  # fmt: skip
    """FIRST and LAST of the arcs of directions in which a corner is not beyond a line, by LEFT and
    RATIO; widened by turn, about the values from `base` + away, in cells. other: what comes in at
    the other end of the row. scale: cells for an angle, above 0; low_end, high_end: first
    and last cell of the row.
    """
    if n > SIZE or base < 0 or base > _FAR:
        return
    aside, more, size = np.float32(away), np.float32(turn), np.float32(scale)
    around, turns = np.float32(period), np.float32(1.0 / period)
    lowest, most = np.float32(low_end - _BEYOND), np.float32(high_end + _BEYOND)
    for r in range(n):
        c = s[base + r] + aside
        c -= around * ((c * turns + _DROP_SINGLE) - _DROP_SINGLE)
        if other:
            c += -around if c > ZERO else around
        left, ratio = s[LEFT + r], s[RATIO + r]
        h = arc_cosine(max(left, ZERO))
        h = (h if ratio <= ZERO else HALF_TURN - h) + more
        h = _ALL_AROUND if h >= _WHOLE_TURN else h
        # What is always or never beyond the line is known in double precision.
        h = (h if left > ZERO else (_ALL_AROUND if ratio > ZERO else _NO_ARC)) * size
        s[FIRST + r], s[LAST + r] = max(c - h, lowest), min(c + h, most)
    for r in range(n):  # on its own it keeps more in registers
        low, high = s[FIRST + r], s[LAST + r]
        at, to = (low + _DROP_SINGLE) - _DROP_SINGLE, (high + _DROP_SINGLE) - _DROP_SINGLE
        s[FIRST + r] = at if at > low else at + _ONE
        s[LAST + r] = to if to < high else to - _ONE
        # What is surely no arc has no ends.
        near = min(abs(low - at), abs(high - to)) if low - high < _HALF else _ONE
        s[DOUBT + r] = min(s[DOUBT + r], near)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def remaining(d: Array, s: AnyArray, n: int, v: int, offset: float) -> None:
    """LEFT: how much farther corner v of the polygon is than the body's edge at `offset`."""
    if n > SIZE or v < 0 or v > SIZE:
        return
    away = AWAY + v * SIZE
    for r in range(n):
        s[LEFT + r] = d[away + r] - (d[MARGIN + r] + offset)


@njit(cache=True, nogil=True, _nrt=False, fastmath=FUSED)  # type: ignore[untyped-decorator]
def narrow(s: AnyArray, n: int, v: int) -> None:
    """Raise START and lower END to the directions of the normals between which corner v lies beyond
    an edge that it is farther away than by LEFT.
    """
    if n > SIZE or v < 0 or v > SIZE:
        return
    inverse = CORNERS + 2 * v * SIZE
    at = inverse + SIZE
    for r in range(n):
        left = s[LEFT + r] * s[inverse + r]
        # That there is no such direction is known in double precision.
        h = arc_cosine(max(left, ZERO))
        h = h if left > ZERO else _NO_ARC
        s[START + r] = max(s[START + r], s[at + r] - h)
        s[END + r] = min(s[END + r], s[at + r] + h)


@njit(cache=True, nogil=True, _nrt=False, fastmath=FUSED)  # type: ignore[untyped-decorator]
def between(
    s: AnyArray, n: int, away: float, turn: float, scale: float, period: float, low_end: float,
    high_end: float, other: bool,
) -> None:  # fmt: skip
    """FIRST and LAST of the arcs from START to END, shortened by turn, about BASE + away; see
    `arcs`, but scale below 0 where the row runs the other way.
    """
    if n > SIZE:
        return
    aside, less, size = np.float32(away), np.float32(turn), np.float32(abs(scale))
    around, turns, half = np.float32(period), np.float32(1.0 / period), np.float32(0.5 * scale)
    lowest, most = np.float32(low_end - _BEYOND), np.float32(high_end + _BEYOND)
    for r in range(n):
        start, end = s[START + r], s[END + r]
        h = (_HALF * (end - start) - less if end - start > _NEARLY else _NO_ARC) * size
        c = s[BASE + r] + (start + end) * half + aside
        c -= around * ((c * turns + _DROP_SINGLE) - _DROP_SINGLE)
        if other:
            c += -around if c > ZERO else around
        low, high = max(c - h, lowest), min(c + h, most)
        at, to = (low + _DROP_SINGLE) - _DROP_SINGLE, (high + _DROP_SINGLE) - _DROP_SINGLE
        s[FIRST + r] = at if at > low else at + _ONE
        s[LAST + r] = to if to < high else to - _ONE
        # What is surely no arc has no ends.
        near = min(abs(low - at), abs(high - to)) if low - high < _HALF else _ONE
        s[DOUBT + r] = min(s[DOUBT + r], near)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def towards(d: Array, s: AnyArray, n: int, px: float, pz: float, begin: int) -> None:
    """Vectors from the pivots to the point p, from `begin` and, their z, behind it."""
    if n > SIZE or begin < 0 or begin > _FAR:
        return
    for r in range(n):
        s[begin + r], s[begin + SIZE + r] = px - d[X + r], pz - d[Z + r]


@njit(cache=True, nogil=True, _nrt=False, fastmath=FUSED)  # type: ignore[untyped-decorator]
def bearings(s: AnyArray, n: int) -> None:
    """START: directions of (UX, UZ)."""
    if n > SIZE:
        return
    for r in range(n):
        s[START + r] = bearing(s[UX + r], s[UZ + r])


@njit(cache=True, nogil=True, _nrt=False, fastmath=FUSED, error_model="numpy")  # type: ignore[untyped-decorator]
def corner_directions(s: AnyArray, n: int, v: int) -> None:
    """Of corner v, to which (VX, VZ) lead: one over its distance, and its direction from that of
    (UX, UZ).
    """
    if n > SIZE or v < 0 or v > SIZE:
        return
    inverse = CORNERS + 2 * v * SIZE
    for r in range(n):
        x, z, ux, uz = s[VX + r], s[VZ + r], s[UX + r], s[UZ + r]
        s[inverse + r] = _ONE / math.sqrt(x * x + z * z + _LEAST)
        s[inverse + SIZE + r] = bearing(ux * x + uz * z, ux * z - uz * x)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def corner_distances(d: Array, n: int, v: int, px: float, pz: float) -> None:
    """How far corner v, the point p, is from the pivots."""
    if n > SIZE or v < 0 or v > SIZE:
        return
    away = AWAY + v * SIZE
    for r in range(n):
        dx, dz = px - d[X + r], pz - d[Z + r]
        d[away + r] = math.sqrt(dx * dx + dz * dz)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def nearest(d: Array, n: int, v: int) -> None:
    """Lower LINE to how far corner v is beyond the margin."""
    if n > SIZE or v < 0 or v > SIZE:
        return
    away = AWAY + v * SIZE
    for r in range(n):
        d[LINE + r] = least(d[LINE + r], d[away + r] - d[MARGIN + r])


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def corner_places(s: AnyArray, n: int, v: int, scale: float) -> None:
    """(VX) where corner v is in the rows, in cells. scale: cells for an angle."""
    if n > SIZE or v < 0 or v > SIZE:
        return
    at, factor = CORNERS + 2 * v * SIZE + SIZE, np.float32(scale)
    for r in range(n):
        s[VX + r] = s[BASE + r] + factor * s[at + r]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def set_bits(s: AnyArray, w: AnyArray, n: int, words: int, low_end: float) -> None:
    """Set the cells of MASK from FIRST to LAST. low_end: see `arcs`."""
    if n > SIZE:
        return
    for k in range(words):
        base = np.float32(64.0 * k + low_end)
        for r in range(n):
            w[k * WORD + MASK + r] |= _bits(s[FIRST + r] - base, s[LAST + r] - base)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def clear_bits(s: AnyArray, w: AnyArray, n: int, words: int, low_end: float) -> None:
    """Clear those of BLOCKED."""
    if n > SIZE:
        return
    for k in range(words):
        base = np.float32(64.0 * k + low_end)
        for r in range(n):
            w[k * WORD + BLOCKED + r] &= ~_bits(s[FIRST + r] - base, s[LAST + r] - base)


@njit(cache=True, nogil=True, _nrt=False, inline="always")  # type: ignore[untyped-decorator]
def _bits(first: np.float32, last: np.float32) -> np.uint64:
    """Bits from first to last of a word."""
    up = np.uint64(np.int32(min(max(first, ZERO), _LAST)))
    down = np.uint64(np.int32(_LAST - max(min(last, _LAST), ZERO)))
    some = first <= last and first <= _LAST and last >= ZERO
    return (ALL << up) & (ALL >> down) if some else np.uint64(0)
