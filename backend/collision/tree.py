"""A tree of axis-aligned boxes over many items, built in one pass so that clouds can be renewed.

Items are put in order along Morton's curve and filled into the leaves of a complete binary tree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.collision import tree_kernels
from backend.spatial.types import Array, IntArray


@dataclass(frozen=True)
class Tree:
    """order: (n,) items, leaf by leaf; lows, highs: (2 leaves, 3) boxes of all nodes, the root at
    1, the children of k at 2 k and 2 k + 1 [m]; per_leaf: items in each leaf.
    """

    order: IntArray
    lows: Array
    highs: Array
    per_leaf: int

    @property
    def arrays(self) -> tuple[IntArray, Array, Array, int]:
        """What the kernels take."""
        return self.order, self.lows, self.highs, self.per_leaf


def tree(low: Array, high: Array, per_leaf: int = 4) -> Tree:
    """The tree of n boxes from low to high, (n, 3) each [m]."""
    return _filled(low, high, curve_order(low, high), per_leaf)


def tree_of_points(points: Array, radius: float, per_leaf: int = 16) -> Tree:
    """The tree of points that are in `curve_order` already. radius: of each [m]."""
    order = np.arange(len(points))
    held = _filled(points, points, order, per_leaf)
    return Tree(order, held.lows - radius, held.highs + radius, per_leaf)


def curve_order(low: Array, high: Array) -> IntArray:
    """(n,) the boxes from low to high, (n, 3) each, in order along Morton's curve."""
    # One number for place and index sorts faster than an index by place.
    packed = tree_kernels.codes(low, high)
    packed.sort()
    return np.asarray(packed & np.uint64(0xFFFFFFFF), dtype=np.int64)


def _filled(low: Array, high: Array, order: IntArray, per_leaf: int) -> Tree:
    leaves = 1
    while leaves * per_leaf < len(order):
        leaves *= 2
    lows, highs = tree_kernels.node_boxes(low, high, order, per_leaf, leaves)
    return Tree(order, lows, highs, per_leaf)
