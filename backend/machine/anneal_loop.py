"""Simulated annealing of a few boxes, compiled: the loop over moves."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.machine.anneal_kernels import (
    _MISSING,
    _REFRESH,
    _reach,
    _two_least,
    _vary,
    outside,
    sticking_out,
)
from backend.spatial.types import AnyArray, Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def anneal(
    points: Array,
    weights: Array,
    field: AnyArray,
    origin: Array,
    step: float,
    spacing: float,
    price: float,
    boxes: tuple[Array, Array, Array],
    moves: int,
    hot: float,
    cold: float,
    seed: int,
) -> tuple[float, Array, Array, Array]:
    """The boxes of least cost met in `moves` random moves, and that cost; 0 is a solution.

    Cost: of every point (n, 3) outside of all boxes, 2 cm and how far it is; and `price` times what
    sticks out, see `sticking_out`. A move that raises it by d is taken with the chance
    exp(-d / T), T falling from `hot` to `cold` (Kirkpatrick, Gelatt and Vecchi 1983). boxes: R
    (k, 3, 3), c (k, 3), h (k, 3). weights: (n,) of the points, raised in place while they stay
    outside, which fills in local minima; the least cost is without them.
    """
    np.random.seed(seed)  # noqa: NPY002 - compiled code has no other generator
    Rs, cs, hs = boxes[0].copy(), boxes[1].copy(), boxes[2].copy()
    K, n = len(Rs), len(points)
    away, out = np.empty((K, n)), np.empty(K)
    first, second, which = np.empty(n), np.empty(n), np.zeros(n, np.int64)
    for k in range(K):
        outside(points, Rs[k], cs[k], hs[k], away[k])
        out[k] = price * sticking_out(field, origin, step, spacing, Rs[k], cs[k], hs[k], 1e9)
    missing, plain = 0.0, 0.0
    for i in range(n):
        _two_least(away, first, second, which, i)
        if first[i] > 0.0:
            missing += weights[i] * (_MISSING + first[i])
    sum_out = out.sum()
    least, best_R, best_c, best_h = 1e18, Rs.copy(), cs.copy(), hs.copy()
    trial, left, count = np.empty(n), np.zeros(n, np.int64), 0
    for t in range(moves):
        T = hot * (cold / hot) ** (t / moves)
        if t % _REFRESH == 0:
            missing, count = 0.0, 0
            for i in range(n):
                if first[i] > 0.0:
                    weights[i] = min(weights[i] * 1.05, 30.0) if t > 0 else weights[i]
                    missing += weights[i] * (_MISSING + first[i])
                    left[count] = i
                    count += 1
                else:
                    weights[i] = max(1.0, 1.0 + 0.985 * (weights[i] - 1.0))
        if missing + sum_out < least:
            plain = sum_out
            for i in range(n):
                if first[i] > 0.0:
                    plain += _MISSING + first[i]
            if plain < least:
                least = plain
                best_R[:], best_c[:], best_h[:] = Rs, cs, hs
            if plain <= 0.0:
                break
        k, kind = np.random.randint(K), np.random.random()  # noqa: NPY002
        point = left[np.random.randint(max(count, 1))]  # noqa: NPY002
        if kind < 0.28 and count > 0:
            if np.random.random() < 0.5:  # noqa: NPY002
                k = which[point]
            R, c, h = Rs[k].copy(), cs[k].copy(), hs[k].copy()
            _reach(R, c, h, points[point])
        elif kind > 0.998 and count > 0 and 0.02 * hot < T:
            own = np.zeros(K)  # the box of least use begins anew at the point
            for i in range(n):
                if first[i] == 0.0 and second[i] > 0.0:
                    own[which[i]] += weights[i]
            k = int(np.argmin(own))
            R, c, h = Rs[np.random.randint(K)].copy(), points[point].copy(), np.full(3, 0.1)  # noqa: NPY002
        else:
            R, c, h = Rs[k].copy(), cs[k].copy(), hs[k].copy()
            _vary(R, c, h, np.random.random())  # noqa: NPY002
        limit = missing + sum_out - T * np.log(np.random.random() + 1e-300)  # noqa: NPY002
        others = sum_out - out[k]
        new = price * sticking_out(
            field, origin, step, spacing, R, c, h, max(0.0, (limit - others) / price)
        )
        if others + new > limit:
            continue
        outside(points, R, c, h, trial)
        total, taken = 0.0, True
        for i in range(n):
            d = min(second[i] if which[i] == k else first[i], trial[i])
            if d > 0.0:
                total += weights[i] * (_MISSING + d)
                if total > limit - others - new:
                    taken = False
                    break
        if not taken:
            continue
        Rs[k], cs[k], hs[k], away[k], out[k] = R, c, h, trial, new
        missing, sum_out = total, others + new
        for i in range(n):
            if which[i] == k or trial[i] < second[i]:
                _two_least(away, first, second, which, i)
    return least, best_R, best_c, best_h
