"""One box that holds as much worth as it can within the room of boxes, compiled.

A box is c (3,), R (3, 3), h (3,): {c + R q: |q| <= h}; fields are those of `anneal_kernels`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.machine.anneal_kernels import _move_side, _reach, _vary, sticking_out
from backend.spatial.types import AnyArray, Array

_WARM, _HOT, _COLD = 0.05, 0.15, 1e-4  # temperatures, in worth
_PRICES = (20.0, 400.0)  # of a cubic metre sticking out, in worth: at first, at last
_REACHES = 0.3  # share of the moves that reach for a point
_SHRINKS = 400  # at most


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def worth_inside(points: Array, worth: Array, R: Array, c: Array, h: Array) -> float:
    """The sum of worth (n,) over the points (n, 3) that are inside of a box."""
    total = 0.0
    for i in range(len(points)):
        if worth[i] <= 0.0:
            continue
        x, y, z = points[i, 0] - c[0], points[i, 1] - c[1], points[i, 2] - c[2]
        inside = True
        for a in range(3):
            inside &= abs(x * R[0, a] + y * R[1, a] + z * R[2, a]) <= h[a]
        if inside:
            total += worth[i]
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _moved(points: Array, sums: Array, R: Array, c: Array, h: Array) -> None:
    """Vary a box in place, or have it reach for a point; sums (n,): of the points' worth so far."""
    if np.random.random() < _REACHES:  # noqa: NPY002
        i = np.searchsorted(sums, np.random.random() * sums[-1])  # noqa: NPY002
        _reach(R, c, h, points[min(i, len(points) - 1)])
    else:
        _vary(R, c, h, np.random.random())  # noqa: NPY002


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def drawn_in(
    points: Array,
    worth: Array,
    field: AnyArray,
    origin: Array,
    step: float,
    spacing: float,
    R: Array,
    c: Array,
    h: Array,
) -> float:
    """Move the sides of a box inward, in place, until nothing sticks out; the worth it still holds.

    Each time the side that lowers most of what sticks out for the worth it gives up. -1 where no
    box is left.
    """
    holds = worth_inside(points, worth, R, c, h)
    out = sticking_out(field, origin, step, spacing, R, c, h, 1e9)
    for _ in range(_SHRINKS):
        if out <= 0.0:
            return float(holds)
        best, best_a, best_sign, best_by = -1e18, 0, 1.0, 0.0
        for k in range(12):
            a, sign, by = k % 3, (-1.0 if k // 3 % 2 else 1.0), (0.01 if k < 6 else 0.04)
            R1, c1, h1 = R.copy(), c.copy(), h.copy()
            _move_side(R1, c1, h1, a, sign, -by)
            lost = holds - worth_inside(points, worth, R1, c1, h1)
            less = out - sticking_out(field, origin, step, spacing, R1, c1, h1, 1e9)
            value = (1e3 * less + 1e-6) / (lost + 1e-3)
            if value > best:
                best, best_a, best_sign, best_by = value, a, sign, by
        _move_side(R, c, h, best_a, best_sign, -best_by)
        holds = worth_inside(points, worth, R, c, h)
        out = sticking_out(field, origin, step, spacing, R, c, h, 1e9)
    return -1.0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def worthiest(
    points: Array,
    worth: Array,
    field: AnyArray,
    origin: Array,
    step: float,
    spacing: float,
    box: tuple[Array, Array, Array],
    moves: int,
    seed: int,
) -> tuple[float, Array, Array, Array]:
    """A box within the room of boxes that holds much worth: that worth, and its R, c, h.

    Annealed from `box` (R, c, h): a worth of 1 or so is what a box should have. Sticking out is
    allowed at first, ever dearer; then sides are drawn in, and what remains grows where it can.
    worth: (n,) of the points (n, 3), not negative. -1 where no box is left.
    """
    np.random.seed(seed)  # noqa: NPY002 - compiled code has no other generator
    R, c, h = box[0].copy(), box[1].copy(), box[2].copy()
    sums = np.cumsum(worth)
    hot = _WARM if seed % 3 else _HOT
    holds = worth_inside(points, worth, R, c, h)
    out = sticking_out(field, origin, step, spacing, R, c, h, 1e9)
    for t in range(moves):
        share = t / moves
        T = hot * (1.0 - share) ** 2 + _COLD
        price = _PRICES[0] * (_PRICES[1] / _PRICES[0]) ** share
        R1, c1, h1 = R.copy(), c.copy(), h.copy()
        _moved(points, sums, R1, c1, h1)
        new = worth_inside(points, worth, R1, c1, h1)
        chance = T * np.log(np.random.random() + 1e-300)  # noqa: NPY002
        limit = (new - (holds - price * out + chance)) / price
        if limit < 0.0:
            continue
        sticks = sticking_out(field, origin, step, spacing, R1, c1, h1, limit)
        if sticks <= limit:
            R, c, h, holds, out = R1, c1, h1, new, sticks
    holds = drawn_in(points, worth, field, origin, step, spacing, R, c, h)
    if holds < 0.0:
        return holds, R, c, h
    for _ in range(moves // 3):
        R1, c1, h1 = R.copy(), c.copy(), h.copy()
        _moved(points, sums, R1, c1, h1)
        new = worth_inside(points, worth, R1, c1, h1)
        if new < holds - 0.002 * np.random.random() ** 4:  # noqa: NPY002
            continue
        if sticking_out(field, origin, step, spacing, R1, c1, h1, 0.0) <= 0.0:
            R, c, h, holds = R1, c1, h1, new
    return holds, R, c, h
