"""The compiled sums of `association`: of each cluster, over subsets or by belief propagation."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray, IntArray

CONVERGED = 1e-9
MOST_ROUNDS = 200


@njit(cache=True, nogil=True)
def parts(gated: BoolArray) -> tuple[IntArray, IntArray, int]:
    """Which cluster each row (n,) and column (m,) is in, -1 for none, and how many there are."""
    n, m = gated.shape
    of_row, of_column = np.full(n, -1), np.full(m, -1)
    waiting, count = np.empty(n, np.int64), 0
    for first in range(n):
        if of_row[first] >= 0 or not gated[first].any():
            continue
        of_row[first], waiting[0], left = count, first, 1
        while left:
            left -= 1
            i = waiting[left]
            for j in range(m):
                if gated[i, j] and of_column[j] < 0:
                    of_column[j] = count
                    for k in range(n):
                        if gated[k, j] and of_row[k] < 0:
                            of_row[k], waiting[left] = count, k
                            left += 1
        count += 1
    return of_row, of_column, count


@njit(cache=True, nogil=True)
def shares(ratio: Array, largest_exact: int) -> tuple[Array, bool]:
    """(n, m) probabilities of all clusters, and whether one was too large for an exact sum."""
    of_row, of_column, count = parts(ratio > 0.0)
    out, approximated = np.zeros(ratio.shape), False
    for c in range(count):
        rows, columns = np.flatnonzero(of_row == c), np.flatnonzero(of_column == c)
        part = np.empty((len(rows), len(columns)))
        for a in range(len(rows)):
            for b in range(len(columns)):
                part[a, b] = ratio[rows[a], columns[b]]
        if part.size == 1:
            found = part / (1.0 + part)
        elif min(part.shape) > largest_exact:
            found, approximated = passed(part), True
        elif len(columns) <= len(rows):
            found = exact(part)
        else:
            found = exact(part.T.copy()).T.copy()
        for a in range(len(rows)):
            for b in range(len(columns)):
                out[rows[a], columns[b]] = found[a, b]
    return out, approximated


@njit(cache=True, nogil=True)
def passed(ratio: Array) -> Array:
    """(n, m) by messages between rows and columns, until they no longer change."""
    n, m = ratio.shape
    to_row, to_column, out = np.ones((n, m)), np.empty((n, m)), np.empty((n, m))
    for _ in range(MOST_ROUNDS):
        for i in range(n):
            total = 1.0
            for j in range(m):
                total += ratio[i, j] * to_row[i, j]
            for j in range(m):
                to_column[i, j] = ratio[i, j] / (total - ratio[i, j] * to_row[i, j])
        most = 0.0
        for j in range(m):
            total = 0.0
            for i in range(n):
                total += to_column[i, j]
            for i in range(n):
                message = 1.0 / (1.0 + max(total - to_column[i, j], 0.0))
                most = max(most, abs(message - to_row[i, j]))
                to_row[i, j] = message
        if most < CONVERGED:
            break
    for i in range(n):
        total = 1.0
        for j in range(m):
            total += ratio[i, j] * to_row[i, j]
        for j in range(m):
            out[i, j] = ratio[i, j] * to_row[i, j] / total
    return out


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
