"""Compiled: how far a machine can move along a straight line of joint values before it is too near.

Conservative advancement: no pair comes nearer than `keep` between two samples of its distance,
because these are nearer to each other than it allows at the fastest that any point moves.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import lower_bound, pair_distance
from backend.collision.fast_box_kernels import boxes_apart
from backend.planning.proximity_kernels import link_poses
from backend.spatial.types import Array, IntArray

Chain = tuple[Array, IntArray, IntArray, IntArray]
"""link_matrices, link_parents, link_joints, and the link of each body."""
Boxed = tuple[Array, Array, Array, Array]
"""centers, rotations, half extents, radii: of bodies in their links' frames, then of obstacles."""
Pairs = tuple[IntArray, IntArray, Array, Array, Array]
"""Indices of both boxes, distances that samples and all between them keep, levers (p, n)."""


@njit(cache=True, nogil=True)
def place(chain: Chain, boxes: Boxed, q: Array, C: Array, R: Array) -> None:
    """Writes the bodies' centers and rotations in the root frame into the first rows of C and R."""
    M, parents, joints, links = chain
    T = link_poses(M, parents, joints, q, np.eye(4))
    for b in range(len(links)):
        k = links[b]
        for r in range(3):
            at = T[k, r, 3]
            for x in range(3):
                at += T[k, r, x] * boxes[0][b, x]
            C[b, r] = at
            for c in range(3):
                R[b, r, c] = (
                    T[k, r, 0] * boxes[1][b, 0, c]
                    + T[k, r, 1] * boxes[1][b, 1, c]
                    + T[k, r, 2] * boxes[1][b, 2, c]
                )


@njit(cache=True, nogil=True)
def distances(chain: Chain, boxes: Boxed, pairs: Pairs, q: Array, out: Array) -> None:
    """Writes the signed distance of each pair at q (n,) into out (p,) [m]."""
    C, R, H = boxes[0].copy(), boxes[1].copy(), boxes[2]
    place(chain, boxes, q, C, R)
    for p in range(len(pairs[0])):
        i, j = pairs[0][p], pairs[1][p]
        out[p] = _distance(C, R, H, i, j, lower_bound(C, R, H, i, C, R, H, j))


@njit(cache=True, nogil=True)
def least_along(
    chain: Chain, boxes: Boxed, pairs: Pairs, kinds: IntArray, postures: Array, least: Array
) -> None:
    """Lowers least (k,) to the shortest signed distance of pairs of each kind in postures (m, n).

    kinds: (p,) index into least [m].
    """
    C, R, H = boxes[0].copy(), boxes[1].copy(), boxes[2]
    radius = boxes[3]
    for m in range(len(postures)):
        place(chain, boxes, postures[m], C, R)
        for p in range(len(kinds)):
            k = kinds[p]
            i, j = pairs[0][p], pairs[1][p]
            if _spheres(C, i, j, radius[i] + radius[j]) >= least[k]:
                continue
            bound = lower_bound(C, R, H, i, C, R, H, j)
            if bound < least[k]:
                least[k] = min(least[k], _distance(C, R, H, i, j, bound))


@njit(cache=True, nogil=True)
def blocker(chain: Chain, boxes: Boxed, pairs: Pairs, q0: Array, q1: Array) -> int:
    """The pair that is in the way from q0 to q1, both (n,), -1 where all of it is free.

    At both ends, and wherever else it is looked at, each pair is at least its `clear` apart, and
    everywhere between at least `keep`.
    """
    first, second, clear, keep, levers = pairs
    H, radius = boxes[2], boxes[3]
    C0, R0 = boxes[0].copy(), boxes[1].copy()
    C1, R1 = boxes[0].copy(), boxes[1].copy()
    place(chain, boxes, q0, C0, R0)
    place(chain, boxes, q1, C1, R1)
    count, n = len(first), 0
    speed, begin, end = np.zeros(count), np.empty(count), np.empty(count)
    # Pairs of which it is not known yet that they keep apart between `begin` and `end`.
    left = np.empty(count, np.int64)
    for p in range(count):
        for k in range(len(q0)):
            speed[p] += levers[p, k] * abs(q1[k] - q0[k])
        i, j, size = first[p], second[p], radius[first[p]] + radius[second[p]]
        enough = 2.0 * keep[p] + speed[p]
        d0, d1 = _spheres(C0, i, j, size), _spheres(C1, i, j, size)
        if min(d0, d1) >= clear[p] and d0 + d1 >= enough:
            continue
        d1 = _at_least(C1, R1, H, i, j, clear[p])
        if d1 < clear[p]:
            return p
        d0 = _at_least(C0, R0, H, i, j, clear[p])
        if d0 < clear[p]:
            return p
        if d0 + d1 >= enough:
            continue
        begin[p] = (d0 - keep[p]) / speed[p]
        end[p] = 1.0 - (d1 - keep[p]) / speed[p]
        left[n] = p
        n += 1
    q = np.empty(len(q0))
    while n > 0:
        t = 1.0
        for m in range(n):
            t = min(t, begin[left[m]])
        for k in range(len(q0)):
            q[k] = q0[k] + t * (q1[k] - q0[k])
        place(chain, boxes, q, C0, R0)
        kept = 0
        for m in range(n):
            p = left[m]
            if begin[p] <= t:
                d = _at_least(C0, R0, H, first[p], second[p], clear[p])
                if d < clear[p]:
                    return p
                begin[p] = t + (d - keep[p]) / speed[p]
            if begin[p] < end[p]:
                left[kept] = p
                kept += 1
        n = kept
    return -1


@njit(cache=True, nogil=True)
def _spheres(C: Array, i: int, j: int, size: float) -> float:
    """Distance of spheres about the i-th and the j-th of C (b, 3), their radii `size` together."""
    x, y, z = C[i, 0] - C[j, 0], C[i, 1] - C[j, 1], C[i, 2] - C[j, 2]
    return np.sqrt(x * x + y * y + z * z) - size


@njit(cache=True, nogil=True)
def _at_least(C: Array, R: Array, H: Array, i: int, j: int, enough: float) -> float:
    """A lower bound of the distance that is `enough`, else the distance; negative on overlap."""
    bound = lower_bound(C, R, H, i, C, R, H, j)
    if bound > 0.0 and bound >= enough:
        return bound
    return _distance(C, R, H, i, j, bound)


@njit(cache=True, nogil=True)
def _distance(C: Array, R: Array, H: Array, i: int, j: int, least: float) -> float:
    """`pair_distance`, sooner where a lower bound, `least`, says that they do not overlap."""
    points = np.empty((2, 3))
    if least > 0.0:
        return boxes_apart(C[i], R[i], H[i], C[j], R[j], H[j], np.empty((11, 3)), points)
    return pair_distance(C[i], R[i], H[i], C[j], R[j], H[j], points)


@njit(cache=True, nogil=True)
def within(q: Array, lower: Array, upper: Array) -> bool:
    """Whether q (n,) keeps the joints' ends."""
    inside = True
    for k in range(len(q)):
        inside = inside and lower[k] - 1e-9 <= q[k] <= upper[k] + 1e-9
    return inside
