"""The compiled part of `working_area`: how far bodies are while joints are anywhere in intervals.

The interval of every cosine and sine is exact, and the sums of the intervals hold whatever the
joints do within theirs.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray

FULL = 2.0 * math.pi


@njit(cache=True)
def _cosine(low: float, high: float) -> tuple[float, float]:
    """Lowest and highest cosine within low to high [rad]."""
    a, b = math.cos(low), math.cos(high)
    least, most = min(a, b), max(a, b)
    if math.ceil(low / FULL) * FULL <= high:
        most = 1.0
    if (math.ceil(low / FULL - 0.5) + 0.5) * FULL <= high:
        least = -1.0
    return least, most


@njit(cache=True)
def half_width(near: float, far: float, width: float, body: float) -> float:
    """How far to one side of straight ahead anything is seen that is outside a disc [rad].

    near, far: how far ahead of the axis; width: to that side; body: the disc's radius [m].
    """
    most = max(width, 0.0)
    if math.hypot(max(abs(near), abs(far)), most) <= body:
        return 0.0
    if near < 0.0 and math.hypot(near, most) > body:
        return FULL
    return math.atan2(most, max(near, math.sqrt(max(body * body - most * most, 0.0))))


@njit(cache=True)
def intervals(
    q: Array, rates: Array, sigma_q: float, sigma_rate: float, lower: Array, upper: Array, dt: float
) -> Array:
    """(2, 3, 4) lowest and highest of each joint now, until `dt` from now, and in any posture.

    q, rates, lower, upper: (4,) [rad, rad/s]; what is beyond a limit already stays in.
    """
    out = np.empty((2, 3, 4))
    for k in range(4):
        low, high = min(lower[k], q[k]), max(upper[k], q[k])
        slow = min((rates[k] - 3.0 * sigma_rate) * dt, 0.0) - 3.0 * sigma_q
        fast = max((rates[k] + 3.0 * sigma_rate) * dt, 0.0) + 3.0 * sigma_q
        out[0, :, k] = q[k], max(q[k] + slow, low), low
        out[1, :, k] = q[k], min(q[k] + fast, high), high
        for row in range(3):
            out[0, row, k] = max(out[0, row, k], q[k] - FULL)
            out[1, row, k] = min(out[1, row, k], q[k] + FULL)
    return out


@njit(cache=True)
def sectors(
    pivots: Array,
    vectors: Array,
    starts: IntArray,
    chain: IntArray,
    lateral: Array,
    slack: float,
    signs: Array,
    low: Array,
    high: Array,
    tilt: float,
    wider: Array,
    body: Array,
) -> Array:
    """(r, 3): reach [m], and half width to the right and to the left outside the disc [rad].

    The first six as in `Extent`; signs: (3,) of the joints' values. low, high: (r, 3) of boom,
    stick and bucket [rad]; tilt: of the swing axis [rad]; wider: (r,) what everything counts as
    larger [m]; body: (r,) radius of the disc [m].
    """
    sine, cosine = math.sin(tilt), max(math.cos(tilt), 1e-3)
    out = np.zeros((len(low), 3))
    for row in range(len(low)):
        # Ends of the sums of angles, and of the place of each pivot ahead and up.
        at = np.zeros((3, 4))
        turned = np.zeros((3, 2))
        a = b = 0.0
        for k in range(3):
            length = pivots[k, 0]
            for axis in range(2):
                by = pivots[k, 1] - axis * 0.5 * math.pi
                least, most = _cosine(a + by, b + by)
                before = at[k - 1] if k > 0 else np.zeros(4)
                at[k, 2 * axis] = before[2 * axis] + length * least
                at[k, 2 * axis + 1] = before[2 * axis + 1] + length * most
            p, q = signs[k] * low[row, k], signs[k] * high[row, k]
            a += min(p, q)
            b += max(p, q)
            turned[k, 0], turned[k, 1] = a, b
        for group in range(len(chain)):
            k = chain[group]
            ends = np.array([np.inf, -np.inf, np.inf, -np.inf])
            for v in range(starts[group], starts[group + 1]):
                for axis in range(2):
                    by = vectors[v, 1] - axis * 0.5 * math.pi
                    least, most = _cosine(turned[k, 0] + by, turned[k, 1] + by)
                    ends[2 * axis] = min(ends[2 * axis], vectors[v, 0] * least)
                    ends[2 * axis + 1] = max(ends[2 * axis + 1], vectors[v, 0] * most)
            near, far = at[k, 0] + ends[0], at[k, 1] + ends[1]
            height = max(abs(at[k, 2] + ends[2]), abs(at[k, 3] + ends[3]))
            right, left = -lateral[group, 0], lateral[group, 1]
            side = max(abs(right), abs(left))
            # On a slope heights lean out, and what lies beside is a little turned.
            lean = slack + (height + slack) * sine + side * 0.5 * sine * sine / cosine
            grown = lean + wider[row]
            reach = math.hypot(max(abs(near), abs(far)), side) + grown
            out[row, 0] = max(out[row, 0], reach)
            near = min(near, near * cosine) - grown
            far = max(far, far * cosine) + grown
            out[row, 1] = max(out[row, 1], half_width(near, far, right + grown, body[row]))
            out[row, 2] = max(out[row, 2], half_width(near, far, left + grown, body[row]))
    return out


@njit(cache=True)
def narrowest(areas: Array, center: Array, places: Array, radius: Array) -> IntArray:
    """(k,) 1 + the last of the areas that discs on the ground touch, 0 none.

    areas: (a, 4) body, reach, start, end of each [m, rad]; center: (2,), places: (k, 2) in one
    frame; radius: (k,) [m].
    """
    out = np.zeros(len(places), np.int64)
    for i in range(len(places)):
        x, y = places[i, 0] - center[0], places[i, 1] - center[1]
        r, angle = math.hypot(x, y), math.atan2(y, x)
        for k in range(len(areas)):
            body, reach, start, end = areas[k]
            half = 0.5 * (end - start)
            beside = (angle - start - half + math.pi) % FULL - math.pi
            beside = max(abs(beside) - half, 0.0)
            along = 0.0
            if beside < 0.5 * math.pi:
                along = min(r * math.cos(beside), reach)
            gap = math.hypot(r * math.cos(beside) - along, r * math.sin(beside))
            if min(gap, r - body) <= radius[i]:
                out[i] = k + 1
    return out
