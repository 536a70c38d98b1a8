"""The compiled sum of `association`: over subsets of columns, rows one after the other."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array


@njit(cache=True, nogil=True)
def exact(ratio: Array) -> Array:
    """(n, m) marginals of the assignments of rows to distinct columns or to none, weight 1.

    ahead[i, S]: the weight of all ways in which the rows before i use just the columns of S;
    behind[i, S]: of all ways in which the rows from i on use none of S. Each row's weights are
    scaled by their largest, so that nothing overflows.
    """
    n, m = ratio.shape
    sets = 1 << m
    weight, none = np.empty((n, m)), np.empty(n)
    for i in range(n):
        most = 1.0
        for j in range(m):
            most = max(most, ratio[i, j])
        none[i] = 1.0 / most
        for j in range(m):
            weight[i, j] = ratio[i, j] / most
    ahead, behind = np.zeros((n + 1, sets)), np.zeros((n + 1, sets))
    ahead[0, 0] = 1.0
    for i in range(n):
        for used in range(sets):
            w = ahead[i, used]
            if w == 0.0:
                continue
            ahead[i + 1, used] += w * none[i]
            for j in range(m):
                if not used >> j & 1 and weight[i, j] > 0.0:
                    ahead[i + 1, used | 1 << j] += w * weight[i, j]
    for used in range(sets):
        behind[n, used] = 1.0
    for i in range(n - 1, -1, -1):
        for used in range(sets):
            w = behind[i + 1, used] * none[i]
            for j in range(m):
                if not used >> j & 1 and weight[i, j] > 0.0:
                    w += behind[i + 1, used | 1 << j] * weight[i, j]
            behind[i, used] = w
    out = np.zeros((n, m))
    for i in range(n):
        for used in range(sets):
            w = ahead[i, used]
            if w == 0.0:
                continue
            for j in range(m):
                if not used >> j & 1 and weight[i, j] > 0.0:
                    out[i, j] += w * weight[i, j] * behind[i + 1, used | 1 << j]
    return out / behind[0, 0]
