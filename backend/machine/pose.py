"""Where the tool is and how it is turned: pose, its error, its Jacobian, inverse kinematics.

The tool frame stands at the end point with the axes of the link that carries it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.kinematics import end_point_of, jacobian, link_poses
from backend.machine.model import Machine
from backend.spatial.types import Array

_SWEEPS = 60
_DAMPING = 0.05  # first damping factor of the search


class PoseSolution(NamedTuple):
    """q: (n,) [rad], within the limits; error: (6,) what is left of the pose error [m, rad]."""

    q: Array
    error: Array
    reached: bool


def tool_pose(machine: Machine, T_site_links: Array) -> Array:
    """T_site_tool (..., 4, 4) from link poses (..., L, 4, 4)."""
    T = np.array(T_site_links[..., machine.end_link, :, :])
    T[..., :3, 3] = end_point_of(machine, T_site_links)
    return T


def tool_jacobian(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """(..., 6, n) geometric Jacobian J_G of the tool: linear above angular velocity, site frame.

    Mäkinen 2021, Eq. (3.5). q: (..., n) [rad].
    """
    return jacobian(machine, q, T_site_root, machine.end_link, machine.end_point, angular=True)


def tool_jacobian_at(machine: Machine, T_site_links: Array) -> Array:
    """(6, n) the same from the link poses (L, 4, 4) of one posture."""
    T = T_site_links[machine.joint_links]
    z = (T[:, :3, :3] @ machine.joint_axes[:, :, None])[..., 0]
    r = end_point_of(machine, T_site_links) - T[:, :3, 3]
    J = np.zeros((6, len(z)))
    J[0] = z[:, 1] * r[:, 2] - z[:, 2] * r[:, 1]
    J[1] = z[:, 2] * r[:, 0] - z[:, 0] * r[:, 2]
    J[2] = z[:, 0] * r[:, 1] - z[:, 1] * r[:, 0]
    J[3:] = z.T
    J[:, _idle(machine)] = 0.0
    return J


def pose_error(T_goal: Array, T: Array) -> Array:
    """(6,) what is missing from T to T_goal, both (4, 4): position [m], rotation vector [rad], in
    the common frame; a tool that moves with this velocity for 1 s is there (to first order).
    """
    R = T_goal[:3, :3] @ T[:3, :3].T
    cosine = 0.5 * (np.trace(R) - 1.0)
    skew = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = float(np.linalg.norm(skew))
    angle = float(np.arctan2(sine, cosine))
    if sine > 1e-9:
        turn = skew * (angle / sine)
    elif cosine > 0.0:
        turn = skew
    else:  # half a turn: the axis is the eigenvector of eigenvalue 1
        column = int(np.argmax(np.diag(R)))
        axis = R[:, column] + np.eye(3)[column]
        turn = np.pi * axis / np.linalg.norm(axis)
    return np.concatenate([T_goal[:3, 3] - T[:3, 3], turn])


def inverse_pose(
    machine: Machine, T_goal: Array, q_start: Array, T_site_root: Array | None = None
) -> PoseSolution:
    """Joint values that bring the tool to T_goal (4, 4), the ones that a search from q_start finds.

    Damped least squares (Mäkinen 2021, Eq. (3.9)) with a damping that falls when a step helps
    (Levenberg-Marquardt), kept within the joint limits. Where the pose cannot be reached it ends
    with the error that is left.
    """
    lower, upper = machine.lower, machine.upper
    q = np.clip(np.asarray(q_start, dtype=float), lower, upper)
    damping = _DAMPING
    error = _error(machine, q, T_goal, T_site_root)
    for _ in range(_SWEEPS):
        if float(np.linalg.norm(error)) < 1e-10:
            break
        J = tool_jacobian(machine, q, T_site_root)
        step = damped_inverse(J, damping) @ error
        longest = float(np.abs(step).max())
        tried = np.clip(q + step * min(1.0, 0.5 / max(longest, 1e-12)), lower, upper)
        after = _error(machine, tried, T_goal, T_site_root)
        if float(after @ after) < float(error @ error):
            q, error, damping = tried, after, max(0.3 * damping, 1e-6)
        else:
            damping *= 4.0
            if damping > 1e3:
                break
    return PoseSolution(q, error, bool(np.linalg.norm(error) < 1e-6))


def damped_inverse(J: Array, damping: float) -> Array:
    """(n, m) J^T (J J^T + damping^2 I)^-1 of J (m, n): damped least squares.

    Mäkinen 2021, Eq. (3.9); without damping the right pseudo-inverse, Eq. (3.8).
    """
    return np.asarray(J.T @ np.linalg.inv(J @ J.T + damping**2 * np.eye(len(J))))


def _idle(machine: Machine) -> list[int]:
    """Joints that do not move the tool."""
    i, chain = machine.end_link, set()
    while i >= 0:
        chain.add(machine.links[i].joint)
        i = machine.links[i].parent
    return [k for k in range(len(machine.joints)) if k not in chain]


def _error(machine: Machine, q: Array, T_goal: Array, T_site_root: Array | None) -> Array:
    return pose_error(T_goal, tool_pose(machine, link_poses(machine, q, T_site_root)))
