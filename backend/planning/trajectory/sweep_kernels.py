"""Compiled: how far a machine can move along a straight line of joint values before it is too near.

Conservative advancement: nothing comes nearer than `keep` between two samples, because the step
from one to the next is shorter than what its distances allow at the fastest that any point moves.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import pair_distance, separation
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
    points = np.empty((2, 3))
    for p in range(len(pairs[0])):
        i, j = pairs[0][p], pairs[1][p]
        out[p] = pair_distance(C[i], R[i], H[i], C[j], R[j], H[j], points)


@njit(cache=True, nogil=True)
def least_along(
    chain: Chain, boxes: Boxed, pairs: Pairs, kinds: IntArray, postures: Array, least: Array
) -> None:
    """Lowers least (k,) to the shortest signed distance of pairs of each kind in postures (m, n).

    kinds: (p,) index into least, -1 where a pair is left out [m].
    """
    C, R, H = boxes[0].copy(), boxes[1].copy(), boxes[2]
    radius = boxes[3]
    points = np.empty((2, 3))
    for m in range(len(postures)):
        place(chain, boxes, postures[m], C, R)
        for p in range(len(kinds)):
            k = kinds[p]
            if k < 0:
                continue
            i, j = pairs[0][p], pairs[1][p]
            x, y, z = C[i, 0] - C[j, 0], C[i, 1] - C[j, 1], C[i, 2] - C[j, 2]
            if np.sqrt(x * x + y * y + z * z) - radius[i] - radius[j] >= least[k]:
                continue
            if separation(C[i], R[i], H[i], C[j], R[j], H[j]) >= least[k]:
                continue
            least[k] = min(least[k], pair_distance(C[i], R[i], H[i], C[j], R[j], H[j], points))


@njit(cache=True, nogil=True)
def advance(
    chain: Chain, boxes: Boxed, pairs: Pairs, q0: Array, q1: Array
) -> tuple[float, int, int]:
    """(share of the way that is free, pair in the way or -1, samples) from q0 to q1, both (n,).

    At every sample each pair is at least its `clear` apart, and between them at least `keep`.
    """
    first, second, clear, keep, levers = pairs
    C, R, H = boxes[0].copy(), boxes[1].copy(), boxes[2]
    radius = boxes[3]
    points = np.empty((2, 3))
    count = len(first)
    speed = np.zeros(count)
    for p in range(count):
        for k in range(len(q0)):
            speed[p] += levers[p, k] * abs(q1[k] - q0[k])
    t, samples = 0.0, 0
    q = np.empty(len(q0))
    while True:
        for k in range(len(q0)):
            q[k] = q0[k] + t * (q1[k] - q0[k])
        place(chain, boxes, q, C, R)
        samples += 1
        step = 1.0 - t
        for p in range(count):
            i, j = first[p], second[p]
            x, y, z = C[i, 0] - C[j, 0], C[i, 1] - C[j, 1], C[i, 2] - C[j, 2]
            d = np.sqrt(x * x + y * y + z * z) - radius[i] - radius[j]
            if d >= clear[p] and d - keep[p] >= step * speed[p]:
                continue
            d = separation(C[i], R[i], H[i], C[j], R[j], H[j])
            if d >= clear[p] and d - keep[p] >= step * speed[p]:
                continue
            d = pair_distance(C[i], R[i], H[i], C[j], R[j], H[j], points)
            if d < clear[p]:
                return t, p, samples
            if d - keep[p] < step * speed[p]:
                step = (d - keep[p]) / speed[p]
        if t >= 1.0:
            return 1.0, -1, samples
        t = min(1.0, t + step)


@njit(cache=True, nogil=True)
def within(q: Array, lower: Array, upper: Array) -> bool:
    """Whether q (n,) keeps the joints' ends."""
    inside = True
    for k in range(len(q)):
        inside = inside and lower[k] - 1e-9 <= q[k] <= upper[k] + 1e-9
    return inside
