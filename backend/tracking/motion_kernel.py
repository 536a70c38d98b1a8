"""The compiled constant turn of `motion`: states by states, sigma points among them."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array
from backend.tracking.records import PX, PY, PZ, TURN, VX, VY, VZ, YAW

_STRAIGHT = 1e-6  # turned angle below which the series is used [rad]


@njit(cache=True, nogil=True)
def turned(x: Array, dt: float, fade: float) -> Array:
    """States (k, 11) after dt [s] of the constant turn whose rate falls to 1/e within fade [s].

    Rasul 2021, Eqs. (4)-(5), in Cartesian form; the turn rate's mean over dt turns the velocity.
    """
    out = x.copy()
    left, mean = np.exp(-dt / fade), -fade * np.expm1(-dt / fade)
    for k in range(len(x)):
        angle = mean * x[k, TURN]
        sine, cosine = np.sin(angle), np.cos(angle)
        if abs(angle) < _STRAIGHT:
            ahead, aside = dt * (1.0 - angle**2 / 6.0), dt * (0.5 * angle)
        else:
            ahead, aside = dt * (sine / angle), dt * ((1.0 - cosine) / angle)
        vx, vy = x[k, VX], x[k, VY]
        out[k, PX] += ahead * vx - aside * vy
        out[k, PY] += aside * vx + ahead * vy
        out[k, PZ] += dt * x[k, VZ]
        out[k, VX] = cosine * vx - sine * vy
        out[k, VY] = sine * vx + cosine * vy
        out[k, YAW] += angle
        out[k, TURN] *= left
    return out
