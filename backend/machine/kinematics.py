"""Forward kinematics and Jacobians, vectorised over configurations.

Frames: `site`, `root` (the URDF's root link), `link`. T_site_root is the base pose, identity when
None. q: (..., n) joint values in the order of Machine.joints [rad]. Compiled code is loaded where
it is first called: a page that shows a recording does not wait for it.
"""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine
from backend.spatial.boxes import Boxes, known_boxes
from backend.spatial.types import Array, IntArray


def link_poses(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """T_site_link of every link, (..., L, 4, 4), for q (..., n) and T_site_root (..., 4, 4).

    Leading axes of q and T_site_root broadcast.
    """
    q = np.asarray(q, dtype=float)
    M = machine.link_matrices
    T_parent_link = np.empty((*q.shape[:-1], M.shape[1], 4, 4))
    T_parent_link[...] = M[0]
    # Rodrigues: T(q) = T_parent_joint (I + sin(q) K + (1 - cos(q)) K^2).
    s, v = np.sin(q), 1.0 - np.cos(q)
    for i, link in enumerate(machine.links):
        k = link.joint
        if k >= 0:
            T_parent_link[..., i, :, :] += (
                s[..., k, None, None] * M[1, i] + v[..., k, None, None] * M[2, i]
            )
    if T_site_root is None:
        out = T_parent_link
    else:
        batch = np.broadcast_shapes(q.shape[:-1], np.shape(T_site_root)[:-2])
        out = np.empty((*batch, M.shape[1], 4, 4))
        out[..., 0, :, :] = T_site_root @ T_parent_link[..., 0, :, :]
    for i, link in enumerate(machine.links):
        if link.parent >= 0:
            out[..., i, :, :] = out[..., link.parent, :, :] @ T_parent_link[..., i, :, :]
    return out


def posture(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """`link_poses` (L, 4, 4) of one configuration q (n,), T_site_root (4, 4), compiled: several of
    them are asked for in every cycle.
    """
    from backend.machine import chain_kernel

    root = np.eye(4) if T_site_root is None else np.array(T_site_root, dtype=float)
    chain = machine.link_matrices, machine.link_parents, machine.link_joints
    return np.asarray(chain_kernel.link_poses(*chain, np.array(q, dtype=float), root))


def posture_boxes(machine: Machine, T_site_links: Array) -> Boxes:
    """`body_boxes`, compiled."""
    from backend.machine import chain_kernel

    T, links = np.array(T_site_links, dtype=float), machine.body_link_index
    centers, rotations = chain_kernel.placed(machine.body_arrays, links, T)
    if not np.isfinite(centers).all():
        raise ValueError("link poses must be finite numbers")
    return known_boxes(centers, rotations, machine.bodies.half_extents)


def body_boxes(machine: Machine, T_site_links: Array) -> Boxes:
    """The machine's bodies in the site frame for one configuration. T_site_links: (L, 4, 4)."""
    T = T_site_links[machine.body_link_index]
    R = T[:, :3, :3]
    centers = (R @ machine.bodies.centers[:, :, None])[:, :, 0] + T[:, :3, 3]
    return Boxes(centers, R @ machine.bodies.rotations, machine.bodies.half_extents)


def end_point_of(machine: Machine, T_site_links: Array) -> Array:
    """Bucket tip (..., 3) [m], site frame, from link poses (..., L, 4, 4)."""
    T = T_site_links[..., machine.end_link, :, :]
    return np.asarray(T[..., :3, :3] @ machine.end_point + T[..., :3, 3])


def end_point(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """Bucket tip (..., 3) [m] in the site frame. q: (..., n) [rad]; T_site_root: (..., 4, 4)."""
    return end_point_of(machine, link_poses(machine, q, T_site_root))


def swing_center(machine: Machine, T_site_root: Array | None = None) -> Array:
    """Origin of the swing joint (..., 3) [m], site frame; it does not depend on the joints."""
    p_root = machine.arm.T_root_swing[:3, 3]
    if T_site_root is None:
        return p_root.copy()
    T = np.asarray(T_site_root, dtype=float)
    return np.asarray(T[..., :3, :3] @ p_root + T[..., :3, 3])


def azimuth(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """Direction of the arm's plane (...) [rad], counter-clockwise from the site's x (grid east).

    On a tilted base it is the direction of the plane's horizontal line of sight projected on the
    site's horizontal plane. On level ground it is yaw + swing for a machine whose offset is 0.
    """
    swing = np.asarray(q, dtype=float)[..., 0]
    angle = machine.sun.azimuth_sign * swing + machine.sun.azimuth_offset
    x, y = machine.arm.T_root_swing[:3, 0], machine.arm.T_root_swing[:3, 1]
    f_root = np.cos(angle)[..., None] * x + np.sin(angle)[..., None] * y
    if T_site_root is not None:
        T = np.asarray(T_site_root, dtype=float)
        f_root = (T[..., :3, :3] @ f_root[..., None])[..., 0]
    return np.asarray(np.arctan2(f_root[..., 1], f_root[..., 0]))


def reach(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """Horizontal distance (...) [m] from swing centre to bucket tip, in the site's plane."""
    delta = end_point(machine, q, T_site_root) - swing_center(machine, T_site_root)
    return np.asarray(np.hypot(delta[..., 0], delta[..., 1]))


def jacobian(
    machine: Machine,
    q: Array,
    T_site_root: Array | None,
    link: int,
    point: Array,
    angular: bool = False,
) -> Array:
    """Geometric Jacobian of a point fixed to a link, in the site frame.

    point: (3,) or (..., 3) in the frame of links[link] [m]. Returns (..., 3, n): velocity of the
    point per joint rate [m/rad]; with `angular` (..., 6, n), angular velocity in the last 3 rows.
    """
    T = link_poses(machine, q, T_site_root)
    T_link = T[..., link, :, :]
    p = (T_link[..., :3, :3] @ np.asarray(point, dtype=float)[..., None])[..., 0] + T_link[
        ..., :3, 3
    ]
    J = np.zeros((*T.shape[:-3], 6 if angular else 3, len(machine.joints)))
    i = link
    while i >= 0:
        k = machine.links[i].joint
        if k >= 0:
            # The joint frame and its link share origin and axis: rotation leaves both in place.
            z = T[..., i, :3, :3] @ machine.links[i].axis
            J[..., :3, k] = np.cross(z, p - T[..., i, :3, 3])
            if angular:
                J[..., 3:, k] = z
        i = machine.links[i].parent
    return J


def body_point_jacobians(
    machine: Machine, T_site_links: Array, bodies: IntArray, points: Array
) -> Array:
    """(k, 3, n) velocities [m/s] per joint rate of site points that move with bodies.

    T_site_links: (L, 4, 4) of one configuration; bodies: (k,) indices; points: (k, 3) [m].
    """
    from backend.machine import chain_kernel

    return np.asarray(
        chain_kernel.point_jacobians(
            np.array(T_site_links, dtype=float),
            machine.joint_links,
            machine.joint_axes,
            machine.body_joints,
            np.array(bodies, dtype=np.int64),
            np.array(points, dtype=float),
        )
    )
