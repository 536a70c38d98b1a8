"""Driving zone of a solid of revolution whose axis is tilted, against convex bodies.

For a body a and a convex run k the zone is the slice at height 0 of the Minkowski difference a - k.
Its support in a horizontal direction u is min over b of h(u cos b + z sin b) / cos b, h being the
support of the difference (the dual of maximising u over the slice), and every b gives a line that
bounds the zone from outside. Lines are added where the polygon still exceeds the chord of two
points of the zone by more than the tolerance. Places where the body hangs free inside the solid,
around its axis, are holes (`driving_cavity`).
"""

from __future__ import annotations

import numpy as np
import shapely
from numba import njit

from backend.cspace.driving_cavity import cavities
from backend.cspace.driving_cover import union
from backend.cspace.driving_hidden import outermost
from backend.cspace.driving_profile import Revolved, thickened
from backend.cspace.minkowski import Pieces, convex_hull, polygons, solid_pieces
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

_STEPS = 60
_NEAR = 0.05
"""How close a line must come to the zone, in parts of the tolerance."""

_MOST = 2048


def tilted_pieces(solid: Revolved, T_site_axis: Array, bodies: Boxes, tolerance: float) -> Pieces:
    """Shifts (x, y) [m] of the solid for which it touches a body, as pieces of a union.

    T_site_axis: (4, 4), the frame of the solid's axis where it stands; bodies: boxes in the site
    frame, z up. The pieces contain the zone of the solid and exceed it by about `tolerance` [m].
    """
    a = thickened(bodies)
    points, start, pairs = _tilted(
        *(np.ascontiguousarray(v) for v in (a.centers, a.rotations, a.half_extents)),
        np.ascontiguousarray(T_site_axis[:3, 3]),
        np.ascontiguousarray(T_site_axis[:3, 2]),
        solid.z,
        solid.outer,
        solid.start,
        tolerance,
    )
    outlines = solid_pieces(points, start)
    most = np.maximum.reduceat(solid.inner, solid.start[:-1]) if len(solid) else np.zeros(0)
    hollow = most[pairs[:, 0]] > tolerance
    if not hollow.any():
        return outlines
    # A free place lies in cavities of outermost outlines and outside of all that have none; only
    # the cavities of what reaches into such a place matter.
    outer = np.flatnonzero(outermost(points, start) & hollow)
    bounds = np.array([points.min(axis=0), points.max(axis=0)])
    places = union(polygons(*cavities(solid, T_site_axis, a, pairs[outer], bounds, tolerance)[:2]))
    every = np.array(polygons(points, start), dtype=object)
    shapely.prepare(places)
    filled = every[~hollow]
    places = shapely.difference(places, union(list(filled[shapely.intersects(filled, places)])))
    if places.is_empty:
        return outlines
    shapely.prepare(places)
    mine = np.flatnonzero(hollow & shapely.intersects(every, places))
    bounds = np.array(places.bounds).reshape(2, 2)
    holes, hole_start, owner = cavities(solid, T_site_axis, a, pairs[mine], bounds, tolerance)
    return Pieces(points, start, holes, hole_start, mine[owner])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _extreme(
    c: Array, R: Array, h: Array, o: Array, k: Array, z: Array, r: Array, w: Array, out: Array
) -> float:
    """The farthest point of a - k in direction w (3,), into out (3,); its distance along w."""
    along = -(w[0] * k[0] + w[1] * k[1] + w[2] * k[2])
    x, y, v = -w[0] - along * k[0], -w[1] - along * k[1], -w[2] - along * k[2]
    length = np.sqrt(x * x + y * y + v * v)
    # The radius is concave in height: along z + length r rises up to its maximum, then falls.
    at, last = 0, len(z) - 1
    while at < last:
        middle = (at + last) // 2
        if along * (z[middle + 1] - z[middle]) + length * (r[middle + 1] - r[middle]) > 0.0:
            at = middle + 1
        else:
            last = middle
    total = along * z[at] + length * r[at]
    # Near the axis the difference is rounding: only its part across the axis is a direction.
    extra = x * k[0] + y * k[1] + v * k[2]
    x, y, v = x - extra * k[0], y - extra * k[1], v - extra * k[2]
    norm = np.sqrt(x * x + y * y + v * v)
    scale = r[at] / norm if norm > 1e-15 else 0.0
    out[0] = c[0] - o[0] - z[at] * k[0] - scale * x
    out[1] = c[1] - o[1] - z[at] * k[1] - scale * y
    out[2] = c[2] - o[2] - z[at] * k[2] - scale * v
    for i in range(3):
        total += (c[i] - o[i]) * w[i]
        side = w[0] * R[0, i] + w[1] * R[1, i] + w[2] * R[2, i]
        step = h[i] if side >= 0.0 else -h[i]
        total += step * side
        out[0] += step * R[0, i]
        out[1] += step * R[1, i]
        out[2] += step * R[2, i]
    return float(total)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _line(
    c: Array,
    R: Array,
    h: Array,
    o: Array,
    k: Array,
    z: Array,
    r: Array,
    ends: Array,
    near: float,
    row: Array,
) -> None:
    """For the direction row[:2]: the bound of the zone into row[2], a point of it into row[3:5].

    ends (2, 3): points of the difference below and above height 0. The chord of two such points
    crosses height 0 in the zone; the support in its normal direction bounds the zone, and its point
    replaces the end on its side, until both are within `near` of each other.
    """
    w, p = np.empty(3), np.empty(3)
    below, above = ends[0].copy(), ends[1].copy()
    w[0], w[1] = row[0], row[1]
    row[2] = np.inf
    for _ in range(_STEPS):
        rise = max(above[2] - below[2], 1e-12)
        w[2] = -(row[0] * (above[0] - below[0]) + row[1] * (above[1] - below[1])) / rise
        s = min(max(-below[2] / rise, 0.0), 1.0)
        row[3:5] = below[:2] + s * (above[:2] - below[:2])
        row[2] = min(row[2], _extreme(c, R, h, o, k, z, r, w, p))
        if row[2] - row[0] * row[3] - row[1] * row[4] <= near:
            break
        if p[2] <= 0.0:
            below[:] = p
        else:
            above[:] = p


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _outline(
    c: Array,
    R: Array,
    h: Array,
    o: Array,
    k: Array,
    z: Array,
    r: Array,
    ends: Array,
    tolerance: float,
    corners: Array,
) -> int:
    """Vertices of the circumscribed polygon of one pair, their number."""
    near = _NEAR * tolerance
    stack = np.empty((128, 5))
    first, row = np.empty(5), np.empty(5)
    n = 0
    for d in range(4):
        angle = 0.5 * np.pi * (3 - d)
        stack[d, 0], stack[d, 1] = np.cos(angle), np.sin(angle)
        _line(c, R, h, o, k, z, r, ends, near, stack[d])
    first[:] = stack[3]
    row[:] = first
    size = 3
    closing = True
    while size > 0 or closing:
        if size == 0:
            stack[0] = first
            size, closing = 1, False
        ahead = stack[size - 1]
        turn = row[0] * ahead[1] - row[1] * ahead[0]
        if turn > 1e-7:
            x = (row[2] * ahead[1] - ahead[2] * row[1]) / turn
            y = (ahead[2] * row[0] - row[2] * ahead[0]) / turn
            dx, dy = ahead[3] - row[3], ahead[4] - row[4]
            length = np.hypot(dx, dy)
            if length > 1e-9:
                excess = (dy * (x - row[3]) - dx * (y - row[4])) / length
                nx, ny = dy / length, -dx / length
            else:
                excess = np.hypot(x - row[3], y - row[4])
                nx, ny = row[0] + ahead[0], row[1] + ahead[1]
                nx, ny = nx / np.hypot(nx, ny), ny / np.hypot(nx, ny)
            between = row[0] * ny - row[1] * nx > 1e-7 and nx * ahead[1] - ny * ahead[0] > 1e-7
            if excess > tolerance and between and size < 127 and n < len(corners) - 4:
                stack[size, 0], stack[size, 1] = nx, ny
                _line(c, R, h, o, k, z, r, ends, near, stack[size])
                size += 1
                continue
            corners[n] = x, y
            n += 1
        else:
            # Nearly parallel lines: their crossing is ill-conditioned, their far ends are not.
            for end in range(2):
                q = row if end == 0 else ahead
                gap = q[2] - q[0] * q[3] - q[1] * q[4]
                corners[n] = q[3] + gap * q[0], q[4] + gap * q[1]
                n += 1
        row[:] = ahead
        size -= 1
    return n


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _tilted(
    ca: Array,
    Ra: Array,
    ha: Array,
    o: Array,
    k: Array,
    z: Array,
    outer: Array,
    start: IntArray,
    tolerance: float,
) -> tuple[Array, IntArray, IntArray]:
    points = np.empty((4096, 2))
    ends = np.zeros(len(ca) * (len(start) - 1) + 1, np.int64)
    corners, ring = np.empty((_MOST, 2)), np.empty((_MOST, 2))
    up, down, top_bottom = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.empty((2, 3))
    pair = np.empty((len(ends), 2), np.int64)
    made = 0
    for e in range(len(start) - 1):
        run = slice(start[e], start[e + 1])
        for i in range(len(ca)):
            body = (ca[i], Ra[i], ha[i])
            if _extreme(*body, o, k, z[run], outer[run], up, top_bottom[1]) < 0.0:
                continue
            if _extreme(*body, o, k, z[run], outer[run], down, top_bottom[0]) < 0.0:
                continue
            n = _outline(*body, o, k, z[run], outer[run], top_bottom, tolerance, corners)
            m = convex_hull(corners, n, ring)
            while ends[made] + m > len(points):
                points = np.concatenate((points, np.empty_like(points)))
            points[ends[made] : ends[made] + m] = ring[:m]
            ends[made + 1] = ends[made] + m
            pair[made] = e, i
            made += 1 if m else 0
    return points[: ends[made]].copy(), ends[: made + 1].copy(), pair[:made].copy()
