"""Rays against boxes, upright cylinders and a ground plane, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray


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
) -> tuple[Array, IntArray]:
    """(range (b, a) [m], infinite without an echo; hit (b, a): -2 nothing, -1 ground, a box's
    number, after the boxes a cylinder's).

    origin: (3,) of the sensor; T: (3, 3) its attitude, x at azimuth 0, z along its axis;
    elevations: (b,), azimuths: (a,) [rad], evenly spaced over a turn from 0; boxes: centers,
    rotations, half extents; cylinders: (c, 5) x, y, bottom, radius, height; ground: (4,) normal and
    offset. Each body is asked only by the rays in the cone around it.
    """
    n_e, n_a = len(elevations), len(azimuths)
    out, hit = np.full((n_e, n_a), np.inf), np.full((n_e, n_a), -2, np.int64)
    step = 2.0 * math.pi / n_a
    ways = np.empty((n_e, n_a, 3))
    for e in range(n_e):
        ce, se = math.cos(elevations[e]), math.sin(elevations[e])
        for a in range(n_a):
            x, y = ce * math.cos(azimuths[a]), ce * math.sin(azimuths[a])
            for k in range(3):
                ways[e, a, k] = T[k, 0] * x + T[k, 1] * y + T[k, 2] * se
            down = ground[0] * ways[e, a, 0] + ground[1] * ways[e, a, 1] + ground[2] * ways[e, a, 2]
            if down < -1e-9:
                over = ground[0] * origin[0] + ground[1] * origin[1] + ground[2] * origin[2]
                t = (ground[3] - over) / down
                if 0.0 < t < farthest:
                    out[e, a], hit[e, a] = t, -1
    c, R, h = boxes
    count = len(c)
    for b in range(count + len(cylinders)):
        if b < count:
            x0, y0, z0 = c[b, 0], c[b, 1], c[b, 2]
            radius = math.sqrt(h[b, 0] ** 2 + h[b, 1] ** 2 + h[b, 2] ** 2)
        else:
            one = cylinders[b - count]
            x0, y0, z0 = one[0], one[1], one[2] + 0.5 * one[4]
            radius = math.sqrt(one[3] ** 2 + 0.25 * one[4] ** 2)
        x, y, z = x0 - origin[0], y0 - origin[1], z0 - origin[2]
        far = math.sqrt(x * x + y * y + z * z)
        if far - radius > farthest:
            continue
        # In the sensor's own frame: which azimuths can meet it.
        sx, sy = T[0, 0] * x + T[1, 0] * y + T[2, 0] * z, T[0, 1] * x + T[1, 1] * y + T[2, 1] * z
        flat = math.sqrt(sx * sx + sy * sy)
        first, many = 0, n_a
        if flat > radius * 1.0001:
            half = math.asin(min(radius / flat, 1.0)) + step
            first = math.floor((math.atan2(sy, sx) - half) / step)
            many = min(n_a, math.ceil(2.0 * half / step) + 1)
        for e in range(n_e):
            for k in range(many):
                a = (first + k) % n_a
                if b < count:
                    t = _to_box(origin, ways[e, a], c[b], R[b], h[b])
                else:
                    t = _to_cylinder(origin, ways[e, a], cylinders[b - count])
                if 0.0 < t < out[e, a] and t < farthest:
                    out[e, a], hit[e, a] = t, b
    return out, hit


@njit(cache=True, nogil=True)
def _to_box(o: Array, d: Array, c: Array, R: Array, h: Array) -> float:
    """Where the ray enters the box [m]; infinite when it does not, or starts inside."""
    low, high = -np.inf, np.inf
    for k in range(3):
        at = way = 0.0
        for x in range(3):
            at += R[x, k] * (o[x] - c[x])
            way += R[x, k] * d[x]
        if abs(way) < 1e-12:
            if abs(at) > h[k]:
                return np.inf
            continue
        t0, t1 = (-h[k] - at) / way, (h[k] - at) / way
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
