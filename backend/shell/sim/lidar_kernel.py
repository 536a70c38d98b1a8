"""Rays against boxes, upright cylinders and a ground plane, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray

_SLACK = 1e-9  # [rad] bounds are rounded outwards


@njit(cache=True, nogil=True)
def cast(
    origin: Array,
    T: Array,
    elevations: Array,
    azimuths: Array,
    boxes: tuple[Array, Array, Array],
    cylinders: Array,
    ground: Array,
    farthest: float,
    of: tuple[int, int],
) -> tuple[Array, IntArray]:
    """(range (b, a) [m], infinite without an echo; hit (b, a): -2 nothing, -1 ground, a box's
    number, after the boxes a cylinder's).

    origin: (3,) of the sensor; T: (3, 3) its attitude, x at azimuth 0, z along its axis;
    elevations: (b,), azimuths: (a,) [rad], a part of those that are evenly spaced over a turn from
    0: of: the number of the first, and how many a turn has; boxes: centers, rotations, half
    extents; cylinders: (c, 5) x, y, bottom, radius, height; ground: (4,) normal and offset. Each
    body is asked only by the rays between the azimuths and elevations around it.
    """
    n_e, n_a = len(elevations), len(azimuths)
    start, whole = of
    out, hit = np.full((n_e, n_a), np.inf), np.full((n_e, n_a), -2, np.int64)
    turn = np.empty((n_a, 2))
    for a in range(n_a):
        turn[a, 0], turn[a, 1] = math.cos(azimuths[a]), math.sin(azimuths[a])
    beam = np.empty((n_e, 2))
    for e in range(n_e):
        beam[e, 0], beam[e, 1] = math.cos(elevations[e]), math.sin(elevations[e])
    over = ground[0] * origin[0] + ground[1] * origin[1] + ground[2] * origin[2]
    g = np.empty(3)
    for k in range(3):
        g[k] = ground[0] * T[0, k] + ground[1] * T[1, k] + ground[2] * T[2, k]
    for e in range(n_e):
        for a in range(n_a):
            down = beam[e, 0] * (g[0] * turn[a, 0] + g[1] * turn[a, 1]) + g[2] * beam[e, 1]
            if down < -1e-9:
                t = (ground[3] - over) / down
                if 0.0 < t < farthest:
                    out[e, a], hit[e, a] = t, -1
    c, R, h = boxes
    at, M, corners = np.empty(3), np.empty((3, 3)), np.empty((8, 3))
    for b in range(len(c)):
        # The sensor in the box's frame, and the sensor's axes in the box's.
        for i in range(3):
            at[i] = 0.0
            for x in range(3):
                at[i] += R[b, x, i] * (origin[x] - c[b, x])
            for j in range(3):
                M[i, j] = R[b, 0, i] * T[0, j] + R[b, 1, i] * T[1, j] + R[b, 2, i] * T[2, j]
        for k in range(8):
            p0 = (h[b, 0] if k & 4 else -h[b, 0]) - at[0]
            p1 = (h[b, 1] if k & 2 else -h[b, 1]) - at[1]
            p2 = (h[b, 2] if k & 1 else -h[b, 2]) - at[2]
            for j in range(3):
                corners[k, j] = M[0, j] * p0 + M[1, j] * p1 + M[2, j] * p2
        low, high, first, many = _window(corners, whole)
        for e in range(n_e):
            if not low <= elevations[e] <= high:
                continue
            z0, z1, z2 = M[0, 2] * beam[e, 1], M[1, 2] * beam[e, 1], M[2, 2] * beam[e, 1]
            for k in range(many):
                a = (first + k) % whole - start
                if not 0 <= a < n_a:
                    continue
                x, y = beam[e, 0] * turn[a, 0], beam[e, 0] * turn[a, 1]
                t = _to_box(
                    at,
                    M[0, 0] * x + M[0, 1] * y + z0,
                    M[1, 0] * x + M[1, 1] * y + z1,
                    M[2, 0] * x + M[2, 1] * y + z2,
                    h[b],
                )
                if 0.0 < t < out[e, a] and t < farthest:
                    out[e, a], hit[e, a] = t, b
    way = np.empty(3)
    for b in range(len(cylinders)):
        one = cylinders[b]
        for k in range(8):
            p0 = one[0] + (one[3] if k & 4 else -one[3]) - origin[0]
            p1 = one[1] + (one[3] if k & 2 else -one[3]) - origin[1]
            p2 = one[2] + (one[4] if k & 1 else 0.0) - origin[2]
            for j in range(3):
                corners[k, j] = T[0, j] * p0 + T[1, j] * p1 + T[2, j] * p2
        low, high, first, many = _window(corners, whole)
        for e in range(n_e):
            if not low <= elevations[e] <= high:
                continue
            for k in range(many):
                a = (first + k) % whole - start
                if not 0 <= a < n_a:
                    continue
                x, y, z = beam[e, 0] * turn[a, 0], beam[e, 0] * turn[a, 1], beam[e, 1]
                for j in range(3):
                    way[j] = T[j, 0] * x + T[j, 1] * y + T[j, 2] * z
                t = _to_cylinder(origin, way, one)
                if 0.0 < t < out[e, a] and t < farthest:
                    out[e, a], hit[e, a] = t, len(c) + b
    return out, hit


@njit(cache=True, nogil=True)
def _window(corners: Array, n_a: int) -> tuple[float, float, int, int]:
    """(lowest, highest elevation [rad], first azimuth's number, how many) of the rays that can meet
    the convex hull of corners (k, 3) in the sensor's frame.
    """
    n = len(corners)
    x0 = y0 = 0.0
    bottom, top, farthest = np.inf, -np.inf, 0.0
    for k in range(n):
        x0, y0 = x0 + corners[k, 0] / n, y0 + corners[k, 1] / n
        bottom, top = min(bottom, corners[k, 2]), max(top, corners[k, 2])
        farthest = max(farthest, math.hypot(corners[k, 0], corners[k, 1]))
    # In plan: within a circle about the middle, and within the corners' azimuths if the sensor's
    # axis does not pass through the hull, when these span less than half a turn.
    wide, left, right = 0.0, 0.0, 0.0
    middle = math.atan2(y0, x0)
    for k in range(n):
        wide = max(wide, math.hypot(corners[k, 0] - x0, corners[k, 1] - y0))
        off = math.atan2(corners[k, 1], corners[k, 0]) - middle
        off -= 2.0 * math.pi * round(off / (2.0 * math.pi))
        right, left = min(right, off), max(left, off)
    nearest = max(math.hypot(x0, y0) - wide, 0.0)
    high = math.atan2(top, nearest if top > 0.0 else farthest) + _SLACK
    low = math.atan2(bottom, nearest if bottom < 0.0 else farthest) - _SLACK
    if left - right >= math.pi - _SLACK:
        return low, high, 0, n_a
    step = 2.0 * math.pi / n_a
    first = math.ceil((middle + right - _SLACK) / step)
    many = math.floor((middle + left + _SLACK) / step) - first + 1
    return low, high, first, min(many, n_a)


@njit(cache=True, nogil=True)
def _to_box(at: Array, d0: float, d1: float, d2: float, h: Array) -> float:
    """Where the ray from `at` along d, both in the box's frame, enters it [m]; infinite when it
    does not, or starts inside.
    """
    low, high = -np.inf, np.inf
    for k in range(3):
        way = d0 if k == 0 else d1 if k == 1 else d2
        if abs(way) < 1e-12:
            if abs(at[k]) > h[k]:
                return np.inf
            continue
        t0, t1 = (-h[k] - at[k]) / way, (h[k] - at[k]) / way
        if t0 > t1:
            t0, t1 = t1, t0
        low, high = max(low, t0), min(high, t1)
    return low if 0.0 < low <= high else np.inf


@njit(cache=True, nogil=True)
def _to_cylinder(o: Array, d: Array, one: Array) -> float:
    """Where the ray enters an upright cylinder [m]; infinite when it does not."""
    x, y = o[0] - one[0], o[1] - one[1]
    a, b = d[0] * d[0] + d[1] * d[1], x * d[0] + y * d[1]
    c = x * x + y * y - one[3] * one[3]
    low, high = -np.inf, np.inf
    if a < 1e-15:
        if c > 0.0:
            return np.inf
    else:
        root = b * b - a * c
        if root < 0.0:
            return np.inf
        low, high = (-b - math.sqrt(root)) / a, (-b + math.sqrt(root)) / a
    if abs(d[2]) < 1e-12:
        if not one[2] <= o[2] <= one[2] + one[4]:
            return np.inf
    else:
        t0, t1 = (one[2] - o[2]) / d[2], (one[2] + one[4] - o[2]) / d[2]
        low, high = max(low, min(t0, t1)), min(high, max(t0, t1))
    return low if 0.0 < low <= high else np.inf
