"""A plane between two boxes, compiled: what lies on either side of it stays exact under motion."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import pair_distance
from backend.spatial.types import Array

_NO_AXIS = 1e-9  # length below which a crossed axis gives no direction
_TOUCHING = 1e-6  # closest points nearer than this give no direction [m]


@njit(cache=True, nogil=True)
def separating_plane(
    ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array, near: float, normal: Array
) -> float:
    """The gap of two boxes along `normal`, which is written: (3,) unit, from b to a [m].

    Of the 15 separating axes the one with the largest gap, a lower bound of the distance; for gaps
    of less than `near` [m] the direction of the closest points, where the gap is the distance.
    Negative on overlap.
    """
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
            if length < _NO_AXIS:
                continue
            apart = 0.0
            for x in range(3):
                apart += axis[x] * (ca[x] - cb[x])
            gap = abs(apart)
            for k in range(3):
                along_a = along_b = 0.0
                for x in range(3):
                    along_a += axis[x] * Ra[x, k]
                    along_b += axis[x] * Rb[x, k]
                gap -= abs(along_a) * ha[k] + abs(along_b) * hb[k]
            gap /= length
            if gap > best:
                best = gap
                sign = 1.0 if apart >= 0.0 else -1.0
                for x in range(3):
                    normal[x] = sign * axis[x] / length
    if 0.0 < best < near:
        points = np.empty((2, 3))
        distance = pair_distance(ca, Ra, ha, cb, Rb, hb, points)
        if distance > _TOUCHING:
            best = distance
            for x in range(3):
                normal[x] = (points[0, x] - points[1, x]) / distance
    return best
