"""The inner loops of the search over pieces, compiled: what of a box is far from the mesh."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray

TOUCH = 1e-3  # [m] a point this close to a box counts as inside it


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def extents(points: Array, members: IntArray, Rs: Array) -> tuple[Array, Array]:
    """low, high (m, 3) of points[members] along the columns of each of Rs (m, 3, 3)."""
    m = len(Rs)
    low, high = np.full((m, 3), np.inf), np.full((m, 3), -np.inf)
    for i in members:
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for k in range(m):
            for a in range(3):
                v = x * Rs[k, 0, a] + y * Rs[k, 1, a] + z * Rs[k, 2, a]
                low[k, a] = min(low[k, a], v)
                high[k, a] = max(high[k, a], v)
    return low, high


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def rectangles(points: Array, members: IntArray, cosines: Array, sines: Array) -> Array:
    """Areas (3, k) of the rectangles around points[members] seen along x, y, z, at each angle."""
    out = np.empty((3, len(cosines)))
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        for k in range(len(cosines)):
            c, s = cosines[k], sines[k]
            low0, high0, low1, high1 = np.inf, -np.inf, np.inf, -np.inf
            for i in members:
                p = points[i, u] * c + points[i, v] * s
                q = points[i, v] * c - points[i, u] * s
                low0, high0 = min(low0, p), max(high0, p)
                low1, high1 = min(low1, q), max(high1, q)
            out[a, k] = (high0 - low0) * (high1 - low1)
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def beyond(
    R: Array,
    low: Array,
    high: Array,
    spacing: float,
    tolerance: float,
    origin: Array,
    step: float,
    distance: Array,
) -> tuple[Array, Array]:
    """Points (m, 3) of a box's surface farther than `tolerance` from the mesh, and their cost (m,).

    The cost grows with the third power of the distance beyond the tolerance, times the area that
    the point stands for: the largest excess matters most, and everything in excess a little.
    """
    n, h = np.empty(3, np.int64), np.empty(3)
    for a in range(3):
        n[a] = max(1, int(np.ceil((high[a] - low[a]) / spacing)))
        h[a] = (high[a] - low[a]) / n[a]
    size = 0
    for a in range(3):
        size += 2 * (n[(a + 1) % 3] + 1) * (n[(a + 2) % 3] + 1)
    far, cost = np.empty((size, 3)), np.empty(size)
    count = 0
    p, index = np.empty(3), np.empty(3, np.int64)
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        area = max(h[u] * h[v], 4e-4)
        for side in range(2):
            wa = high[a] if side else low[a]
            for i in range(n[u] + 1):
                wu = low[u] + i * h[u]
                for j in range(n[v] + 1):
                    wv = low[v] + j * h[v]
                    for b in range(3):
                        p[b] = R[b, a] * wa + R[b, u] * wu + R[b, v] * wv
                        node = int((p[b] - origin[b]) / step + 0.5)
                        index[b] = min(max(node, 0), distance.shape[b] - 1)
                    d = distance[index[0], index[1], index[2]] - tolerance
                    if d > 0.0:
                        far[count] = p
                        cost[count] = (d * d * d + 2e-4 * d) * area
                        count += 1
    return far[:count].copy(), cost[:count].copy()


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def open_shares(
    Rs: Array, lows: Array, highs: Array, far: Array, cost: Array, owner: IntArray, skip: IntArray
) -> Array:
    """The cost of the far points (m, 3) that no box hides, summed by owner (k + 1,).

    owner: (m,) the box that each point belongs to, which does not hide it (k: none of these);
    skip: boxes that hide nothing.
    """
    k = len(Rs)
    out = np.zeros(k + 1)
    for i in range(len(far)):
        hidden = False
        for b in range(k):
            if b == owner[i]:
                continue
            left_out = False
            for s in skip:
                left_out = left_out or s == b
            if left_out:
                continue
            inside = True
            for a in range(3):
                w = far[i, 0] * Rs[b, 0, a] + far[i, 1] * Rs[b, 1, a] + far[i, 2] * Rs[b, 2, a]
                if w < lows[b, a] - TOUCH or w > highs[b, a] + TOUCH:
                    inside = False
                    break
            if inside:
                hidden = True
                break
        if not hidden:
            out[owner[i]] += cost[i]
    return out
