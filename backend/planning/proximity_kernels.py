"""Compiled loops of `proximity`: close points of pairs of boxes, and what joints do to them."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import pair_distance, separation
from backend.spatial.types import Array, BoolArray, IntArray

_TOUCHING = 1e-9  # [m] up to which the closest points give no direction
_NEAR = 1.5  # [m] between boxes from which corners say no more than closest points do
_OUTSIDE = 1e-6  # [m] from which a corner does


@njit(cache=True, nogil=True)
def link_poses(M: Array, parents: IntArray, joints: IntArray, q: Array, root: Array) -> Array:
    """(L, 4, 4) T_site_link of one posture, as `kinematics.link_poses`."""
    count = len(parents)
    T = np.empty((count, 4, 4))
    for i in range(count):
        local = M[0, i].copy()
        if joints[i] >= 0:
            angle = q[joints[i]]
            local += np.sin(angle) * M[1, i] + (1.0 - np.cos(angle)) * M[2, i]
        before = root if parents[i] < 0 else T[parents[i]]
        for r in range(4):
            for c in range(4):
                T[i, r, c] = (
                    before[r, 0] * local[0, c]
                    + before[r, 1] * local[1, c]
                    + before[r, 2] * local[2, c]
                    + before[r, 3] * local[3, c]
                )
    return T


@njit(cache=True, nogil=True)
def find(
    ca: Array,
    Ra: Array,
    ha: Array,
    cb: Array,
    Rb: Array,
    hb: Array,
    index: IntArray,
    within: Array,
    corners: bool,
) -> tuple[IntArray, Array, Array, Array, Array]:
    """Pairs nearer than within[k] [m] among a[index[k, 0]], b[index[k, 1]].

    Returns (r, 2) indices of the boxes, (r, 3) points on a, (r, 3) on b, (r,) distances and (r, 3)
    unit normals from b to a: for each two boxes their closest points and, with `corners`, each
    corner outside of the other box and near it.
    """
    room = len(index) * (17 if corners else 1)
    who = np.empty((room, 2), dtype=np.int64)
    on_a, on_b, normals = np.empty((room, 3)), np.empty((room, 3)), np.empty((room, 3))
    distances = np.empty(room)
    points = np.empty((2, 3))
    r = 0
    for k in range(len(index)):
        i, j = index[k]
        d = pair_distance(ca[i], Ra[i], ha[i], cb[j], Rb[j], hb[j], points)
        if d >= within[k]:
            continue
        who[r, 0], who[r, 1] = i, j
        on_a[r], on_b[r], distances[r] = points[0], points[1], d
        if d > _TOUCHING:
            normals[r] = (points[0] - points[1]) / d
        else:
            _way_out(ca[i], Ra[i], ha[i], cb[j], Rb[j], hb[j], normals[r])
        r += 1
        if corners and d < _NEAR:
            for side in range(2):
                c, R, h = (ca[i], Ra[i], ha[i]) if side == 0 else (cb[j], Rb[j], hb[j])
                c2, R2, h2 = (cb[j], Rb[j], hb[j]) if side == 0 else (ca[i], Ra[i], ha[i])
                for corner in range(8):
                    p, foot = points[0], points[1]
                    for x in range(3):
                        p[x] = c[x]
                        for axis in range(3):
                            p[x] += R[x, axis] * (h[axis] if corner >> axis & 1 else -h[axis])
                    _foot(p, c2, R2, h2, foot)
                    d = np.sqrt(((p - foot) ** 2).sum())
                    if d <= _OUTSIDE or d >= within[k]:
                        continue
                    who[r, 0], who[r, 1], distances[r] = i, j, d
                    if side == 0:
                        on_a[r], on_b[r] = p, foot
                    else:
                        on_a[r], on_b[r] = foot, p
                    normals[r] = (on_a[r] - on_b[r]) / d
                    r += 1
    return who[:r], on_a[:r], on_b[:r], distances[:r], normals[:r]


@njit(cache=True, nogil=True)
def shortest(
    ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array, index: IntArray, cap: float
) -> float:
    """The shortest distance among a[index[k, 0]], b[index[k, 1]] [m], cap where none is."""
    best = cap
    points = np.empty((2, 3))
    for i, j in index:
        # Nearer than the gap along a separating axis no two boxes are.
        if separation(ca[i], Ra[i], ha[i], cb[j], Rb[j], hb[j]) < best:
            best = min(best, pair_distance(ca[i], Ra[i], ha[i], cb[j], Rb[j], hb[j], points))
    return best


@njit(cache=True, nogil=True)
def gradients(
    T: Array,
    joint_links: IntArray,
    joint_axes: Array,
    moved: BoolArray,
    body: IntArray,
    other: IntArray,
    point: Array,
    other_point: Array,
    normal: Array,
) -> Array:
    """(k, n) n . (J_point - J_other) [m/rad]; see `proximity.gradients`. moved: (bodies, n)."""
    k, n = len(body), len(joint_links)
    out = np.zeros((k, n))
    for joint in range(n):
        link = joint_links[joint]
        z = T[link, :3, :3].copy() @ joint_axes[joint]
        for row in range(k):
            for side in range(2):
                who = body[row] if side == 0 else other[row]
                if who < 0 or not moved[who, joint]:
                    continue
                p = point[row] if side == 0 else other_point[row]
                x, y, w = p[0] - T[link, 0, 3], p[1] - T[link, 1, 3], p[2] - T[link, 2, 3]
                speed = (
                    normal[row, 0] * (z[1] * w - z[2] * y)
                    + normal[row, 1] * (z[2] * x - z[0] * w)
                    + normal[row, 2] * (z[0] * y - z[1] * x)
                )
                out[row, joint] += speed if side == 0 else -speed
    return out


@njit(cache=True, nogil=True)
def _foot(p: Array, c: Array, R: Array, h: Array, foot: Array) -> None:
    """Writes the point of a box nearest to p."""
    for x in range(3):
        foot[x] = c[x]
    for axis in range(3):
        along = 0.0
        for x in range(3):
            along += R[x, axis] * (p[x] - c[x])
        along = min(max(along, -h[axis]), h[axis])
        for x in range(3):
            foot[x] += R[x, axis] * along


@njit(cache=True, nogil=True)
def _way_out(ca: Array, Ra: Array, ha: Array, cb: Array, Rb: Array, hb: Array, out: Array) -> None:
    """Writes the separating axis along which two overlapping boxes part soonest, from b to a."""
    best = -np.inf
    for first in range(4):
        for second in range(4):
            if first == 3 and second == 3:
                continue
            if second == 3:
                axis = Ra[:, first].copy()
            elif first == 3:
                axis = Rb[:, second].copy()
            else:
                axis = np.cross(Ra[:, first], Rb[:, second])
            length = np.sqrt((axis**2).sum())
            if length < 1e-6:
                continue
            axis /= length
            along = (axis * (ca - cb)).sum()
            gap = abs(along)
            for k in range(3):
                gap -= abs((axis * Ra[:, k]).sum()) * ha[k] + abs((axis * Rb[:, k]).sum()) * hb[k]
            if gap > best:
                best = gap
                for x in range(3):
                    out[x] = axis[x] if along >= 0.0 else -axis[x]
