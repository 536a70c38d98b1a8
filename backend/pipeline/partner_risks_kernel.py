"""The compiled look ahead of `partner_risks`: where pieces will be, and when they first meet."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray


@njit(cache=True, nogil=True)
def first_meeting(
    own: tuple[Array, Array, Array, Array],
    other: tuple[Array, Array, Array, Array],
    doubt: float,
    headroom: float,
) -> tuple[int, int, int]:
    """The first of t times at which a piece of each meet, and which they are; -1 for never.

    own, other: (t, k, 2) middles, (t, k) radii, lowest and highest points [m]. Between two times
    pieces may come nearer by half their ways, which is counted.
    """
    a, ra, la, ha = own
    b, rb, lb, hb = other
    times = len(a)
    for t in range(times):
        for i in range(a.shape[1]):
            way = _way(a, t, i)
            for j in range(b.shape[1]):
                if la[t, i] >= hb[t, j] + headroom or ha[t, i] <= lb[t, j] - headroom:
                    continue
                reach = ra[t, i] + rb[t, j] + doubt + way + _way(b, t, j)
                x, y = a[t, i, 0] - b[t, j, 0], a[t, i, 1] - b[t, j, 1]
                if not x * x + y * y > reach * reach:  # what is no number has met
                    return t, i, j
    return -1, -1, -1


@njit(cache=True, nogil=True)
def _way(a: Array, t: int, i: int) -> float:
    """Half the longer of the ways to the time before and to the one after [m]."""
    longest = 0.0
    for s in (max(t - 1, 0), min(t + 1, len(a) - 1)):
        x, y = a[t, i, 0] - a[s, i, 0], a[t, i, 1] - a[s, i, 1]
        longest = max(longest, x * x + y * y)
    return float(0.5 * np.sqrt(longest))


@njit(cache=True, nogil=True)
def seen_from_above(
    poses: Array, links: IntArray, centers: Array, rotations: Array, half_extents: Array
) -> tuple[Array, Array, Array, Array]:
    """(t, k, 2) middles, (t, k) radii, lowest and highest points of k boxes along poses
    (t, links, 4, 4) of the links that carry them. links: (k,); boxes: (k, 3), (k, 3, 3), (k, 3).
    """
    times, k = len(poses), len(links)
    middle, radius = np.empty((times, k, 2)), np.empty((times, k))
    low, high = np.empty((times, k)), np.empty((times, k))
    edge = np.empty((3, 3))
    for t in range(times):
        for i in range(k):
            T = poses[t, links[i]]
            height = T[2, 3]
            for x in range(3):
                height += T[2, x] * centers[i, x]
            for x in range(2):
                middle[t, i, x] = T[x, 3]
                for y in range(3):
                    middle[t, i, x] += T[x, y] * centers[i, y]
            for a in range(3):  # the half edges, as the site sees them
                for x in range(3):
                    edge[a, x] = 0.0
                    for y in range(3):
                        edge[a, x] += T[x, y] * rotations[i, y, a] * half_extents[i, a]
            longest, up = 0.0, abs(edge[0, 2]) + abs(edge[1, 2]) + abs(edge[2, 2])
            for b in (-1.0, 1.0):
                for c in (-1.0, 1.0):  # the other corners are opposite to these
                    x = edge[0, 0] + b * edge[1, 0] + c * edge[2, 0]
                    y = edge[0, 1] + b * edge[1, 1] + c * edge[2, 1]
                    longest = max(longest, x * x + y * y)
            radius[t, i] = np.sqrt(longest)
            low[t, i], high[t, i] = height - up, height + up
    return middle, radius, low, high
