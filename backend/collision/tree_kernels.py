"""Compiled loops of `tree`: order along a space-filling curve, and the boxes of a binary tree."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import AnyArray, Array, IntArray


@njit(cache=True, nogil=True)
def codes(low: Array, high: Array) -> AnyArray:
    """(n,) uint64: place of each box's middle along Morton's curve, ten bits an axis, then its
    index in the lower 32 bits.
    """
    n = low.shape[0]
    first, last = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(n):
        for x in range(3):
            middle = 0.5 * (low[i, x] + high[i, x])
            first[x] = min(first[x], middle)
            last[x] = max(last[x], middle)
    scale = np.empty(3)
    for x in range(3):
        scale[x] = 1023.0 / max(last[x] - first[x], 1e-12)
    out = np.empty(n, np.uint64)
    for i in range(n):
        code = 0
        for x in range(3):
            v = int((0.5 * (low[i, x] + high[i, x]) - first[x]) * scale[x])
            v = (v | (v << 16)) & 0x030000FF
            v = (v | (v << 8)) & 0x0300F00F
            v = (v | (v << 4)) & 0x030C30C3
            v = (v | (v << 2)) & 0x09249249
            code |= v << x
        out[i] = np.uint64(code << 32 | i)
    return out


@njit(cache=True, nogil=True)
def node_boxes(
    low: Array, high: Array, order: IntArray, per_leaf: int, leaves: int
) -> tuple[Array, Array]:
    """Lows and highs (2 leaves, 3) of all nodes; the root is 1, k has the children 2 k and 2 k + 1.

    Leaf k holds order[k per_leaf : (k + 1) per_leaf]. Empty nodes are from +inf to -inf.
    """
    n = order.shape[0]
    lows, highs = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    for at in range(n):
        node, i = leaves + at // per_leaf, order[at]
        for x in range(3):
            lows[node, x] = min(lows[node, x], low[i, x])
            highs[node, x] = max(highs[node, x], high[i, x])
    for node in range(leaves - 1, 0, -1):
        for x in range(3):
            lows[node, x] = min(lows[2 * node, x], lows[2 * node + 1, x])
            highs[node, x] = max(highs[2 * node, x], highs[2 * node + 1, x])
    return lows, highs


@njit(cache=True, nogil=True)
def axis_aligned(R: Array, h: Array, out: Array) -> None:
    """Writes the half sizes (3,) of the axis-aligned box around an oriented one."""
    for x in range(3):
        out[x] = abs(R[x, 0]) * h[0] + abs(R[x, 1]) * h[1] + abs(R[x, 2]) * h[2]


@njit(cache=True, nogil=True)
def node_bound(
    lows: Array, highs: Array, node: int, c: Array, R: Array, h: Array, around: Array
) -> float:
    """Lower bound of the distance of a node to an oriented box [m]; infinite for empty nodes.

    around: (3,) of `axis_aligned`. The larger of the distances in the site's and the box's axes.
    """
    if lows[node, 0] > highs[node, 0]:
        return np.inf
    w0 = 0.5 * (highs[node, 0] - lows[node, 0])
    w1 = 0.5 * (highs[node, 1] - lows[node, 1])
    w2 = 0.5 * (highs[node, 2] - lows[node, 2])
    d0, d1, d2 = lows[node, 0] + w0 - c[0], lows[node, 1] + w1 - c[1], lows[node, 2] + w2 - c[2]
    g0 = max(abs(d0) - w0 - around[0], 0.0)
    g1 = max(abs(d1) - w1 - around[1], 0.0)
    g2 = max(abs(d2) - w2 - around[2], 0.0)
    outer = g0 * g0 + g1 * g1 + g2 * g2
    inner = 0.0
    for k in range(3):
        r0, r1, r2 = R[0, k], R[1, k], R[2, k]
        along = abs(r0 * d0 + r1 * d1 + r2 * d2)
        gap = max(along - abs(r0) * w0 - abs(r1) * w1 - abs(r2) * w2 - h[k], 0.0)
        inner += gap * gap
    return float(np.sqrt(max(outer, inner)))
