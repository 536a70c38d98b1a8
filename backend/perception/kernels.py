"""Compiled loops over points."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray, IntArray


@njit(cache=True, nogil=True)
def inside(points: Array, centers: Array, rotations: Array, halves: Array) -> BoolArray:
    """(n,) whether a point is in any of the boxes (k). points: (n, 3)."""
    n, k = points.shape[0], centers.shape[0]
    out = np.zeros(n, np.bool_)
    far = np.empty(k)
    for b in range(k):
        far[b] = halves[b, 0] ** 2 + halves[b, 1] ** 2 + halves[b, 2] ** 2
    for i in range(n):
        for b in range(k):
            x = points[i, 0] - centers[b, 0]
            y = points[i, 1] - centers[b, 1]
            z = points[i, 2] - centers[b, 2]
            if x * x + y * y + z * z > far[b]:
                continue
            R = rotations[b]
            if (
                abs(R[0, 0] * x + R[1, 0] * y + R[2, 0] * z) <= halves[b, 0]
                and abs(R[0, 1] * x + R[1, 1] * y + R[2, 1] * z) <= halves[b, 1]
                and abs(R[0, 2] * x + R[1, 2] * y + R[2, 2] * z) <= halves[b, 2]
            ):
                out[i] = True
                break
    return out


@njit(cache=True, nogil=True)
def scores(points: Array, triples: IntArray, tolerance: float, least_up: float) -> Array:
    """(t,) MSAC cost of the planes through triples of points: sum of min(distance, tolerance)^2.

    Planes whose normal has less than `least_up` upwards, and degenerate ones, cost infinity.
    """
    out = np.empty(len(triples))
    for t in range(len(triples)):
        a, b, c = points[triples[t, 0]], points[triples[t, 1]], points[triples[t, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length < 1e-6 or abs(nz) < least_up * length:
            out[t] = np.inf
            continue
        nx, ny, nz = nx / length, ny / length, nz / length
        cost = 0.0
        for i in range(len(points)):
            d = nx * (points[i, 0] - a[0]) + ny * (points[i, 1] - a[1]) + nz * (points[i, 2] - a[2])
            cost += min(d * d, tolerance * tolerance)
        out[t] = cost
    return out
