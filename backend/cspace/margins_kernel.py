"""Conservative advancement of a machine's boxes along directions in joint space, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.collision.box_kernels import pair_distance
from backend.cspace.exact_boxes import gap
from backend.spatial.types import Array, IntArray

CLOSE = 0.05
"""Where something counts as contact before it touches, and a gap is within this of it, the distance
itself is measured: corner to corner it is larger than the gap along every axis [m]."""


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def place(
    M: Array, parents: IntArray, joints: IntArray, q: Array, link: int, c: Array, R: Array
) -> None:
    """Move center c (3,) and rotation R (3, 3) from the link's frame to the root's, in place."""
    T, moved, turned = np.empty((3, 4)), np.empty(3), np.empty((3, 3))
    i = link
    while i >= 0:
        s = v = 0.0
        if joints[i] >= 0:
            s, v = math.sin(q[joints[i]]), 1.0 - math.cos(q[joints[i]])
        for a in range(3):
            for b in range(4):
                T[a, b] = M[0, i, a, b] + s * M[1, i, a, b] + v * M[2, i, a, b]
        for a in range(3):
            moved[a] = T[a, 0] * c[0] + T[a, 1] * c[1] + T[a, 2] * c[2] + T[a, 3]
            for b in range(3):
                turned[a, b] = T[a, 0] * R[0, b] + T[a, 1] * R[1, b] + T[a, 2] * R[2, b]
        c[:] = moved
        R[:] = turned
        i = parents[i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _placed(own: tuple[Array, Array, Array], links: IntArray, T: Array) -> tuple[Array, Array]:
    """Centers (n, 3) and rotations (n, 3, 3) of all bodies in the root frame."""
    n = len(links)
    centers, rotations = np.empty((n, 3)), np.empty((n, 3, 3))
    for i in range(n):
        pose = T[links[i]]
        for a in range(3):
            centers[i, a] = pose[a, 3]
            for b in range(3):
                centers[i, a] += pose[a, b] * own[0][i, b]
                rotations[i, a, b] = (
                    pose[a, 0] * own[1][i, 0, b]
                    + pose[a, 1] * own[1][i, 1, b]
                    + pose[a, 2] * own[1][i, 2, b]
                )
    return centers, rotations


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def advance(
    M: Array,
    parents: IntArray,
    joints: IntArray,
    links: IntArray,
    own: tuple[Array, Array, Array],
    others: tuple[Array, Array, Array],
    itself: IntArray,
    rates: Array,
    itself_rates: Array,
    eta: float,
    wrong: Array,
    T: Array,
    q: Array,
    directions: Array,
    ends: Array,
    steps: Array,
) -> tuple[Array, IntArray]:
    """(how far (k,), the pair that ends it (k,) or -1) along q + s directions[k], s <= ends[k].

    Pairs are numbered: first `itself` (p, 2) of own bodies, then own body i against obstacle j as
    p + i m + j. rates: (k, n), itself_rates: (k, p) how fast they move at most, per unit of s;
    eta: gap to an obstacle that counts as contact, wrong: (p,) the same among own bodies [m]; T:
    (L, 4, 4) link poses at q; steps: (k,) the least advance.
    """
    n, m, p = len(links), len(others[0]), len(itself)
    points = np.empty((2, 3))
    centers, rotations = _placed(own, links, T)
    radius, other_radius = np.empty(n), np.empty(m)
    for i in range(n):
        radius[i] = math.sqrt((own[2][i] ** 2).sum())
    for j in range(m):
        other_radius[j] = math.sqrt((others[2][j] ** 2).sum())
    apart = np.empty(p + n * m)  # at s = 0, less what counts as contact
    horizon = np.zeros(n)
    for k in range(len(ends)):
        for i in range(n):
            horizon[i] = max(horizon[i], rates[k, i] * ends[k])
    for k in range(len(apart)):
        i, j = (itself[k, 0], itself[k, 1]) if k < p else ((k - p) // m, (k - p) % m)
        if k >= p and horizon[i] == 0.0:
            apart[k] = math.inf
            continue
        cb = centers[j] if k < p else others[0][j]
        rb = radius[j] if k < p else other_radius[j]
        less = wrong[k] if k < p else eta
        d = 0.0
        for a in range(3):
            d += (centers[i, a] - cb[a]) ** 2
        d = math.sqrt(d)
        g = d - radius[i] - rb
        near = k < p or g - less < horizon[i]
        if near and g < 0.3 * d:
            Rb = rotations[j] if k < p else others[1][j]
            hb = own[2][j] if k < p else others[2][j]
            g = max(g, gap(centers[i], rotations[i], own[2][i], cb, Rb, hb, math.inf))
        apart[k] = g - less
    free, pair = ends.copy(), np.full(len(ends), -1, np.int64)
    chosen, safe = np.empty(len(apart), np.int64), np.empty(len(apart))
    ca, cb2 = np.empty(3), np.empty(3)
    Ra, Rb2 = np.empty((3, 3)), np.empty((3, 3))
    for k in range(len(ends)):
        if ends[k] <= 0.0:
            continue
        count = 0
        for c in range(len(apart)):
            rate = itself_rates[k, c] if c < p else rates[k, (c - p) // m]
            if rate > 0.0 and apart[c] < rate * ends[k]:
                chosen[count] = c
                safe[count] = max(apart[c], 0.0) / rate
                count += 1
        # The nearest first: the sooner a contact is found, the less far the others need to go.
        order = np.argsort(safe[:count])
        for at in range(count):
            c, s = chosen[order[at]], safe[order[at]]
            i, j = (itself[c, 0], itself[c, 1]) if c < p else ((c - p) // m, (c - p) % m)
            rate = itself_rates[k, c] if c < p else rates[k, i]
            less = wrong[c] if c < p else eta
            g = apart[c]
            while s < free[k]:
                if s > 0.0:
                    ca[:], Ra[:] = own[0][i], own[1][i]
                    posture = q + s * directions[k]
                    place(M, parents, joints, posture, links[i], ca, Ra)
                    if c < p:
                        cb2[:], Rb2[:] = own[0][j], own[1][j]
                        place(M, parents, joints, posture, links[j], cb2, Rb2)
                        hb = own[2][j]
                        rb = radius[j]
                    else:
                        cb2[:], Rb2[:] = others[0][j], others[1][j]
                        hb = others[2][j]
                        rb = other_radius[j]
                    d = math.sqrt(((ca - cb2) ** 2).sum())
                    g = d - radius[i] - rb
                    if g < 0.3 * d:
                        g = max(g, gap(ca, Ra, own[2][i], cb2, Rb2, hb, math.inf))
                        if 0.0 < g < less + CLOSE and less > 0.0:
                            g = pair_distance(ca, Ra, own[2][i], cb2, Rb2, hb, points)
                    g -= less
                if g < rate * steps[k]:
                    free[k], pair[k] = s, c
                    break
                s += g / rate
    return free, pair
