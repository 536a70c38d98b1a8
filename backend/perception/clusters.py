"""Points that belong together, seen from above.

Beams of a spinning LiDAR are far apart in height and near each other sideways, so that distance
along the ground decides: voxels nearer than `link` to each other are one cluster.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from backend.spatial.types import Array, IntArray

VOXEL = 0.1  # [m]


def cluster(points: Array, link: float = 0.4) -> IntArray:
    """(n,) number of each point's cluster, from 0. points: (n, >= 2), by x and y; link [m]."""
    if not len(points):
        return np.zeros(0, np.int64)
    cells = np.floor(points[:, :2] / VOXEL).astype(np.int64)
    cells -= cells.min(axis=0)
    key = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    _, first, of_voxel = np.unique(key, return_index=True, return_inverse=True)
    middles = np.stack(
        [np.bincount(of_voxel, points[:, k]) / np.bincount(of_voxel) for k in range(2)], axis=1
    )
    pairs = cKDTree(middles).query_pairs(link, output_type="ndarray")
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(first), len(first)))
    return np.asarray(connected_components(graph, directed=False)[1][of_voxel], dtype=np.int64)
