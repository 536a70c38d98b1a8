"""Separating axes of two oriented boxes, compiled: for single configurations."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def gap(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array, enough: float) -> float:
    """Largest gap of two boxes along their 15 axes [m], or the first one above `enough`.

    A positive gap is a lower bound of the distance and proves separation; a negative one is minus
    the penetration depth. c: (3,), R: (3, 3), h: (3,).
    """
    d0, d1, d2 = cb[0] - ca[0], cb[1] - ca[1], cb[2] - ca[2]
    R = np.empty((3, 3))
    Q = np.empty((3, 3))
    t = np.empty(3)
    best = -math.inf
    for i in range(3):
        t[i] = Ra[0, i] * d0 + Ra[1, i] * d1 + Ra[2, i] * d2
        for j in range(3):
            R[i, j] = Ra[0, i] * Rb[0, j] + Ra[1, i] * Rb[1, j] + Ra[2, i] * Rb[2, j]
            Q[i, j] = abs(R[i, j])
        best = max(best, abs(t[i]) - ha[i] - Q[i, 0] * hb[0] - Q[i, 1] * hb[1] - Q[i, 2] * hb[2])
    if best > enough:
        return best
    for j in range(3):
        s = abs(t[0] * R[0, j] + t[1] * R[1, j] + t[2] * R[2, j])
        best = max(best, s - hb[j] - Q[0, j] * ha[0] - Q[1, j] * ha[1] - Q[2, j] * ha[2])
    if best > enough:
        return best
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            length = math.sqrt(max(1.0 - R[i, j] * R[i, j], 0.0))
            if length < 1e-7:  # parallel edges: the face axes cover them
                continue
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            s = abs(t[i2] * R[i1, j] - t[i1] * R[i2, j])
            s -= ha[i1] * Q[i2, j] + ha[i2] * Q[i1, j] + hb[j1] * Q[i, j2] + hb[j2] * Q[i, j1]
            best = max(best, s / length)
    return best
