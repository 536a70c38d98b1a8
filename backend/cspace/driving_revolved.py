"""Where a solid of revolution with an upright axis, driven without turning, meets convex bodies.

Cut a body at the heights of a run. The outer edge of the zone is the union of disks about all
points of the cut body, each of the solid's radius at that height; the radius is concave in height,
so the union is the convex hull of the disks about the cut body's vertices. The body is clear inside
the solid (between it and the axis) if all its points are nearer than the inner radius: the
intersection of disks about the same vertices is a hole.
Arcs are drawn as tangents outside, as chords in holes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.cspace.driving_profile import EDGES, Revolved, thickened
from backend.cspace.minkowski import Pieces
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray


def revolved_pieces(solid: Revolved, bodies: Boxes, tolerance: float) -> Pieces:
    """Positions (x, y) [m] of the axis for which the solid touches a body, as pieces of a union.

    bodies: boxes in a frame whose z axis is the solid's, heights counted alike. The pieces contain
    the zone of the solid and exceed it by at most `tolerance` [m].
    """
    corners = thickened(bodies).corners()
    points, start, holes, hole_end = _zones(
        corners, EDGES, solid.z, solid.inner, solid.outer, solid.start, tolerance
    )
    owner = np.flatnonzero(np.diff(hole_end))
    return Pieces(points, start, holes, np.append(0, hole_end[owner + 1]), owner)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _sides(radius: float, tolerance: float) -> int:
    """Sides of a regular polygon whose corners are within `tolerance` of its inscribed circle."""
    return max(8, int(np.ceil(np.pi / np.arccos(1.0 / (1.0 + tolerance / max(radius, 1e-3))))))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cut(corners: Array, edges: IntArray, z: Array, inner: Array, outer: Array, disks: Array) -> int:
    """Vertices of a box cut at the heights of a run: disks (n, 4) = x, y, outer, inner; n."""
    bottom = max(corners[:, 2].min(), z[0])
    top = min(corners[:, 2].max(), z[-1])
    if bottom > top:
        return 0
    n = 0
    for c in range(8):
        h = corners[c, 2]
        if bottom <= h <= top:
            disks[n, 0], disks[n, 1] = corners[c, 0], corners[c, 1]
            disks[n, 2], disks[n, 3] = np.interp(h, z, outer), np.interp(h, z, inner)
            n += 1
    for level in range(len(z) + 2):
        h = bottom if level == 0 else (top if level == 1 else z[level - 2])
        if h < bottom or h > top:
            continue
        ro, ri = np.interp(h, z, outer), np.interp(h, z, inner)
        for e in range(12):
            p, q = corners[edges[e, 0]], corners[edges[e, 1]]
            if (p[2] - h) * (q[2] - h) > 0.0 or abs(q[2] - p[2]) < 1e-12:
                continue
            s = (h - p[2]) / (q[2] - p[2])
            disks[n, 0], disks[n, 1] = p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])
            disks[n, 2], disks[n, 3] = ro, ri
            n += 1
    return n


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _hull_of_disks(disks: Array, n: int, sides: int, out: Array) -> int:
    """Convex hull of regular polygons around the disks, counter-clockwise: vertices, their number.

    All polygons have the same directions, so a hull vertex of direction d is vertex d of one of
    them: for every d the upper envelope of n lines over the angles of one corner.
    """
    half = np.pi / sides
    grow, slope_end = 1.0 / np.cos(half), np.tan(half)
    along, across = np.empty(n), np.empty(n)
    m, now, best = 0, 0, -np.inf
    for d in range(sides):
        c, s = np.cos(2.0 * half * d), np.sin(2.0 * half * d)
        for k in range(n):
            along[k] = disks[k, 0] * c + disks[k, 1] * s + disks[k, 2] * grow
            across[k] = disks[k, 1] * c - disks[k, 0] * s
            value = along[k] - slope_end * across[k]
            # Later directions begin with the disk at which the one before ended.
            if d == 0 and value > best:
                now, best = k, value
        while True:
            x = disks[now, 0] + disks[now, 2] * grow * c
            y = disks[now, 1] + disks[now, 2] * grow * s
            if m == 0 or abs(out[m - 1, 0] - x) + abs(out[m - 1, 1] - y) > 1e-10:
                out[m, 0], out[m, 1] = x, y
                m += 1
            following, reach = -1, slope_end
            for k in range(n):
                if across[k] > across[now] + 1e-12:
                    t = (along[now] - along[k]) / (across[k] - across[now])
                    if t < reach:
                        following, reach = k, t
            if following < 0:
                break
            now = following
    while m > 3 and abs(out[m - 1, 0] - out[0, 0]) + abs(out[m - 1, 1] - out[0, 1]) < 1e-10:
        m -= 1
    return m


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _common_of_disks(disks: Array, n: int, tolerance: float, out: Array) -> int:
    """Intersection of polygons inscribed in the inner disks; 0 vertices when it is empty."""
    least = disks[:n, 3].min()
    if least <= tolerance:
        return 0
    for k in range(1, n):
        for j in range(k):
            gap = np.hypot(disks[k, 0] - disks[j, 0], disks[k, 1] - disks[j, 1])
            if gap >= disks[k, 3] + disks[j, 3]:
                return 0
    sides = _sides(disks[:n, 3].max(), tolerance)
    half = np.pi / sides
    # Half planes c x + s y <= limit in the order of their directions, kept in a double-ended list
    # (de Berg et al., Section 4.2, with the sorting done): line and the vertex before it.
    c, s, limit = np.empty(sides), np.empty(sides), np.empty(sides)
    line = np.empty(sides, np.int64)
    first, last = 0, -1
    for d in range(sides):
        c[d], s[d] = np.cos(2.0 * half * d), np.sin(2.0 * half * d)
        limit[d] = np.inf
        for k in range(n):
            value = disks[k, 0] * c[d] + disks[k, 1] * s[d] + disks[k, 3] * np.cos(half)
            limit[d] = min(limit[d], value)
        while last > first and c[d] * out[last, 0] + s[d] * out[last, 1] > limit[d]:
            last -= 1
        while last > first and c[d] * out[first + 1, 0] + s[d] * out[first + 1, 1] > limit[d]:
            first += 1
        last += 1
        line[last] = d
        if last > first and not _meet(c, s, limit, line[last - 1], d, out[last]):
            return 0
    while last - first > 1:
        d = line[first]
        if c[d] * out[last, 0] + s[d] * out[last, 1] <= limit[d]:
            break
        last -= 1
    while last - first > 1:
        d = line[last]
        if c[d] * out[first + 1, 0] + s[d] * out[first + 1, 1] <= limit[d]:
            break
        first += 1
    if last - first < 2 or not _meet(c, s, limit, line[last], line[first], out[first]):
        return 0
    m = last - first + 1
    for k in range(m):
        out[k] = out[first + k]
    # An empty intersection can leave a list that closes wrongly: every vertex must fit all lines.
    for k in range(m):
        for d in range(sides):
            if c[d] * out[k, 0] + s[d] * out[k, 1] > limit[d] + 1e-9:
                return 0
    return m


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _meet(c: Array, s: Array, limit: Array, i: int, j: int, out: Array) -> bool:
    """Where lines i and j cross, into out (2,); False unless j turns left of i."""
    turn = c[i] * s[j] - s[i] * c[j]
    if turn < 1e-9:
        return False
    out[0] = (limit[i] * s[j] - limit[j] * s[i]) / turn
    out[1] = (limit[j] * c[i] - limit[i] * c[j]) / turn
    return True


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _needed(disks: Array, n: int) -> int:
    """Drops disks that lie in another one outside and need no less inside; how many stay."""
    m = 0
    for k in range(n):
        covered = False
        for j in range(n):
            if j == k or (j > k and disks[j, 2] == disks[k, 2] and disks[j, 3] == disks[k, 3]):
                continue
            gap = np.hypot(disks[k, 0] - disks[j, 0], disks[k, 1] - disks[j, 1])
            if j < m or j > k:
                inside = gap + disks[k, 2] <= disks[j, 2] + 1e-12
                if inside and gap + disks[j, 3] <= disks[k, 3] + 1e-12:
                    covered = True
                    break
        if not covered:
            disks[m] = disks[k]
            m += 1
    return m


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _zones(
    corners: Array,
    edges: IntArray,
    z: Array,
    inner: Array,
    outer: Array,
    start: IntArray,
    tolerance: float,
) -> tuple[Array, IntArray, Array, IntArray]:
    pairs = len(corners) * (len(start) - 1)
    longest = 0
    for k in range(len(start) - 1):
        longest = max(longest, start[k + 1] - start[k])
    disks = np.empty((8 + 12 * (longest + 2), 4))
    most = _sides(outer.max() if len(outer) else 0.0, tolerance) + len(disks) + 8
    ring, hole = np.empty((2 * most, 2)), np.empty((2 * most, 2))
    points, holes = np.empty((4096, 2)), np.empty((4096, 2))
    ends, hole_ends = np.zeros(pairs + 1, np.int64), np.zeros(pairs + 1, np.int64)
    made = 0
    for k in range(len(start) - 1):
        run = slice(start[k], start[k + 1])
        for i in range(len(corners)):
            n = cut(corners[i], edges, z[run], inner[run], outer[run], disks)
            if n == 0:
                continue
            n = _needed(disks, n)
            sides = _sides(disks[:n, 2].max(), tolerance)
            m = _hull_of_disks(disks, n, sides, ring)
            h = _common_of_disks(disks, n, tolerance, hole)
            while ends[made] + m > len(points):
                points = np.concatenate((points, np.empty_like(points)))
            while hole_ends[made] + h > len(holes):
                holes = np.concatenate((holes, np.empty_like(holes)))
            points[ends[made] : ends[made] + m] = ring[:m]
            holes[hole_ends[made] : hole_ends[made] + h] = hole[:h]
            ends[made + 1], hole_ends[made + 1] = ends[made] + m, hole_ends[made] + h
            made += 1
    return (
        points[: ends[made]].copy(),
        ends[: made + 1].copy(),
        holes[: hole_ends[made]].copy(),
        hole_ends[: made + 1].copy(),
    )
