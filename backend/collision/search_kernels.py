"""Compiled search for what is closest to oriented boxes; `scene` and `server` document it."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import nearest_in_box, pair_distance, separation
from backend.collision.fast_box_kernels import boxes_apart
from backend.collision.kinds import BOXES, TRIANGLES
from backend.collision.tree_kernels import axis_aligned, node_bound
from backend.collision.triangle_kernels import box_triangle, triangle_gap
from backend.spatial.types import Array, IntArray

_TOUCHING = 1e-6  # closest points nearer than this give no direction [m]
_DEEP = 64  # of the stack; a tree is never deeper than half of it


@njit(cache=True)
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
        # Along the direction of the closest points so far most of what is left is seen to be
        # farther away: the gap is n . x - offset.
        n0 = n1 = n2 = offset = 0.0
        least = np.inf
        stack[0], bounds[0] = 1, node_bound(lows, highs, 1, c, R, h, around)
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            if bounds[top] > limit:
                continue
            gap = n0 * (lows[node, 0] if n0 > 0.0 else highs[node, 0]) - offset
            gap += n1 * (lows[node, 1] if n1 > 0.0 else highs[node, 1])
            gap += n2 * (lows[node, 2] if n2 > 0.0 else highs[node, 2])
            if gap > limit:
                continue
            if band >= 0.0:
                _sides(lows[node], highs[node], c, R, low, high)
                if max(bounds[top], gap) >= _worst(low, high, best):
                    continue
            if node < leaves:
                left, right = 2 * node, 2 * node + 1
                to_left = node_bound(lows, highs, left, c, R, h, around)
                to_right = node_bound(lows, highs, right, c, R, h, around)
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
                    gap = np.inf
                    for i in range(3):
                        at_n = n0 * corners[item, i, 0] + n1 * corners[item, i, 1]
                        gap = min(gap, at_n + n2 * corners[item, i, 2] - offset)
                    if gap > limit:
                        continue
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
                    if gap > most or square > most * most or triangle_gap(V, h) > most:
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
                    distance = np.sqrt(nearest_in_box(centers[item], c, R, h, pair[0]))
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
                if _TOUCHING < distance < least:
                    least = distance
                    n0 = (pair[1, 0] - pair[0, 0]) / distance
                    n1 = (pair[1, 1] - pair[0, 1]) / distance
                    n2 = (pair[1, 2] - pair[0, 2]) / distance
                    offset = n0 * c[0] + n1 * c[1] + n2 * c[2]
                    for k in range(3):
                        offset += h[k] * abs(n0 * R[0, k] + n1 * R[1, k] + n2 * R[2, k])
                key = 8 * bodies[item] + octant
                _insert(link, key, item, distance, pair, counts, keys, which, distances, points)
                if band >= 0.0 and distance <= 0.0:
                    top = 0  # contact: what else is near does not matter
                    break
                if counts[link] == k_most:
                    limit = min(limit, max(distances[link, k_most - 1], 0.0))


@njit(cache=True)
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


@njit(cache=True)
def _octant(local: Array) -> int:
    octant = 0
    for k in range(3):
        if local[k] > 0.0:
            octant |= 1 << k
    return octant


@njit(cache=True)
def _sides(low: Array, high: Array, c: Array, R: Array, lowest: Array, highest: Array) -> None:
    """Writes what a node reaches from and to along the axes of a box, (3,) each [m]."""
    for k in range(3):
        along = wide = 0.0
        for x in range(3):
            along += R[x, k] * (0.5 * (low[x] + high[x]) - c[x])
            wide += abs(R[x, k]) * 0.5 * (high[x] - low[x])
        lowest[k], highest[k] = along - wide, along + wide


@njit(cache=True)
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


@njit(cache=True)
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
