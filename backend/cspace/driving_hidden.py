"""Which convex polygons of a union show on its edge."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray, IntArray

_CLEAR = 1e-9
"""An edge counts as hidden in a polygon if it lies this far within it [m]."""


def outermost(points: Array, start: IntArray) -> BoolArray:
    """False for polygons that lie in another one, which can be left out of a union.

    points: (k, 2) [m] and start: (p + 1,) of convex counter-clockwise polygons.
    """
    low, high = _bounds(points, start)
    return np.asarray(_outermost(points, start, low, high, _order(low, high)))


def exposed(points: Array, start: IntArray, chosen: IntArray) -> BoolArray:
    """Whether any part of the edges of polygon chosen[k] lies in no other chosen one (c,)."""
    low, high = _bounds(points, start)
    order = np.argsort(-np.prod(high - low, axis=1)[chosen], kind="stable")
    return np.asarray(_exposed(points, start, chosen, low, high, order))


def covering(points: Array, start: IntArray, chosen: IntArray, places: Array) -> BoolArray:
    """Whether polygon chosen[c] holds each of the places (k, 2) [m]: (c, k)."""
    return np.asarray(_covering(points, start, chosen, places))


def _bounds(points: Array, start: IntArray) -> tuple[Array, Array]:
    return np.minimum.reduceat(points, start[:-1]), np.maximum.reduceat(points, start[:-1])


def _order(low: Array, high: Array) -> IntArray:
    """Large polygons first."""
    return np.argsort(-np.prod(high - low, axis=1), kind="stable")


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _inside(points: Array, first: int, last: int, x: float, y: float) -> bool:
    """Whether (x, y) lies in the convex polygon points[first:last]: bisection of its fan."""
    ox, oy = points[first, 0], points[first, 1]
    dx, dy = x - ox, y - oy
    low, high = first + 1, last - 1
    if (points[low, 0] - ox) * dy - (points[low, 1] - oy) * dx < 0.0:
        return False
    if (points[high, 0] - ox) * dy - (points[high, 1] - oy) * dx > 0.0:
        return False
    while high - low > 1:
        middle = (low + high) // 2
        if (points[middle, 0] - ox) * dy - (points[middle, 1] - oy) * dx >= 0.0:
            low = middle
        else:
            high = middle
    ex, ey = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    return bool(ex * (y - points[low, 1]) - ey * (x - points[low, 0]) >= 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _covering(points: Array, start: IntArray, chosen: IntArray, places: Array) -> BoolArray:
    out = np.empty((len(chosen), len(places)), np.bool_)
    for c in range(len(chosen)):
        p = chosen[c]
        for k in range(len(places)):
            out[c, k] = _inside(points, start[p], start[p + 1], places[k, 0], places[k, 1])
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _outermost(
    points: Array, start: IntArray, low: Array, high: Array, order: IntArray
) -> BoolArray:
    keep = np.zeros(len(order), np.bool_)
    containers = np.empty(len(order), np.int64)
    count = 0
    for p in order:
        hidden = False
        for c in range(count):
            q = containers[c]
            if (
                low[p, 0] < low[q, 0]
                or low[p, 1] < low[q, 1]
                or high[p, 0] > high[q, 0]
                or high[p, 1] > high[q, 1]
            ):
                continue
            hidden = True
            for v in range(start[p], start[p + 1]):
                if not _inside(points, start[q], start[q + 1], points[v, 0], points[v, 1]):
                    hidden = False
                    break
            if hidden:
                break
        if not hidden:
            keep[p] = True
            containers[count] = p
            count += 1
    return keep


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _within(
    points: Array, first: int, last: int, x: float, y: float, dx: float, dy: float
) -> tuple[float, float]:
    """The part (begin, end) of the segment from (x, y) by (dx, dy) that lies well in a polygon.

    Clipped by every edge of the polygon (Cyrus and Beck 1978); begin >= end: none.
    """
    begin, end = 0.0, 1.0
    for v in range(first, last):
        w = v + 1 if v + 1 < last else first
        ex, ey = points[w, 0] - points[v, 0], points[w, 1] - points[v, 1]
        height = ex * (y - points[v, 1]) - ey * (x - points[v, 0])
        height -= _CLEAR * (abs(ex) + abs(ey))
        rise = ex * dy - ey * dx
        if height < 0.0 and height + rise < 0.0:
            return 1.0, 0.0
        if height < 0.0:
            begin = max(begin, -height / rise)
        elif height + rise < 0.0:
            end = min(end, -height / rise)
        if begin >= end:
            return 1.0, 0.0
    return begin, end


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _exposed(
    points: Array, start: IntArray, chosen: IntArray, low: Array, high: Array, order: IntArray
) -> BoolArray:
    shown = np.zeros(len(chosen), np.bool_)
    near = np.empty(len(chosen), np.int64)
    begins, ends = np.empty(len(chosen)), np.empty(len(chosen))
    for k in range(len(chosen)):
        p = chosen[k]
        count = 0
        for j in order:
            q = chosen[j]
            if (
                q != p
                and low[p, 0] < high[q, 0]
                and low[p, 1] < high[q, 1]
                and high[p, 0] > low[q, 0]
                and high[p, 1] > low[q, 1]
            ):
                near[count] = q
                count += 1
        for v in range(start[p], start[p + 1]):
            w = v + 1 if v + 1 < start[p + 1] else start[p]
            x, y = points[v, 0], points[v, 1]
            dx, dy = points[w, 0] - x, points[w, 1] - y
            n = 0
            for c in range(count):
                q = near[c]
                begin, end = _within(points, start[q], start[q + 1], x, y, dx, dy)
                if begin < end:
                    begins[n], ends[n] = begin, end
                    n += 1
                    if begin <= 0.0 and end >= 1.0:
                        # The same polygon most likely hides the next edge, too.
                        near[c], near[0] = near[0], near[c]
                        break
            covered = 0.0
            for c in np.argsort(begins[:n]):
                if begins[c] > covered:
                    break
                covered = max(covered, ends[c])
            if covered < 1.0:
                shown[k] = True
                break
    return shown
