"""Compiled loops over pairs of oriented boxes; `box_distance` documents and wraps them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.collision.fast_box_kernels import boxes_apart
from backend.spatial.types import Array, IntArray

_NO_AXIS = 1e-9  # length below which a crossed axis gives no direction


@njit(cache=True)
def lower_bound(
    ca: Array, Ra: Array, ha: Array, i: int, cb: Array, Rb: Array, hb: Array, j: int
) -> float:
    """Lower bound of the distance of a's i-th box and b's j-th [m], 0 where no face parts them.

    Each box against the other's bounding box in its own frame, the larger of both.
    """
    x, y, z = cb[j, 0] - ca[i, 0], cb[j, 1] - ca[i, 1], cb[j, 2] - ca[i, 2]
    wide_0, wide_1, wide_2 = hb[j, 0], hb[j, 1], hb[j, 2]  # of both, along the axes of b
    sum_a = sum_b = 0.0
    for k in range(3):
        u, v, w, half = Ra[i, 0, k], Ra[i, 1, k], Ra[i, 2, k], ha[i, k]
        dot_0 = abs(u * Rb[j, 0, 0] + v * Rb[j, 1, 0] + w * Rb[j, 2, 0])
        dot_1 = abs(u * Rb[j, 0, 1] + v * Rb[j, 1, 1] + w * Rb[j, 2, 1])
        dot_2 = abs(u * Rb[j, 0, 2] + v * Rb[j, 1, 2] + w * Rb[j, 2, 2])
        wide_0, wide_1, wide_2 = wide_0 + dot_0 * half, wide_1 + dot_1 * half, wide_2 + dot_2 * half
        wide = half + dot_0 * hb[j, 0] + dot_1 * hb[j, 1] + dot_2 * hb[j, 2]
        sum_a += max(abs(u * x + v * y + w * z) - wide, 0.0) ** 2
    for k in range(3):
        wide = wide_0 if k == 0 else (wide_1 if k == 1 else wide_2)
        along = Rb[j, 0, k] * x + Rb[j, 1, k] * y + Rb[j, 2, k] * z
        sum_b += max(abs(along) - wide, 0.0) ** 2
    return np.sqrt(max(sum_a, sum_b))


@njit(cache=True)
def lower_bounds(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array) -> Array:
    """(n, m) `lower_bound` of all pairs [m]."""
    n, m = ca.shape[0], cb.shape[0]
    bound = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            bound[i, j] = lower_bound(ca, Ra, ha, i, cb, Rb, hb, j)
    return bound


@njit(cache=True)
def separation(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array) -> float:
    """Largest gap of two boxes along the 15 separating axes [m]; negative on overlap."""
    best = -np.inf
    axis = np.empty(3)
    for first in range(4):
        for second in range(4):
            if first == 3 and second == 3:
                continue
            if second == 3:
                for x in range(3):
                    axis[x] = Ra[x, first]
            elif first == 3:
                for x in range(3):
                    axis[x] = Rb[x, second]
            else:
                for x in range(3):
                    y, z = (x + 1) % 3, (x + 2) % 3
                    axis[x] = Ra[y, first] * Rb[z, second] - Ra[z, first] * Rb[y, second]
            length = np.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
            # Parallel edges give no axis of their own; the face axes already cover them.
            if length < _NO_AXIS:
                continue
            apart = 0.0
            for x in range(3):
                apart += axis[x] * (cb[x] - ca[x])
            gap = abs(apart)
            for k in range(3):
                along_a = along_b = 0.0
                for x in range(3):
                    along_a += axis[x] * Ra[x, k]
                    along_b += axis[x] * Rb[x, k]
                gap -= abs(along_a) * ha[k] + abs(along_b) * hb[k]
            best = max(best, gap / length)
    return best


@njit(cache=True)
def separations(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array) -> Array:
    """`separation` of the k-th boxes of both sets: (k,) [m]."""
    gaps = np.empty(ca.shape[0])
    for k in range(ca.shape[0]):
        gaps[k] = separation(ca[k], Ra[k], ha[k], cb[k], Rb[k], hb[k])
    return gaps


@njit(cache=True)
def nearest_in_box(p: Array, c: Array, R: Array, h: Array, out: Array) -> float:
    """Writes the point of a box nearest to p; returns the squared distance [m^2]."""
    local = np.empty(3)
    for k in range(3):
        value = 0.0
        for x in range(3):
            value += R[x, k] * (p[x] - c[x])
        local[k] = min(max(value, -h[k]), h[k])
    square = 0.0
    for x in range(3):
        out[x] = c[x] + R[x, 0] * local[0] + R[x, 1] * local[1] + R[x, 2] * local[2]
        square += (out[x] - p[x]) ** 2
    return square


@njit(cache=True)
def pair_distance(
    ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array, points: Array
) -> float:
    """Distance of two boxes [m], writing the closest points (2, 3); negative on overlap."""
    gap = separation(ca, Ra, ha, cb, Rb, hb)
    if gap <= 0.0:
        middle = 0.5 * (ca + cb)
        in_a, in_b = np.empty(3), np.empty(3)
        nearest_in_box(middle, ca, Ra, ha, in_a)
        nearest_in_box(middle, cb, Rb, hb, in_b)
        for x in range(3):
            points[0, x] = points[1, x] = 0.5 * (in_a[x] + in_b[x])
        return gap
    return boxes_apart(ca, Ra, ha, cb, Rb, hb, np.empty((11, 3)), points)


@njit(cache=True)
def distances(
    ca: Array,
    Ra: Array,
    ha: Array,
    cb: Array,
    Rb: Array,
    hb: Array,
    index_a: IntArray,
    index_b: IntArray,
) -> tuple[Array, Array]:
    """Distances (k,) and closest points (k, 2, 3) of the pairs (index_a[k], index_b[k]) [m]."""
    count = index_a.shape[0]
    found = np.empty(count)
    points = np.empty((count, 2, 3))
    for k in range(count):
        i, j = index_a[k], index_b[k]
        found[k] = pair_distance(ca[i], Ra[i], ha[i], cb[j], Rb[j], hb[j], points[k])
    return found, points


@njit(cache=True)
def near_point(
    centers: Array, rotations: Array, halves: Array, point: Array, radius: float
) -> IntArray:
    """(k,) the boxes that come to a point (3,) as near as `radius` [m]."""
    found, count = np.empty(len(centers), np.int64), 0
    for i in range(len(centers)):
        x, y, z = point[0] - centers[i, 0], point[1] - centers[i, 1], point[2] - centers[i, 2]
        h = halves[i]
        size = math.sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2])
        if x * x + y * y + z * z > (radius + size) ** 2:
            continue
        apart = 0.0
        for a in range(3):
            along = rotations[i, 0, a] * x + rotations[i, 1, a] * y + rotations[i, 2, a] * z
            apart += max(abs(along) - h[a], 0.0) ** 2
        if apart <= radius * radius:
            found[count] = i
            count += 1
    return found[:count].copy()
