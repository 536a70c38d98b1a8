"""Where a convex body hangs free inside a hollow solid of revolution whose axis is tilted.

Let g be the horizontal direction in which the axis leans, by the angle tau. For shifts of one and
the same x along g the body keeps its heights along the axis, and it is clear of the solid if every
vertex of the body, cut at the solid's heights, is nearer to the axis than the inner radius: an
interval of y. Between the x at which a corner passes one of the heights every vertex and its radius
are linear in x, so the condition |vertex - (x, y)| <= radius is a convex cone's section and chords
between intervals lie in the free place.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.cspace.driving_profile import EDGES, Revolved
from backend.cspace.driving_revolved import cut
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

_SEEDS = 12
_SEED = 0.2
"""Intervals looked at first are this far apart [m], at most _SEEDS a stretch: a cavity that fits
between two of them is taken for solid."""
_HALVINGS = 10
_MOST = 512
"""Room for the intervals of one stretch."""
_JOINT = 1e-12
"""Stretches whose ends are this close hang together [m]."""
_ASIDE = 1e-7
"""How far beside the height of a corner a stretch begins [m]."""


def cavities(
    solid: Revolved, T_site_axis: Array, bodies: Boxes, pairs: IntArray, bounds: Array, near: float
) -> tuple[Array, IntArray, IntArray]:
    """Shifts (x, y) [m] for which body pairs[p, 1] lies between the axis and run pairs[p, 0].

    T_site_axis: (4, 4), tilted; bodies: in the site frame; bounds: (2, 2) low and high (x, y) of
    what matters. Convex polygons inside the true places and within about `near` [m] of them:
    points (k, 2), start (h + 1,), owner (h,) the p of each.
    """
    k = T_site_axis[:3, 2]
    lean = float(np.hypot(k[0], k[1]))
    g = np.array([k[0] / lean, k[1] / lean, 0.0])
    n = np.cross([0.0, 0.0, 1.0], g)
    R_site_lean = np.stack([np.cross(n, k), n, k], axis=1)
    corners = (bodies.corners() - T_site_axis[:3, 3]) @ R_site_lean
    along = np.array([[x, y] for x in bounds[:, 0] for y in bounds[:, 1]]) @ g[:2]
    points, start, owner = _cavities(
        corners,
        EDGES,
        solid.z,
        solid.inner,
        solid.start,
        pairs,
        (float(along.min()), float(along.max())),
        lean,
        float(k[2]),
        near,
    )
    return points @ np.stack([g[:2], n[:2]]), start, owner


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _interval(
    corners: Array,
    z: Array,
    inner: Array,
    x: float,
    lean: float,
    upright: float,
    work: tuple[Array, Array, IntArray],
    row: Array,
) -> bool:
    """Free y at shift x into row = x, low, high; False if there are none."""
    shifted, disks, edges = work
    shifted[:] = corners
    for c in range(8):
        shifted[c, 2] -= x * lean
    count = cut(shifted, edges, z, inner, inner, disks)
    row[0], row[1], row[2] = x, -np.inf, np.inf
    for i in range(count):
        across = disks[i, 0] - x * upright
        rest = disks[i, 3] ** 2 - across * across
        if disks[i, 3] <= 0.0 or rest <= 0.0:
            return False
        half = np.sqrt(rest)
        row[1], row[2] = max(row[1], disks[i, 1] - half), min(row[2], disks[i, 1] + half)
    return count > 0 and bool(row[1] < row[2])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _stretch(
    corners: Array,
    z: Array,
    inner: Array,
    ends: tuple[float, float],
    lean: float,
    upright: float,
    near: float,
    work: tuple[Array, Array, IntArray],
    rows: Array,
) -> int:
    """Intervals along one stretch, ascending in x, into rows (n, 3); their number.

    At its very ends the stretches before and behind have their say as well.
    """
    stack = np.empty((_SEEDS + 2 * _HALVINGS + 4, 3))
    free = np.zeros(len(stack), np.bool_)
    depth = np.zeros(len(stack), np.int64)
    middle = np.empty(3)
    seeds = min(_SEEDS, 1 + int((ends[1] - ends[0]) / _SEED))
    for i in range(seeds):
        x = ends[1] - _ASIDE + (ends[0] - ends[1] + 2.0 * _ASIDE) * i / seeds
        free[i] = _interval(corners, z, inner, x, lean, upright, work, stack[i])
    size, count = seeds, 0
    now = np.empty(3)
    here = _interval(corners, z, inner, ends[0] + _ASIDE, lean, upright, work, now)
    if here:
        if _interval(corners, z, inner, ends[0], lean, upright, work, rows[0]):
            count = 1
        rows[count] = now
        count += 1
    while size > 0 and count < min(len(rows), _MOST) - 3:
        ahead, there = stack[size - 1], free[size - 1]
        if (here or there) and depth[size - 1] < _HALVINGS and ahead[0] - now[0] > 0.1 * near:
            x = 0.5 * (now[0] + ahead[0])
            between = _interval(corners, z, inner, x, lean, upright, work, middle)
            sag = max(
                abs(middle[1] - 0.5 * (now[1] + ahead[1])),
                abs(middle[2] - 0.5 * (now[2] + ahead[2])),
            )
            if not (here and there) or (between and sag > 0.5 * near):
                depth[size - 1] += 1
                stack[size], free[size], depth[size] = middle, between, depth[size - 1]
                size += 1
                continue
        if there:
            rows[count] = ahead
            count += 1
        now[:] = ahead
        here = there
        size -= 1
    if here and _interval(corners, z, inner, ends[1], lean, upright, work, rows[count]):
        count += 1
    return count


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _heights(corners: Array, z: Array, lean: float, reach: tuple[float, float]) -> Array:
    """Shifts between `reach` at which a corner passes a height, and both ends of it; ascending."""
    out = np.empty(8 * len(z) + 2)
    out[0], out[1] = reach
    n = 2
    for c in range(8):
        for level in z:
            x = (corners[c, 2] - level) / lean
            if reach[0] < x < reach[1]:
                out[n] = x
                n += 1
    return np.sort(out[:n])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _chain(
    corners: Array,
    z: Array,
    inner: Array,
    along: tuple[float, float],
    lean: float,
    upright: float,
    near: float,
    work: tuple[Array, Array, IntArray],
    rows: Array,
) -> int:
    """All intervals of one pair, ascending in x, into rows (n, 3); their number.

    A row of low > high separates places that do not hang together.
    """
    most = inner.max()
    # Along x every vertex must stay within the largest radius, and some height be shared.
    below = (corners[:, 2].min() - z[-1]) / lean
    above = (corners[:, 2].max() - z[0]) / lean
    low = max(below, (corners[:, 0].min() - most) / upright, along[0])
    high = min(above, (corners[:, 0].max() + most) / upright, along[1])
    if low >= high:
        return 0
    at = _heights(corners, z, lean, (low, high))
    # Beyond the last height that they share, body and run are clear of each other.
    clear = np.array([0.0, corners[:, 1].min() - 3.0 * most, corners[:, 1].max() + 3.0 * most])
    total = 0
    if low == below:
        rows[:2] = clear
        rows[0, 0], rows[1, 0] = low - 1.0, low
        total = 2
    for s in range(len(at) - 1):
        if at[s + 1] - at[s] < 4.0 * _ASIDE or total + _MOST > len(rows):
            continue
        reach = (at[s], at[s + 1])
        n = _stretch(corners, z, inner, reach, lean, upright, near, work, rows[total + 1 :])
        joined = n > 0 and total > 0 and rows[total + 1, 0] - rows[total - 1, 0] <= _JOINT
        if joined:
            rows[total : total + n] = rows[total + 1 : total + 1 + n].copy()
            total += n
        elif n > 0:
            rows[total] = 0.0, 1.0, -1.0
            total += n + 1
    if high == above and total > 0 and total + 2 <= len(rows):
        if high - rows[total - 1, 0] > _JOINT:
            rows[total] = 0.0, 1.0, -1.0
            total += 1
        rows[total : total + 2] = clear
        rows[total, 0], rows[total + 1, 0] = high, high + 1.0
        total += 2
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _cavities(
    corners: Array,
    edges: IntArray,
    z: Array,
    inner: Array,
    start: IntArray,
    pairs: IntArray,
    along: tuple[float, float],
    lean: float,
    upright: float,
    near: float,
) -> tuple[Array, IntArray, IntArray]:
    longest = 0
    for k in range(len(start) - 1):
        longest = max(longest, start[k + 1] - start[k])
    work = (np.empty((8, 3)), np.empty((8 + 12 * (longest + 2), 4)), edges)
    rows = np.empty((4096, 3))
    points, ends = np.empty((8192, 2)), np.zeros(64, np.int64)
    owner = np.empty(64, np.int64)
    made = 0
    for p in range(len(pairs)):
        run = slice(start[pairs[p, 0]], start[pairs[p, 0] + 1])
        if inner[run].max() <= near:
            continue
        body = corners[pairs[p, 1]]
        total = _chain(body, z[run], inner[run], along, lean, upright, near, work, rows)
        first = 0
        for last in range(total + 1):
            if last < total and rows[last, 1] <= rows[last, 2]:
                continue
            n = last - first
            if n > 1:
                while ends[made] + 2 * n > len(points):
                    points = np.concatenate((points, np.empty_like(points)))
                if made + 2 > len(ends):
                    ends = np.concatenate((ends, np.zeros_like(ends)))
                    owner = np.concatenate((owner, np.empty_like(owner)))
                k = ends[made]
                for i in range(n):
                    points[k + i] = rows[first + i, 0], rows[first + i, 1]
                    points[k + 2 * n - 1 - i] = rows[first + i, 0], rows[first + i, 2]
                owner[made] = p
                ends[made + 1] = k + 2 * n
                made += 1
            first = last + 1
    return points[: ends[made]].copy(), ends[: made + 1].copy(), owner[:made].copy()
