"""Separating axes of two oriented boxes, compiled: for single configurations."""

from __future__ import annotations

import math

from numba import njit

from backend.spatial.types import Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def gap(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array, enough: float) -> float:
    """Largest gap of two boxes along their 15 axes [m], or the first one above `enough`.

    A positive gap is a lower bound of the distance and proves separation; a negative one is minus
    the penetration depth. c: (3,), R: (3, 3), h: (3,).
    """
    # Written out: nothing is allocated, and it is called some thousand times in a cycle.
    d0, d1, d2 = cb[0] - ca[0], cb[1] - ca[1], cb[2] - ca[2]
    a0, b0 = ha[0], hb[0]
    a1, b1 = ha[1], hb[1]
    a2, b2 = ha[2], hb[2]
    t0 = Ra[0, 0] * d0 + Ra[1, 0] * d1 + Ra[2, 0] * d2
    t1 = Ra[0, 1] * d0 + Ra[1, 1] * d1 + Ra[2, 1] * d2
    t2 = Ra[0, 2] * d0 + Ra[1, 2] * d1 + Ra[2, 2] * d2
    r00 = Ra[0, 0] * Rb[0, 0] + Ra[1, 0] * Rb[1, 0] + Ra[2, 0] * Rb[2, 0]
    r01 = Ra[0, 0] * Rb[0, 1] + Ra[1, 0] * Rb[1, 1] + Ra[2, 0] * Rb[2, 1]
    r02 = Ra[0, 0] * Rb[0, 2] + Ra[1, 0] * Rb[1, 2] + Ra[2, 0] * Rb[2, 2]
    r10 = Ra[0, 1] * Rb[0, 0] + Ra[1, 1] * Rb[1, 0] + Ra[2, 1] * Rb[2, 0]
    r11 = Ra[0, 1] * Rb[0, 1] + Ra[1, 1] * Rb[1, 1] + Ra[2, 1] * Rb[2, 1]
    r12 = Ra[0, 1] * Rb[0, 2] + Ra[1, 1] * Rb[1, 2] + Ra[2, 1] * Rb[2, 2]
    r20 = Ra[0, 2] * Rb[0, 0] + Ra[1, 2] * Rb[1, 0] + Ra[2, 2] * Rb[2, 0]
    r21 = Ra[0, 2] * Rb[0, 1] + Ra[1, 2] * Rb[1, 1] + Ra[2, 2] * Rb[2, 1]
    r22 = Ra[0, 2] * Rb[0, 2] + Ra[1, 2] * Rb[1, 2] + Ra[2, 2] * Rb[2, 2]
    q00, q01, q02 = abs(r00), abs(r01), abs(r02)
    q10, q11, q12 = abs(r10), abs(r11), abs(r12)
    q20, q21, q22 = abs(r20), abs(r21), abs(r22)
    best = abs(t0) - a0 - q00 * b0 - q01 * b1 - q02 * b2
    best = max(best, abs(t1) - a1 - q10 * b0 - q11 * b1 - q12 * b2)
    best = max(best, abs(t2) - a2 - q20 * b0 - q21 * b1 - q22 * b2)
    if best > enough:
        return float(best)
    s = abs(t0 * r00 + t1 * r10 + t2 * r20)
    best = max(best, s - b0 - q00 * a0 - q10 * a1 - q20 * a2)
    s = abs(t0 * r01 + t1 * r11 + t2 * r21)
    best = max(best, s - b1 - q01 * a0 - q11 * a1 - q21 * a2)
    s = abs(t0 * r02 + t1 * r12 + t2 * r22)
    best = max(best, s - b2 - q02 * a0 - q12 * a1 - q22 * a2)
    if best > enough:
        return float(best)
    s = abs(t2 * r10 - t1 * r20)
    s -= a1 * q20 + a2 * q10 + b1 * q02 + b2 * q01
    best = max(best, _along_cross(s, r00))
    s = abs(t2 * r11 - t1 * r21)
    s -= a1 * q21 + a2 * q11 + b2 * q00 + b0 * q02
    best = max(best, _along_cross(s, r01))
    s = abs(t2 * r12 - t1 * r22)
    s -= a1 * q22 + a2 * q12 + b0 * q01 + b1 * q00
    best = max(best, _along_cross(s, r02))
    s = abs(t0 * r20 - t2 * r00)
    s -= a2 * q00 + a0 * q20 + b1 * q12 + b2 * q11
    best = max(best, _along_cross(s, r10))
    s = abs(t0 * r21 - t2 * r01)
    s -= a2 * q01 + a0 * q21 + b2 * q10 + b0 * q12
    best = max(best, _along_cross(s, r11))
    s = abs(t0 * r22 - t2 * r02)
    s -= a2 * q02 + a0 * q22 + b0 * q11 + b1 * q10
    best = max(best, _along_cross(s, r12))
    s = abs(t1 * r00 - t0 * r10)
    s -= a0 * q10 + a1 * q00 + b1 * q22 + b2 * q21
    best = max(best, _along_cross(s, r20))
    s = abs(t1 * r01 - t0 * r11)
    s -= a0 * q11 + a1 * q01 + b2 * q20 + b0 * q22
    best = max(best, _along_cross(s, r21))
    s = abs(t1 * r02 - t0 * r12)
    s -= a0 * q12 + a1 * q02 + b0 * q21 + b1 * q20
    return float(max(best, _along_cross(s, r22)))


@njit(cache=True, nogil=True, inline="always")  # type: ignore[untyped-decorator]
def _along_cross(s: float, cosine: float) -> float:
    """The gap `s` along two edges' cross product of that length, for edges at that cosine."""
    square = 1.0 - cosine * cosine
    # Of parallel edges there is none: the face axes cover them.
    return s / math.sqrt(square) if square >= 1e-14 else -math.inf
