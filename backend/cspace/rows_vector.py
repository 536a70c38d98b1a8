"""The loops of `rows_batch`: one step each for all rows of a batch.

Each is so small, and works on so few arrays, that it compiles to vector instructions: numba gives
that up where it cannot tell that many arrays do not overlap, or that rows lie side by side. All
arrays are (m,) with one entry for each row, words (words, >= m); angles are in radians.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.rows import ALL
from backend.cspace.rows_angles import arc_cosine, bearing
from backend.spatial.types import AnyArray, Array

_ALL_AROUND = 4.0  # [rad] half of an arc that holds everything
_DROP = 1.5 * 2.0**52


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})  # type: ignore[untyped-decorator]
def least(values: Array) -> float:
    """The smallest value."""
    found = values[0]
    for r in range(len(values)):
        found = min(found, values[r])
    return float(found)


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})  # type: ignore[untyped-decorator]
def greatest_below(values: Array, limit: float) -> float:
    """The greatest value under the limit, -1e300 when there is none."""
    found = -1e300
    for r in range(len(values)):
        found = max(found, values[r] if values[r] < limit else -1e300)
    return float(found)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def lower(values: Array, others: Array) -> None:
    """values = min(values, others), in place."""
    for r in range(len(values)):
        values[r] = min(values[r], others[r])


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})  # type: ignore[untyped-decorator]
def greatest(values: Array) -> float:
    """The greatest value."""
    found = values[0]
    for r in range(len(values)):
        found = max(found, values[r])
    return float(found)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def higher(values: Array, others: Array) -> None:
    """values = max(values, others), in place."""
    for r in range(len(values)):
        values[r] = max(values[r], others[r])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def offsets(x: Array, z: Array, nx: float, nz: float, offset: float, out: Array) -> None:
    """Distance of the line n . x = offset from the pivots along its normal."""
    for r in range(len(out)):
        out[r] = offset - nx * x[r] - nz * z[r]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def offsets_within(
    x: Array,
    z: Array,
    margin: Array,
    lever_x: Array,
    lever_z: Array,
    nx: float,
    nz: float,
    boom_x: float,
    boom_z: float,
    boom: float,
    stick: float,
    bend: float,
    sign: int,
    out: Array,
) -> None:
    """Move distances along n by how far the pivots can be from where they are, see Level: along n,
    R(d) v - v is at most |d (n x v)| + d^2 |v| / 2. sign: of the margins.
    """
    for r in range(len(out)):
        by_boom = boom * abs(nz * (x[r] - boom_x) - nx * (z[r] - boom_z))
        by_stick = stick * abs(nz * lever_x[r] - nx * lever_z[r])
        out[r] += sign * min(by_boom + by_stick + bend, sign * margin[r])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def from_limit(values: Array, limit: float, mask: AnyArray) -> None:
    """All bits of the rows whose value is at or over the limit, none of the others."""
    for w in range(len(mask)):
        words = mask[w]
        for r in range(len(values)):
            words[r] = ALL if values[r] >= limit else np.uint64(0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def both(words: AnyArray, mask: AnyArray, n: int) -> None:
    """words = words & mask in the first n rows."""
    for w in range(len(words)):
        left, right = words[w], mask[w]
        for r in range(n):
            left[r] &= right[r]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def without(words: AnyArray, mask: AnyArray, n: int) -> None:
    """words = words & ~mask in the first n rows."""
    for w in range(len(words)):
        left, right = words[w], mask[w]
        for r in range(n):
            left[r] &= ~right[r]


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def arcs_before_line(c: Array, radius: float, turn: float, half: Array) -> None:
    """Half of the arc of directions, about the one opposite to the line's normal, in which a corner
    at `radius` is not beyond a line at distance c; widened by turn, below 0 when there is none.
    """
    inverse = 1.0 / max(radius, 1e-300)
    for r in range(len(c)):
        h = arc_cosine(min(max(-c[r] * inverse, -1.0), 1.0), False) + turn
        h = _ALL_AROUND if c[r] >= radius or h >= math.pi else h
        half[r] = -1.0 if c[r] <= -radius else h


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def arcs_of_corner(e: Array, inverse: Array, turn: float, half: Array) -> None:
    """The same for lines at distance e and a corner at radius 1 / inverse."""
    for r in range(len(e)):
        ratio = e[r] * inverse[r]
        h = arc_cosine(min(max(-ratio, -1.0), 1.0), False) + turn
        h = _ALL_AROUND if ratio >= 1.0 or h >= math.pi else h
        half[r] = -1.0 if ratio <= -1.0 else h


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def narrow(e: Array, inverse: Array, at: Array, low: Array, high: Array) -> None:
    """Raise `low` and lower `high` to the directions of the normals between which a corner in the
    direction `at`, at radius 1 / inverse, lies beyond an edge at distance e >= 0.
    """
    for r in range(len(e)):
        h = arc_cosine(min(e[r] * inverse[r], 1.0), False)
        low[r], high[r] = max(low[r], at[r] - h), min(high[r], at[r] + h)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def arcs_between(low: Array, high: Array, turn: float, center: Array, half: Array) -> None:
    """Middles and halves, shortened by turn, of arcs between two directions."""
    for r in range(len(low)):
        center[r] = 0.5 * (low[r] + high[r])
        half[r] = 0.5 * (high[r] - low[r]) - turn if low[r] < high[r] else -1.0


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def bearings(x: Array, z: Array, origin: float, out: Array) -> None:
    """Directions of the vectors (x, z), from the direction `origin`."""
    for r in range(len(out)):
        out[r] = bearing(x[r], z[r], False) - origin


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def inverses(x: Array, z: Array, px: float, pz: float, out: Array) -> None:
    """One over the distances of the point p from the pivots."""
    for r in range(len(out)):
        dx, dz = px - x[r], pz - z[r]
        out[r] = 1.0 / math.sqrt(dx * dx + dz * dz + 1e-300)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def along(x: Array, z: Array, px: float, pz: float, ux: Array, uz: Array, out: Array) -> None:
    """Components of p, as seen from the pivots, along (ux, uz), times the length of that."""
    for r in range(len(out)):
        out[r] = ux[r] * (px - x[r]) + uz[r] * (pz - z[r])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def aside(x: Array, z: Array, px: float, pz: float, ux: Array, uz: Array, out: Array) -> None:
    """The same to the left of (ux, uz)."""
    for r in range(len(out)):
        out[r] = ux[r] * (pz - z[r]) - uz[r] * (px - x[r])


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def mark(
    center: Array,
    away: float,
    half: Array,
    widest: float,
    step: float,
    cells: int,
    mask: AnyArray,
    doubt: Array,
) -> None:
    """Set the cells of mask that are within `half` of center + away, on the circle and from the
    first cell. widest: no half is above it; doubt: least distance so far of an arc's end from a
    cell, in cells.
    """
    inverse = 1.0 / step
    scale = abs(inverse)
    period = 2.0 * math.pi * scale
    turns, middle = 1.0 / period, 0.5 * (cells - 1)
    again = widest * scale + middle > 0.5 * period - 1.0
    for w in range(len(mask)):
        words = mask[w]
        base = 64.0 * w
        for r in range(len(center)):
            c = (center[r] + away) * inverse
            c -= period * _whole((c - middle) * turns)
            h = half[r] * scale
            low, high = c - h, c + h
            at, to = _whole(low), _whole(high)
            doubt[r] = min(doubt[r], min(abs(low - at), abs(high - to)))
            words[r] |= _bits(low, at, high, to, base)
        if not again:
            continue
        # An arc as wide as that may also come in at the row's other end.
        for r in range(len(center)):
            c = (center[r] + away) * inverse
            c -= period * _whole((c - middle) * turns)
            c += -period if c > middle else period
            h = half[r] * scale
            low, high = c - h, c + h
            at, to = _whole(low), _whole(high)
            doubt[r] = min(doubt[r], min(abs(low - at), abs(high - to)))
            words[r] |= _bits(low, at, high, to, base)


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def _whole(x: float) -> float:
    """The nearest whole number: the sum has no digits left after the point."""
    return (x + _DROP) - _DROP


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def _bits(low: float, at: float, high: float, to: float, base: float) -> np.uint64:
    """Bits of the cells between low and high in the word that begins with cell `base`. at, to:
    their nearest whole numbers.
    """
    first = max((at if at > low else at + 1.0) - base, 0.0)
    last = min((to if to < high else to - 1.0) - base, 63.0)
    up, down = np.uint64(np.int64(min(first, 63.0))), np.uint64(np.int64(63.0 - max(last, 0.0)))
    return (ALL << up) & (ALL >> down) if first <= last else np.uint64(0)
