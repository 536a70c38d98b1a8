"""The loops of `rows_batch`: one step each for all rows of a batch.

Each is so small, and works on so few arrays, that it compiles to vector instructions. All arrays
are (m,) with one entry for each row, words (words, >= m); angles are in radians, and `origin` is the
angle of a row's first cell.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.rows import ALL
from backend.cspace.rows_angles import arc_cosine, bearing
from backend.spatial.types import AnyArray, Array

STEEP = 1e300
"""The tangent of a quarter turn."""
_ALL_AROUND = 4.0  # [rad] half of an arc that holds everything
_DROP = 1.5 * 2.0**52


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def least(values: Array) -> float:
    """The smallest value."""
    found = math.inf
    for r in range(len(values)):
        found = min(found, values[r])
    return found


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def greatest_below(values: Array, limit: float) -> float:
    """The greatest value under the limit, -1e300 when there is none."""
    found = -1e300
    for r in range(len(values)):
        found = max(found, values[r] if values[r] < limit else -1e300)
    return found


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def lower(values: Array, others: Array) -> None:
    """values = min(values, others)."""
    for r in range(len(values)):
        values[r] = min(values[r], others[r])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def offsets(
    x: Array, z: Array, margin: Array, nx: float, nz: float, offset: float, out: Array
) -> None:
    """Distance of the line n . x = offset from the pivots along its normal, and the margin."""
    for r in range(len(out)):
        out[r] = offset - nx * x[r] - nz * z[r] + margin[r]


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
def arcs_of_corner(e: Array, square: Array, turn: float, half: Array) -> None:
    """The same for lines at distance e and a corner at the root of `square`."""
    for r in range(len(e)):
        radius = math.sqrt(square[r])
        h = arc_cosine(min(max(-e[r] / (radius + 1e-300), -1.0), 1.0), False) + turn
        h = _ALL_AROUND if e[r] >= radius or h >= math.pi else h
        half[r] = -1.0 if e[r] <= -radius else h


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def bearings(x: Array, z: Array, origin: Array, out: Array) -> None:
    """Directions of the vectors (x, z), from the origins."""
    for r in range(len(out)):
        out[r] = bearing(x[r], z[r], False) - origin[r]


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def normalise(x: Array, z: Array) -> None:
    """Make the vectors (x, z) one long."""
    for r in range(len(x)):
        inverse = 1.0 / math.sqrt(x[r] * x[r] + z[r] * z[r] + 1e-300)
        x[r] *= inverse
        z[r] *= inverse


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def squares(x: Array, z: Array, px: float, pz: float, out: Array) -> None:
    """Squared distances of the point p from the pivots."""
    for r in range(len(out)):
        dx, dz = px - x[r], pz - z[r]
        out[r] = dx * dx + dz * dz


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def projected(x: Array, z: Array, px: float, pz: float, ux: Array, uz: Array, out: Array) -> None:
    """Components of p, as seen from the pivots, along (ux, uz)."""
    for r in range(len(out)):
        out[r] = ux[r] * (px - x[r]) + uz[r] * (pz - z[r])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def crossed(x: Array, z: Array, px: float, pz: float, ux: Array, uz: Array, out: Array) -> None:
    """Components of p, as seen from the pivots, to the left of (ux, uz)."""
    for r in range(len(out)):
        out[r] = ux[r] * (pz - z[r]) - uz[r] * (px - x[r])


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def tangents(
    along: Array, aside: Array, square: Array, e: Array, low: Array, high: Array
) -> None:
    """Raise `low` and lower `high`: tangents, measured from the direction of `along`, of the
    normals between which a corner (along, aside) lies beyond an edge at distance e >= 0.

    The normal m of the line through the corner u at distance e has m . u = e, so that
    m |u|^2 = e u -+ sqrt(|u|^2 - e^2) u_left. A normal that is good for all corners is within a
    quarter turn of each point of the polygon, so that others count as steep.
    """
    for r in range(len(e)):
        t = math.sqrt(max(square[r] - e[r] * e[r], 0.0))
        ex, ez, tx, tz = e[r] * along[r], e[r] * aside[r], t * along[r], t * aside[r]
        from_x, to_x = ex + tz, ex - tz
        left = (ez - tx) / from_x if from_x > 0.0 else (STEEP if aside[r] > 0.0 else -STEEP)
        right = (ez + tx) / to_x if to_x > 0.0 else (-STEEP if aside[r] < 0.0 else STEEP)
        low[r] = max(low[r], STEEP if square[r] <= e[r] * e[r] else left)
        high[r] = min(high[r], right)


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def arcs_between(low: Array, high: Array, turn: float, center: Array, half: Array) -> None:
    """Middles and halves, shortened by turn, of the arcs between two tangents."""
    for r in range(len(low)):
        left, right = bearing(1.0, low[r], False), bearing(1.0, high[r], False)
        center[r] = 0.5 * (left + right)
        half[r] = 0.5 * (right - left) - turn if low[r] < high[r] else -1.0


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def mark(
    center: Array, away: float, half: Array, widest: float, step: float, cells: int,
    mask: AnyArray, doubt: Array,
) -> None:
    """Set the cells of mask that are within `half` of center + away, on the circle and from the
    first cell. widest: no half is above it; doubt: least distance so far of an arc's end from a
    cell, in cells.
    """  # fmt: skip
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
