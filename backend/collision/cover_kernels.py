"""Compiled loops of `cover`: near boxes one by one, far ones by the tree's nodes."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.tree_kernels import axis_aligned, node_bound
from backend.spatial.types import Array, IntArray

_DEEP = 64  # of the stack; a tree is never deeper than half of it


@njit(cache=True, nogil=True)
def cover(
    nodes: tuple[IntArray, Array, Array, int],
    around: tuple[Array, Array, Array],
    reach: float,
    near: float,
    grain: float,
) -> tuple[IntArray, IntArray, IntArray]:
    """(item or node, first item of a node, how many it has; 0 for an item) of all that is within
    `reach` [m] of any box `around`.

    A node stands for its items where it is farther than `near` [m] and than `grain` times its size.
    """
    order, lows, highs, per_leaf = nodes
    ca, Ra, ha = around
    n, leaves = order.shape[0], lows.shape[0] // 2
    index, begin = np.empty(max(n, 1), np.int64), np.zeros(max(n, 1), np.int64)
    many = np.zeros(max(n, 1), np.int64)
    wide = np.empty((ca.shape[0], 3))
    for i in range(ca.shape[0]):
        axis_aligned(Ra[i], ha[i], wide[i])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)  # of all together
    for i in range(ca.shape[0]):
        for x in range(3):
            low[x], high[x] = (
                min(low[x], ca[i, x] - wide[i, x]),
                max(high[x], ca[i, x] + wide[i, x]),
            )
    stack = np.empty(_DEEP, np.int64)
    stack[0], top, count = 1, 1, 0
    while top > 0 and n > 0:
        top -= 1
        node = stack[top]
        square = 0.0
        for x in range(3):
            square += max(lows[node, x] - high[x], low[x] - highs[node, x], 0.0) ** 2
        if not square <= reach * reach:
            continue
        gap = np.inf
        for i in range(ca.shape[0]):
            gap = min(gap, node_bound(lows, highs, node, ca[i], Ra[i], ha[i], wide[i]))
        if not gap <= reach:
            continue
        size = 0.0
        for x in range(3):
            size += (highs[node, x] - lows[node, x]) ** 2
        first, last = items_of(node, leaves, per_leaf, n)
        if last - first > 1 and gap > near and gap > grain * np.sqrt(size):
            index[count], begin[count], many[count] = node, order[first], last - first
            count += 1
        elif node < leaves:
            stack[top], stack[top + 1] = 2 * node + 1, 2 * node
            top += 2
        else:
            for at in range(first, last):
                index[count] = order[at]
                count += 1
    return index[:count].copy(), begin[:count].copy(), many[:count].copy()


@njit(cache=True, nogil=True)
def items_of(node: int, leaves: int, per_leaf: int, n: int) -> tuple[int, int]:
    """Where in the order the items of a node begin and end."""
    first, last = node, node + 1
    while first < leaves:
        first, last = 2 * first, 2 * last
    return min((first - leaves) * per_leaf, n), min((last - leaves) * per_leaf, n)
