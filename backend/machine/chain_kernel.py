"""Forward kinematics of one configuration, compiled: called several times in every cycle."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def link_poses(M: Array, parents: IntArray, joints: IntArray, q: Array, T_root: Array) -> Array:
    """(L, 4, 4) of links in the frame that T_root (4, 4) leads to; M, parents, joints as in
    Machine.link_matrices, .link_parents, .link_joints; q: (n,) [rad].
    """
    count = len(parents)
    out, T = np.zeros((count, 4, 4)), np.empty((3, 4))
    for i in range(count):
        s = v = 0.0
        if joints[i] >= 0:
            s, v = math.sin(q[joints[i]]), 1.0 - math.cos(q[joints[i]])
        for a in range(3):
            for b in range(4):
                T[a, b] = M[0, i, a, b] + s * M[1, i, a, b] + v * M[2, i, a, b]
        above = T_root if parents[i] < 0 else out[parents[i]]
        for a in range(3):
            for b in range(4):
                out[i, a, b] = above[a, 0] * T[0, b] + above[a, 1] * T[1, b] + above[a, 2] * T[2, b]
            out[i, a, 3] += above[a, 3]
        out[i, 3, 3] = 1.0
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def placed(centers: Array, rotations: Array, links: IntArray, poses: Array) -> tuple[Array, Array]:
    """Centers (n, 3) and rotations (n, 3, 3) of bodies that move with `links` (n,) at link poses
    (L, 4, 4).
    """
    n = len(links)
    c, R = np.empty((n, 3)), np.empty((n, 3, 3))
    for i in range(n):
        T = poses[links[i]]
        for a in range(3):
            c[i, a] = (
                T[a, 0] * centers[i, 0]
                + T[a, 1] * centers[i, 1]
                + T[a, 2] * centers[i, 2]
                + T[a, 3]
            )
            for b in range(3):
                R[i, a, b] = (
                    T[a, 0] * rotations[i, 0, b]
                    + T[a, 1] * rotations[i, 1, b]
                    + T[a, 2] * rotations[i, 2, b]
                )
    return c, R


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def point_jacobians(
    poses: Array, links: IntArray, axes: Array, moved: Array, bodies: IntArray, points: Array
) -> Array:
    """(k, 3, n) velocities of points (k, 3) that move with bodies (k,) per joint rate.

    poses: (L, 4, 4); links, axes: of the joints, Machine.joint_links, .joint_axes; moved:
    Machine.body_joints (bodies, n).
    """
    n = len(links)
    out = np.zeros((len(bodies), 3, n))
    z, r = np.empty(3), np.empty(3)
    for j in range(n):
        T = poses[links[j]]
        for a in range(3):
            z[a] = T[a, 0] * axes[j, 0] + T[a, 1] * axes[j, 1] + T[a, 2] * axes[j, 2]
        for k in range(len(bodies)):
            if moved[bodies[k], j]:
                for a in range(3):
                    r[a] = points[k, a] - T[a, 3]
                out[k, 0, j] = z[1] * r[2] - z[2] * r[1]
                out[k, 1, j] = z[2] * r[0] - z[0] * r[2]
                out[k, 2, j] = z[0] * r[1] - z[1] * r[0]
    return out
