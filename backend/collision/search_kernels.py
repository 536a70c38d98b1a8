"""Compiled search for what is closest to oriented boxes; `scene` and `server` document it."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import _nearest_in_box, pair_distance, separation
from backend.collision.fast_box_kernels import boxes_apart
from backend.collision.tree_kernels import axis_aligned, node_bound
from backend.collision.triangle_kernels import box_triangle, point_triangle, triangle_gap
from backend.spatial.types import Array, IntArray

BOXES, TRIANGLES, POINTS = 0, 1, 2
_DEEP = 64  # of the stack; a tree is never deeper than half of it


@njit(cache=True, nogil=True)
def search(
    kind: int,
    nodes: tuple[IntArray, Array, Array, int],
    items: tuple[Array, Array, Array, Array, IntArray, float],
    links: tuple[Array, Array, Array],
    reach: float,
    band: float,
    found: tuple[IntArray, IntArray, IntArray, Array, Array],
) -> None:
    """Adds the items of one tree to the lists of the closest ones of each link.

    Items nearer than `reach` [m]; a band of 0 or more is one body's, of which items within `band`
    of its closest count, one in each octant of the link; else one item of each body counts.

    items: centers (n, 3), rotations (n, 3, 3), half extents (n, 3) of boxes; corners (n, 3, 3) of
    triangles; body (n,); radius of points, whose middles are the centers. found: counts (links,),
    keys (links, k), items (links, k), distances (links, k) ascending, points (links, k, 2, 3).
    A key is 8 body + octant.
    """
    order, lows, highs, per_leaf = nodes
    if order.shape[0] == 0:
        return
    centers, rotations, halves, corners, bodies, radius = items
    cl, Rl, hl = links
    counts, keys, which, distances, points = found
    k_most = keys.shape[1]
    leaves = lows.shape[0] // 2
    stack, bounds = np.empty(_DEEP, np.int64), np.empty(_DEEP)
    around, pair, V, local = np.empty(3), np.empty((2, 3)), np.empty((3, 3)), np.empty(3)
    work, low, high, best = np.empty((11, 3)), np.empty(3), np.empty(3), np.empty(8)
    for link in range(cl.shape[0]):
        c, R, h = cl[link], Rl[link], hl[link]
        axis_aligned(R, h, around)
        limit = reach
        if counts[link] == k_most:
            limit = min(reach, max(distances[link, k_most - 1], 0.0))
        best[:] = np.inf  # of each octant
        stack[0], bounds[0] = 1, node_bound(lows[1], highs[1], c, R, h, around)
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            if bounds[top] > limit:
                continue
            if band >= 0.0:
                _sides(lows[node], highs[node], c, R, low, high)
                if bounds[top] >= _worst(low, high, best):
                    continue
            if node < leaves:
                left, right = 2 * node, 2 * node + 1
                to_left = node_bound(lows[left], highs[left], c, R, h, around)
                to_right = node_bound(lows[right], highs[right], c, R, h, around)
                first, second = (left, right) if to_left <= to_right else (right, left)
                near, far = min(to_left, to_right), max(to_left, to_right)
                if far <= limit:
                    stack[top], bounds[top] = second, far
                    top += 1
                if near <= limit:
                    stack[top], bounds[top] = first, near
                    top += 1
                continue
            begin = (node - leaves) * per_leaf
            for at in range(begin, min(begin + per_leaf, order.shape[0])):
                item = order[at]
                octant = 0
                if kind == BOXES:
                    ci, Ri, hi = centers[item], rotations[item], halves[item]
                    if _apart(c, R, h, ci, Ri, hi) > limit:
                        continue
                    gap = separation(c, R, h, ci, Ri, hi)
                    if gap > limit:
                        continue
                    if gap > 0.0:
                        distance = boxes_apart(c, R, h, ci, Ri, hi, work, pair)
                    else:
                        distance = pair_distance(c, R, h, ci, Ri, hi, pair)
                elif kind == TRIANGLES:
                    for i in range(3):
                        for k in range(3):
                            V[i, k] = 0.0
                            for x in range(3):
                                V[i, k] += R[x, k] * (corners[item, i, x] - c[x])
                    square = 0.0
                    for k in range(3):
                        low[k] = min(V[0, k], V[1, k], V[2, k])
                        high[k] = max(V[0, k], V[1, k], V[2, k])
                        square += max(low[k] - h[k], -h[k] - high[k], 0.0) ** 2
                    most = limit if band < 0.0 else min(limit, _worst(low, high, best))
                    if square > most * most or triangle_gap(V, h) > most:
                        continue
                    distance = box_triangle(V, h, pair)
                    octant = _octant(pair[0])
                    for side in range(2):
                        for k in range(3):
                            local[k] = pair[side, k]
                        for x in range(3):
                            pair[side, x] = c[x]
                            for k in range(3):
                                pair[side, x] += R[x, k] * local[k]
                else:
                    distance = np.sqrt(_nearest_in_box(centers[item], c, R, h, pair[0]))
                    for k in range(3):
                        local[k] = 0.0
                        for x in range(3):
                            local[k] += R[x, k] * (pair[0, x] - c[x])
                    octant = _octant(local)
                    share = min(radius / max(distance, 1e-300), 1.0)
                    for x in range(3):
                        pair[1, x] = centers[item, x] + share * (pair[0, x] - centers[item, x])
                    distance = max(distance - radius, 0.0)
                if distance > limit:
                    continue
                if band >= 0.0 and distance + band < limit:
                    limit = distance + band
                if band < 0.0:
                    octant = 0
                best[octant] = min(best[octant], distance)
                key = 8 * bodies[item] + octant
                _insert(link, key, item, distance, pair, counts, keys, which, distances, points)
                if band >= 0.0 and distance <= 0.0:
                    top = 0  # contact: what else is near does not matter
                    break
                if counts[link] == k_most:
                    limit = min(limit, max(distances[link, k_most - 1], 0.0))


@njit(cache=True, nogil=True)
def _apart(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array) -> float:
    """A quick lower bound of the distance of two boxes [m]: a against what surrounds b in its
    axes, and the other way round.
    """
    sum_a = sum_b = 0.0
    d0, d1, d2 = cb[0] - ca[0], cb[1] - ca[1], cb[2] - ca[2]
    for k in range(3):
        at_a = abs(Ra[0, k] * d0 + Ra[1, k] * d1 + Ra[2, k] * d2) - ha[k]
        at_b = abs(Rb[0, k] * d0 + Rb[1, k] * d1 + Rb[2, k] * d2) - hb[k]
        for o in range(3):
            at_a -= abs(Ra[0, k] * Rb[0, o] + Ra[1, k] * Rb[1, o] + Ra[2, k] * Rb[2, o]) * hb[o]
            at_b -= abs(Rb[0, k] * Ra[0, o] + Rb[1, k] * Ra[1, o] + Rb[2, k] * Ra[2, o]) * ha[o]
        if at_a > 0.0:
            sum_a += at_a * at_a
        if at_b > 0.0:
            sum_b += at_b * at_b
    return float(np.sqrt(max(sum_a, sum_b)))


@njit(cache=True, nogil=True)
def _octant(local: Array) -> int:
    octant = 0
    for k in range(3):
        if local[k] > 0.0:
            octant |= 1 << k
    return octant


@njit(cache=True, nogil=True)
def _sides(low: Array, high: Array, c: Array, R: Array, lowest: Array, highest: Array) -> None:
    """Writes what a node reaches from and to along the axes of a box, (3,) each [m]."""
    for k in range(3):
        along = wide = 0.0
        for x in range(3):
            along += R[x, k] * (0.5 * (low[x] + high[x]) - c[x])
            wide += abs(R[x, k]) * 0.5 * (high[x] - low[x])
        lowest[k], highest[k] = along - wide, along + wide


@njit(cache=True, nogil=True)
def _worst(low: Array, high: Array, best: Array) -> float:
    """The greatest of best (8,) among the octants that something from low to high is in: the
    closest point of the box is on the same side of each of its axes.
    """
    worst = 0.0
    for octant in range(8):
        inside = True
        for k in range(3):
            inside = inside and (high[k] > 0.0 if octant >> k & 1 else low[k] <= 0.0)
        if inside:
            worst = max(worst, best[octant])
    return worst


@njit(cache=True, nogil=True)
def _insert(
    link: int,
    key: int,
    item: int,
    distance: float,
    pair: Array,
    counts: IntArray,
    keys: IntArray,
    which: IntArray,
    distances: Array,
    points: Array,
) -> None:
    """Puts an item into a link's sorted list, in place of a farther one of the same key."""
    count, last = counts[link], counts[link]
    for k in range(count):
        if keys[link, k] == key:
            if distances[link, k] <= distance:
                return
            last = k
            break
    if last == count:
        if count == keys.shape[1]:
            last = count - 1
            if distances[link, last] <= distance:
                return
        else:
            counts[link] = count + 1
    at = last
    while at > 0 and distances[link, at - 1] > distance:
        keys[link, at], which[link, at] = keys[link, at - 1], which[link, at - 1]
        distances[link, at], points[link, at] = distances[link, at - 1], points[link, at - 1]
        at -= 1
    keys[link, at], which[link, at], distances[link, at] = key, item, distance
    points[link, at] = pair


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
                d = np.sqrt(_nearest_in_box(corners[i], cb, Rb, hb, near))
            else:
                d = np.sqrt(_nearest_in_box(corners[i], ca, Ra, ha, near))
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
