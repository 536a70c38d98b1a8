"""Quick arc functions for rows, in single precision, which does twice as many at once.

What rounding would spoil near the end of an arc, one minus a cosine, comes from double precision.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

ERROR = 2e-6
"""The ends of arcs, each from two such angles, differ from the exact ones by less than this
[rad].
"""

ZERO, HALF_TURN = np.float32(0.0), np.float32(math.pi)
_ONE, _QUARTER, _LEAST = np.float32(1.0), np.float32(0.5 * math.pi), np.float32(1e-37)
_C0, _C1, _C2, _C3 = (
    np.float32(c)
    for c in (1.5707963018332993, -0.21459849423367133, 0.08897409930412242, -0.05014502501932554)
)
_C4, _C5, _C6, _C7 = (
    np.float32(c)
    for c in (0.03080825341115547, -0.016965471962564878, 0.006580885238510772, -0.0012370048527585)
)
_T0, _T1, _T2, _T3 = (
    np.float32(c)
    for c in (0.9999998977538576, -0.33331959724324206, 0.1996923539479228, -0.14016585042045626)
)
_T4, _T5, _T6, _T7 = (
    np.float32(c)
    for c in (0.09906096895951241, -0.05936710078752843, 0.02416618952100339, -0.004668773307282873)
)


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def arc_cosine(left: np.float32) -> np.float32:
    """acos(1 - left) [rad], 0 <= left <= 1. Chebyshev fit of acos(t) / sqrt(1 - t), after
    Abramowitz and Stegun 1964, 4.4.46.
    """
    t = _ONE - left
    p = _C6 + t * _C7
    p = _C5 + t * p
    p = _C4 + t * p
    p = _C3 + t * p
    p = _C2 + t * p
    p = _C1 + t * p
    p = _C0 + t * p
    return math.sqrt(left) * p


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def bearing(x: np.float32, z: np.float32) -> np.float32:
    """atan2(z, x) [rad]. Chebyshev fit of atan(t) / t in t^2, t <= 1."""
    a, b = abs(x), abs(z)
    t = min(a, b) / max(max(a, b), _LEAST)
    u = t * t
    p = _T6 + u * _T7
    p = _T5 + u * p
    p = _T4 + u * p
    p = _T3 + u * p
    p = _T2 + u * p
    p = _T1 + u * p
    p = t * (_T0 + u * p)
    if b > a:
        p = _QUARTER - p
    if x < ZERO:
        p = HALF_TURN - p
    return p if z >= ZERO else -p
