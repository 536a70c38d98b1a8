"""Compiled loops over corners that are about as near as the closest points; see `server`."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import nearest_in_box
from backend.collision.kinds import TRIANGLES
from backend.collision.triangle_kernels import point_triangle
from backend.spatial.types import Array, IntArray

_DEEP = 64  # of the stack; a tree is never deeper than half of it


@njit(cache=True, nogil=True)
def corner_rows(
    corners: Array,
    limits: Array,
    kind: int,
    nodes: tuple[IntArray, Array, Array, int],
    items: tuple[Array, Array, Array, Array, IntArray, float],
    distance: Array,
    item: IntArray,
    point: Array,
) -> None:
    """The triangle or point nearest to each corner (m, 3), where it is nearer than limits (m,).

    Writes distance (m,), item (m,), point (m, 3) where it is nearer than what stands there.
    """
    order, lows, highs, per_leaf = nodes
    if order.shape[0] == 0:
        return
    centers, radius = items[0], items[5]
    leaves = lows.shape[0] // 2
    stack, near = np.empty(_DEEP, np.int64), np.empty(3)
    for m in range(corners.shape[0]):
        p = corners[m]
        limit = min(limits[m], distance[m])
        stack[0], top = 1, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if _to_node(p, lows[node], highs[node]) > limit:
                continue
            if node < leaves:
                left = _to_node(p, lows[2 * node], highs[2 * node])
                right = _to_node(p, lows[2 * node + 1], highs[2 * node + 1])
                first = 0 if left <= right else 1
                stack[top], stack[top + 1] = 2 * node + 1 - first, 2 * node + first
                top += 2
                continue
            begin = (node - leaves) * per_leaf
            for at in range(begin, min(begin + per_leaf, order.shape[0])):
                i = order[at]
                if kind == TRIANGLES:
                    d = np.sqrt(point_triangle(p, items[3][i], near))
                else:
                    d = 0.0
                    for x in range(3):
                        d += (centers[i, x] - p[x]) ** 2
                    d = np.sqrt(d)
                    share = min(radius / max(d, 1e-300), 1.0)
                    for x in range(3):
                        near[x] = centers[i, x] + share * (p[x] - centers[i, x])
                    d = max(d - radius, 0.0)
                if d <= limit:
                    limit = distance[m] = d
                    item[m] = i
                    point[m] = near


@njit(cache=True, nogil=True)
def _to_node(p: Array, low: Array, high: Array) -> float:
    if low[0] > high[0]:
        return np.inf
    square = 0.0
    for x in range(3):
        square += max(low[x] - p[x], p[x] - high[x], 0.0) ** 2
    return float(np.sqrt(square))


@njit(cache=True, nogil=True)
def box_corners(c: Array, R: Array, h: Array, out: Array) -> None:
    """Writes the corners (8, 3) of a box; bit k of the index is the sign along its axis k."""
    for i in range(8):
        for x in range(3):
            out[i, x] = c[x]
            for k in range(3):
                out[i, x] += R[x, k] * (h[k] if i >> k & 1 else -h[k])


@njit(cache=True, nogil=True)
def patch(
    link: tuple[Array, Array, Array],
    other: tuple[Array, Array, Array],
    least: float,
    band: float,
    features: IntArray,
    distances: Array,
    points: Array,
) -> int:
    """The corners of two separated boxes that are at most `band` farther apart than `least` [m].

    Writes features (16,), distances (16,), points (16, 2, 3) and returns their number. Features 0-7
    are the link's corners with the nearest point of the other box, 8-15 the other one's corners.
    """
    ca, Ra, ha = link
    cb, Rb, hb = other
    corners, near = np.empty((8, 3)), np.empty(3)
    count = 0
    for side in range(2):
        if side == 0:
            box_corners(ca, Ra, ha, corners)
        else:
            box_corners(cb, Rb, hb, corners)
        for i in range(8):
            if side == 0:
                d = np.sqrt(nearest_in_box(corners[i], cb, Rb, hb, near))
            else:
                d = np.sqrt(nearest_in_box(corners[i], ca, Ra, ha, near))
            if d > least + band:
                continue
            features[count], distances[count] = i + 8 * side, d
            points[count, side], points[count, 1 - side] = corners[i], near
            count += 1
    return count


@njit(cache=True, nogil=True)
def patches(
    links: tuple[Array, Array, Array],
    boxes: tuple[Array, Array, Array],
    rows: tuple[IntArray, IntArray, Array],
    band: float,
) -> tuple[IntArray, IntArray, Array, Array]:
    """`patch` of the pairs rows (link (r,), box (r,), distance (r,)): the number of the row, the
    feature, the distance and the points of every corner found.

    The row of a pair whose closest points are a corner's is left to that corner.
    """
    link, box, least = rows
    most = 16 * link.shape[0]
    row, feature = np.empty(most, np.int64), np.empty(most, np.int64)
    distance, points = np.empty(most), np.empty((most, 2, 3))
    count = 0
    for r in range(link.shape[0]):
        i, j = link[r], box[r]
        found = patch(
            (links[0][i], links[1][i], links[2][i]),
            (boxes[0][j], boxes[1][j], boxes[2][j]),
            least[r],
            band,
            feature[count:],
            distance[count:],
            points[count:],
        )
        row[count : count + found] = r
        count += found
    return row[:count].copy(), feature[:count].copy(), distance[:count].copy(), points[:count]
