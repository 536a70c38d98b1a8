"""Boxes cut by the slab in which a body moves, seen in the arm's plane: convex polygons.

Coordinates in the frame `arm`: x forward, t left, z along the swing axis. All cutting planes are
parallel to z, so the corners of what remains lie on the box's own faces, and cutting the six faces
finds them all.

For a cell of swing angles, turned by at most `spread` either way, `outer_slices` contain the slice
of every swing in the cell and `inner_slice` is contained in the slice of every one of them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray

POINTS = 96
"""Room for the corners of one cut box."""

_FACES: IntArray = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cut_face(face: Array, n: int, a: float, b: float, c: float, out: Array) -> int:
    """Part of the polygon face[:n] (x, t, z) with a x + b t <= c, written to out; its size."""
    size = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = a * face[i, 0] + b * face[i, 1] - c
        there = a * face[j, 0] + b * face[j, 1] - c
        if here <= 0.0:
            out[size] = face[i]
            size += 1
        if (here < 0.0 and there > 0.0) or (here > 0.0 and there < 0.0):
            share = here / (here - there)
            for k in range(3):
                out[size, k] = face[i, k] + share * (face[j, k] - face[i, k])
            size += 1
    return size


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cut_box(corners: Array, planes: Array, points: Array, work: Array) -> int:
    """Corners of a box (8, 3) within all planes (k, 3) a x + b t <= c, written to points."""
    total = 0
    for f in range(6):
        n = 4
        for i in range(4):
            work[0, i] = corners[_FACES[f, i]]
        source = 0
        for p in range(planes.shape[0]):
            n = cut_face(
                work[source], n, planes[p, 0], planes[p, 1], planes[p, 2], work[1 - source]
            )
            source = 1 - source
            if n == 0:
                break
        for i in range(n):
            points[total] = work[source, i]
            total += 1
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def convex_hull(x: Array, z: Array, n: int, out_x: Array, out_z: Array) -> int:
    """Hull of n points, counter-clockwise, without repetition; sorts x and z in place."""
    for i in range(1, n):
        kx, kz = x[i], z[i]
        j = i - 1
        while j >= 0 and (x[j] > kx or (x[j] == kx and z[j] > kz)):
            x[j + 1], z[j + 1] = x[j], z[j]
            j -= 1
        x[j + 1], z[j + 1] = kx, kz
    size = 0
    for sweep in range(2):
        base = size
        for step in range(n):
            i = step if sweep == 0 else n - 1 - step
            while size >= base + 2:
                ax, az = out_x[size - 2], out_z[size - 2]
                bx, bz = out_x[size - 1], out_z[size - 1]
                if (bx - ax) * (z[i] - az) - (bz - az) * (x[i] - ax) > 0.0:
                    break
                size -= 1
            out_x[size], out_z[size] = x[i], z[i]
            size += 1
        size -= 1
    return max(size, 1)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def slab_planes(low: float, high: float, spread: float, front: bool) -> Array:
    """Planes around all points that lie in the slab at some swing of the cell, x >= 0 or x <= 0.

    Turned by d, a point's lateral coordinate is t cos d - x sin d; it is at most `high` for some
    |d| <= spread only if t <= high / cos d + x tan d, which the widest d bounds.
    """
    c, slope = math.cos(spread), math.tan(spread)
    top, bottom = max(high, high / c), min(low, low / c)
    if spread == 0.0:
        return np.array([[0.0, 1.0, high], [0.0, -1.0, -low]])
    side = 1.0 if front else -1.0
    return np.array([[-side, 0.0, 0.0], [-side * slope, 1.0, top], [-side * slope, -1.0, -bottom]])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def slab_slice(
    corners: Array, low: float, high: float, work: Array, out_x: Array, out_z: Array
) -> int:
    """Polygon of a box (8, 3) in the slab low <= t <= high; its number of corners.

    Bit a of a corner's number is the side of the box's axis a that it is on.
    """
    x, z = work[0], work[1]
    n = 0
    for v in range(8):
        t = corners[v, 1]
        if low <= t <= high:
            x[n], z[n] = corners[v, 0], corners[v, 2]
            n += 1
        for a in range(3):
            u = v | 1 << a
            if u == v:
                continue
            rise = corners[u, 1] - t
            for plane in (low, high):
                if (t < plane < corners[u, 1]) or (corners[u, 1] < plane < t):
                    share = (plane - t) / rise
                    x[n] = corners[v, 0] + share * (corners[u, 0] - corners[v, 0])
                    z[n] = corners[v, 2] + share * (corners[u, 2] - corners[v, 2])
                    n += 1
    return int(convex_hull(x, z, n, out_x, out_z)) if n > 0 else 0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def outer_slice(
    corners: Array,
    low: float,
    high: float,
    spread: float,
    front: bool,
    points: Array,
    work: Array,
    out_x: Array,
    out_z: Array,
) -> int:
    """Polygon around the slices of a box (8, 3) at all swings of the cell, of its part in front of
    the swing axis or behind it; its number of corners. With spread 0 it is the slice itself.
    """
    n = cut_box(corners, slab_planes(low, high, spread, front), points, work)
    if n == 0:
        return 0
    x, z = np.empty(2 * n), np.empty(2 * n)
    if spread == 0.0:
        for i in range(n):
            x[i], z[i] = points[i, 0], points[i, 2]
        return int(convex_hull(x, z, n, out_x, out_z))
    # x cos d + t sin d lies between a concave and a convex function of (x, t), so that the hull of
    # the corners' intervals contains the intervals of all points between.
    c, s = math.cos(spread), math.sin(spread)
    for i in range(n):
        px, pt = points[i, 0], points[i, 1]
        near = abs(px) * c - abs(pt) * s
        far = math.hypot(px, pt)
        x[2 * i], x[2 * i + 1] = (near, far) if front else (-far, -near)
        z[2 * i] = z[2 * i + 1] = points[i, 2]
    return int(convex_hull(x, z, 2 * n, out_x, out_z))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cut_polygon(x: Array, z: Array, n: int, a: float, b: float, c: float) -> int:
    """Part of the polygon (x, z)[:n] with a x + b z <= c, in place; its number of corners."""
    old_x, old_z = x[:n].copy(), z[:n].copy()
    size = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = a * old_x[i] + b * old_z[i] - c
        there = a * old_x[j] + b * old_z[j] - c
        if here <= 0.0:
            x[size], z[size] = old_x[i], old_z[i]
            size += 1
        if (here < 0.0 and there > 0.0) or (here > 0.0 and there < 0.0):
            share = here / (here - there)
            x[size] = old_x[i] + share * (old_x[j] - old_x[i])
            z[size] = old_z[i] + share * (old_z[j] - old_z[i])
            size += 1
    return size


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def inner_slice(
    corners: Array,
    low: float,
    high: float,
    spread: float,
    points: Array,
    work: Array,
    out_x: Array,
    out_z: Array,
) -> int:
    """Polygon inside the slices of a box (8, 3) at all swings of the cell, in front of the axis.

    Take a point (x, z), x >= 0, of the slices at both ends of the cell, s = spread from its middle:
    the box has points there with lateral coordinates t and u. The segment between them meets the
    plane of the swing d at (1 - k) : k with (1 - k) sin(s + d) = k sin(s - d), where its lateral
    coordinate is (1 - k) t cos(s + d) + k u cos(s - d), in the slab when t and u are in the slab
    narrowed by cos 2s, and its x is x cos s / cos d + m (t - u) with 0 <= m <= sin(s) / 2. So a
    point with such neighbours to the left and to the right is, by convexity, in all slices.
    """
    if spread >= 0.25 * math.pi:
        return 0
    narrow = math.cos(2.0 * spread)
    lowest, highest = max(low, low / narrow), min(high, high / narrow)
    planes = np.array([[0.0, 1.0, highest], [0.0, -1.0, -lowest]])
    turned = np.empty((8, 3))
    x, z = np.empty((2, POINTS)), np.empty((2, POINTS))
    sizes = np.zeros(2, np.int64)
    for end in range(2):
        c, s = math.cos(spread), math.sin(spread) * (1.0 if end else -1.0)
        for i in range(8):
            # Into the frame that has turned by d: x cos d + t sin d, t cos d - x sin d.
            turned[i, 0] = corners[i, 0] * c + corners[i, 1] * s
            turned[i, 1] = corners[i, 1] * c - corners[i, 0] * s
            turned[i, 2] = corners[i, 2]
        n = cut_box(turned, planes, points, work)
        if n == 0:
            return 0
        sizes[end] = convex_hull(points[:n, 0].copy(), points[:n, 2].copy(), n, x[end], z[end])
        if sizes[end] < 3:
            return 0
    largest = max(min(x[0, : sizes[0]].max(), x[1, : sizes[1]].max()), 0.0)
    left = 0.5 * math.sin(spread) * (highest - lowest)
    right = (left + largest * (1.0 - math.cos(spread))) / math.cos(spread)
    n = sizes[0]
    out_x[:n], out_z[:n] = x[0, :n], z[0, :n]
    n = cut_polygon(out_x, out_z, n, -1.0, 0.0, -left)
    for end in range(2):
        for i in range(sizes[end]):
            j = i + 1 if i + 1 < sizes[end] else 0
            a = z[end, j] - z[end, i]
            b = x[end, i] - x[end, j]
            c = a * x[end, i] + b * z[end, i] - (a * right if a > 0.0 else -a * left)
            n = cut_polygon(out_x, out_z, n, a, b, c)
            if n < 3:
                return 0
    return int(n)
