"""Quick arc functions for rows: polynomials good to 3e-9 rad, the libraries' where that decides."""

from __future__ import annotations

import math

from numba import njit

ERROR = 1e-8
"""Sums of two such angles differ from the exact ones by less than this [rad]."""


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def arc_cosine(x: float, exact: bool) -> float:
    """acos(x) [rad], -1 <= x <= 1. Chebyshev fit of acos(x) / sqrt(1 - x), after Abramowitz and
    Stegun 1964, 4.4.46.
    """
    if exact:
        return math.acos(x)
    t = abs(x)
    p = 0.0025186261303489295 - 0.00040427333281265967 * t
    p = -0.007445645629612125 + t * p
    p = 0.014575916973168112 + t * p
    p = -0.022844571707484256 + t * p
    p = 0.03331491441778417 + t * p
    p = -0.050740801300049744 + t * p
    p = 0.0890447960816654 + t * p
    p = -0.21460172591626153 + t * p
    p = 1.5707963262615365 + t * p
    p = math.sqrt(1.0 - t) * p
    return p if x >= 0.0 else math.pi - p


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def bearing(x: float, z: float, exact: bool) -> float:
    """atan2(z, x) [rad]. Chebyshev fit of atan(t) / t in t^2, t <= 1."""
    if exact:
        return math.atan2(z, x)
    a, b = abs(x), abs(z)
    t = min(a, b) / max(a, b, 5e-324)
    u = t * t
    p = 0.010962443101616624 - 0.0018044901736224805 * u
    p = -0.031264506455191694 + u * p
    p = 0.058040451864235475 + u * p
    p = -0.08407879216320975 + u * p
    p = 0.10953449847949437 + u * p
    p = -0.14264389792710666 + u * p
    p = 0.1999854226685348 + u * p
    p = -0.3333329671514915 + u * p
    p = t * (0.9999999990537054 + u * p)
    if b > a:
        p = 0.5 * math.pi - p
    if x < 0.0:
        p = math.pi - p
    return p if z >= 0.0 else -p
