"""The compiled loop of `quadratic`."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array

_VIOLATED = 1e-10
_DEPENDENT = 1e-12  # squared length below which a step direction is none
_ROUNDS = 400


@njit(cache=True, nogil=True)
def minimise(inverse: Array, g: Array, A: Array, b: Array) -> tuple[Array, Array, bool]:
    """x (n,), multipliers (m,), whether all rows hold. inverse: H^-1; rows of A: of unit length."""
    m, n = A.shape
    x = -inverse @ g
    active = np.empty(n, dtype=np.int64)
    held = np.zeros(m, dtype=np.bool_)
    u = np.zeros(n + 1)
    count = 0
    out = np.zeros(m)
    rounds = 0
    while True:
        worst, p = -_VIOLATED, -1
        for i in range(m):
            if not held[i]:
                s = A[i] @ x - b[i]
                if s < worst:
                    worst, p = s, i
        if p < 0:
            for k in range(count):
                out[active[k]] = u[k]
            return x, out, True
        row = A[p]
        u[count] = 0.0
        while True:
            rounds += 1
            if rounds > _ROUNDS:
                return x, out, False
            # Step directions: z in the primal, r in the dual space (step 2a).
            down = inverse @ row
            z = down.copy()
            r = np.zeros(count)
            if count > 0:
                N = np.empty((n, count))
                for k in range(count):
                    N[:, k] = A[active[k]]
                HN = inverse @ N
                r = np.linalg.solve(N.T @ HN, HN.T @ row)
                z -= HN @ r
            partial, drop = np.inf, -1
            for k in range(count):
                if r[k] > 1e-14 and u[k] / r[k] < partial:
                    partial, drop = u[k] / r[k], k
            along = z @ row
            full = np.inf
            if count < n and along > _DEPENDENT * (down @ row):
                full = -(row @ x - b[p]) / along
            step = min(partial, full)
            if step == np.inf:
                return x, out, False
            for k in range(count):
                u[k] -= step * r[k]
            u[count] += step
            if full < np.inf:
                x = x + step * z
            if step == full:
                active[count] = p
                held[p] = True
                count += 1
                break
            held[active[drop]] = False
            for k in range(drop, count - 1):
                active[k] = active[k + 1]
            for k in range(drop, count):
                u[k] = u[k + 1]
            count -= 1
