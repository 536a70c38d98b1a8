"""Exact distance of an oriented box and a triangle, compiled, by enumerating their features.

As for two boxes: the closest points of separated convex polyhedra lie on a vertex and a face, or on
two edges. All is in the box's own axes, where it reaches from -h to h.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array

_NO_AXIS = 1e-24  # squared length below which a crossed axis gives no direction


@njit(cache=True, nogil=True)
def triangle_gap(V: Array, h: Array) -> float:
    """Largest gap of a box and a triangle V (3, 3) along 13 separating axes [m]; a lower bound of
    the distance where it is positive, and at most 0 where they touch.
    """
    best = -np.inf
    for k in range(3):
        low = min(V[0, k], V[1, k], V[2, k])
        high = max(V[0, k], V[1, k], V[2, k])
        best = max(best, low - h[k], -h[k] - high)
    E = np.empty((3, 3))
    for i in range(3):
        for x in range(3):
            E[i, x] = V[(i + 1) % 3, x] - V[i, x]
    axis = np.empty(3)
    for which in range(10):
        if which == 9:
            for x in range(3):
                y, z = (x + 1) % 3, (x + 2) % 3
                axis[x] = E[0, y] * E[1, z] - E[0, z] * E[1, y]
        else:
            edge, k = which // 3, which % 3
            y, z = (k + 1) % 3, (k + 2) % 3
            axis[k], axis[y], axis[z] = 0.0, -E[edge, z], E[edge, y]
        square = axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2
        if square < _NO_AXIS:
            continue
        low, high = np.inf, -np.inf
        for i in range(3):
            at = axis[0] * V[i, 0] + axis[1] * V[i, 1] + axis[2] * V[i, 2]
            low, high = min(low, at), max(high, at)
        wide = abs(axis[0]) * h[0] + abs(axis[1]) * h[1] + abs(axis[2]) * h[2]
        best = max(best, (low - wide) / np.sqrt(square), (-wide - high) / np.sqrt(square))
    return best


@njit(cache=True, nogil=True)
def point_triangle(p: Array, V: Array, out: Array) -> float:
    """Writes the point of a triangle V (3, 3) nearest to p; returns the squared distance [m^2].

    Where p lies over the triangle's inside it is the foot on its plane, else on one of its edges.
    """
    ab, ac, ap = np.empty(3), np.empty(3), np.empty(3)
    for x in range(3):
        ab[x], ac[x], ap[x] = V[1, x] - V[0, x], V[2, x] - V[0, x], p[x] - V[0, x]
    bb = ab[0] ** 2 + ab[1] ** 2 + ab[2] ** 2
    cc = ac[0] ** 2 + ac[1] ** 2 + ac[2] ** 2
    bc = ab[0] * ac[0] + ab[1] * ac[1] + ab[2] * ac[2]
    bp = ab[0] * ap[0] + ab[1] * ap[1] + ab[2] * ap[2]
    cp = ac[0] * ap[0] + ac[1] * ap[1] + ac[2] * ap[2]
    det = bb * cc - bc * bc
    best = np.inf
    if det > 1e-12 * bb * cc:
        v, w = (cc * bp - bc * cp) / det, (bb * cp - bc * bp) / det
        if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
            best = 0.0
            for x in range(3):
                out[x] = V[0, x] + v * ab[x] + w * ac[x]
                best += (p[x] - out[x]) ** 2
            return best
    for i in range(3):
        j = (i + 1) % 3
        along = square = 0.0
        for x in range(3):
            along += (p[x] - V[i, x]) * (V[j, x] - V[i, x])
            square += (V[j, x] - V[i, x]) ** 2
        t = min(max(along / max(square, 1e-300), 0.0), 1.0)
        d = 0.0
        for x in range(3):
            d += (p[x] - V[i, x] - t * (V[j, x] - V[i, x])) ** 2
        if d < best:
            best = d
            for x in range(3):
                out[x] = V[i, x] + t * (V[j, x] - V[i, x])
    return best


@njit(cache=True, nogil=True)
def edge_edge(h: Array, k: int, sy: float, sz: float, p: Array, u: Array, out: Array) -> float:
    """Writes the closest points (2, 3) of the box's edge along axis k and a segment p + t u.

    sy, sz: signs of the edge along the two following axes. Returns the squared distance [m^2].
    """
    y, z = (k + 1) % 3, (k + 2) % 3
    oy, oz = sy * h[y], sz * h[z]
    # Across the edge the segment is nearest to it at t; clamping either end is tried after.
    uu = u[0] ** 2 + u[1] ** 2 + u[2] ** 2
    across = u[y] ** 2 + u[z] ** 2
    t = 0.0
    if across > 1e-12 * uu:
        t = min(max(-((p[y] - oy) * u[y] + (p[z] - oz) * u[z]) / across, 0.0), 1.0)
    s = min(max(p[k] + t * u[k], -h[k]), h[k])
    # s may have been clamped: the best t for it, and the best s for that.
    ahead = (s - p[k]) * u[k] + (oy - p[y]) * u[y] + (oz - p[z]) * u[z]
    t = min(max(ahead / max(uu, 1e-300), 0.0), 1.0)
    s = min(max(p[k] + t * u[k], -h[k]), h[k])
    out[0, k], out[0, y], out[0, z] = s, oy, oz
    square = 0.0
    for x in range(3):
        out[1, x] = p[x] + t * u[x]
        square += (out[1, x] - out[0, x]) ** 2
    return square


@njit(cache=True, nogil=True)
def box_triangle(V: Array, h: Array, points: Array) -> float:
    """Distance of a box and a triangle V (3, 3), 0 where they touch, writing the closest points
    (2, 3), on the box and on the triangle; all in the box's axes [m].
    """
    near = np.empty(3)
    if triangle_gap(V, h) <= 0.0:
        for x in range(3):  # the triangle's point nearest to the middle, held into the box
            near[x] = 0.0
        point_triangle(near, V, points[1])
        for x in range(3):
            points[0, x] = min(max(points[1, x], -h[x]), h[x])
            points[1, x] = points[0, x]
        return 0.0
    best = np.inf
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(3):
        square = 0.0
        for x in range(3):
            low[x], high[x] = min(low[x], V[i, x]), max(high[x], V[i, x])
            square += (V[i, x] - min(max(V[i, x], -h[x]), h[x])) ** 2
        if square < best:
            best = square
            for x in range(3):
                points[0, x], points[1, x] = min(max(V[i, x], -h[x]), h[x]), V[i, x]
    corner = np.empty(3)
    for i in range(8):
        for x in range(3):
            corner[x] = h[x] if i >> x & 1 else -h[x]
        square = point_triangle(corner, V, near)
        if square < best:
            best = square
            for x in range(3):
                points[0, x], points[1, x] = corner[x], near[x]
    u, both = np.empty(3), np.empty((2, 3))
    for k in range(3):
        y, z = (k + 1) % 3, (k + 2) % 3
        for side in range(4):
            sy = 1.0 if side & 1 else -1.0
            sz = 1.0 if side & 2 else -1.0
            # Inside of an edge only what lies outside of both of its faces is closest to it.
            if (high[y] if sy > 0.0 else -low[y]) < h[y]:
                continue
            if (high[z] if sz > 0.0 else -low[z]) < h[z]:
                continue
            for i in range(3):
                j = (i + 1) % 3
                if max(sy * V[i, y], sy * V[j, y]) < h[y]:
                    continue
                if max(sz * V[i, z], sz * V[j, z]) < h[z]:
                    continue
                for x in range(3):
                    u[x] = V[j, x] - V[i, x]
                square = edge_edge(h, k, sy, sz, V[i], u, both)
                if square < best:
                    best = square
                    for x in range(3):
                        points[0, x], points[1, x] = both[0, x], both[1, x]
    return float(np.sqrt(best))
