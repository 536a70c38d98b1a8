"""The compiled part of plan-view outlines."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray


@njit(cache=True)
def convex_hull(points: Array, order: IntArray) -> Array:
    """Andrew's monotone chain: hull (k, 2) of points (n, 2), counter-clockwise.

    order: indices that sort the points by x, then y. Two points where all lie on a line.
    """
    n = len(order)
    hull = np.empty((2 * n, 2))
    k = 0
    for turn in range(2):
        first = k
        for step in range(n):
            p = points[order[step if turn == 0 else n - 1 - step]]
            while k >= first + 2:
                ax, ay = hull[k - 1, 0] - hull[k - 2, 0], hull[k - 1, 1] - hull[k - 2, 1]
                bx, by = p[0] - hull[k - 2, 0], p[1] - hull[k - 2, 1]
                if ax * by - ay * bx > 1e-12:
                    break
                k -= 1
            hull[k] = p
            k += 1
        k -= 1  # the last point begins the other chain, or closes the hull
    return hull[:k].copy()
