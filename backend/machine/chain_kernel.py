"""Forward kinematics of one configuration, compiled: called several times in every cycle."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray


@njit(cache=True)  # type: ignore[untyped-decorator]
def in_parent(M: Array, joints: IntArray, q: Array, link: int, T: Array) -> None:
    """Set T (3, 4) to the link's pose in its parent, Rodrigues; M, joints as in
    Machine.link_matrices, .link_joints; q: (n,) [rad].
    """
    s = v = 0.0
    if joints[link] >= 0:
        s, v = math.sin(q[joints[link]]), 1.0 - math.cos(q[joints[link]])
    for a in range(3):
        for b in range(4):
            T[a, b] = M[0, link, a, b] + s * M[1, link, a, b] + v * M[2, link, a, b]


@njit(cache=True)  # type: ignore[untyped-decorator]
def set_link_poses(
    M: Array, parents: IntArray, joints: IntArray, q: Array, T_root: Array, poses: Array
) -> None:
    """Set the upper three rows of poses (L, 3 or 4, 4) to those of links in the frame that T_root
    (3 or 4, 4) leads to; parents as in Machine.link_parents, the others as in `in_parent`.
    """
    T = np.empty((3, 4))
    for i in range(len(parents)):
        in_parent(M, joints, q, i, T)
        above = T_root if parents[i] < 0 else poses[parents[i]]
        for a in range(3):
            for b in range(4):
                poses[i, a, b] = (
                    above[a, 0] * T[0, b] + above[a, 1] * T[1, b] + above[a, 2] * T[2, b]
                )
            poses[i, a, 3] += above[a, 3]


@njit(cache=True)  # type: ignore[untyped-decorator]
def link_poses(M: Array, parents: IntArray, joints: IntArray, q: Array, T_root: Array) -> Array:
    """(L, 4, 4), as in `set_link_poses`."""
    poses = np.zeros((len(parents), 4, 4))
    poses[:, 3, 3] = 1.0
    set_link_poses(M, parents, joints, q, T_root, poses)
    return poses


@njit(cache=True)  # type: ignore[untyped-decorator]
def set_placed(
    bodies: tuple[Array, Array, Array], links: IntArray, poses: Array, centers: Array, R: Array
) -> None:
    """Set centers (n, 3) and rotations R (n, 3, 3) to those of bodies that move with `links` (n,)
    at link poses (L, 3 or 4, 4); bodies: Machine.body_arrays.
    """
    for i in range(len(links)):
        T = poses[links[i]]
        for a in range(3):
            centers[i, a] = T[a, 3]
            for b in range(3):
                centers[i, a] += T[a, b] * bodies[0][i, b]
                R[i, a, b] = (
                    T[a, 0] * bodies[1][i, 0, b]
                    + T[a, 1] * bodies[1][i, 1, b]
                    + T[a, 2] * bodies[1][i, 2, b]
                )


@njit(cache=True)  # type: ignore[untyped-decorator]
def placed(
    bodies: tuple[Array, Array, Array], links: IntArray, poses: Array
) -> tuple[Array, Array]:
    """Centers (n, 3) and rotations (n, 3, 3), as in `set_placed`."""
    n = len(links)
    centers, R = np.empty((n, 3)), np.empty((n, 3, 3))
    set_placed(bodies, links, poses, centers, R)
    return centers, R


@njit(cache=True)  # type: ignore[untyped-decorator]
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
