"""Coordinates of the arm that keep the bucket's attitude on straight lines, and the goal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.machine.inverse import inverse
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.machine.sun_map import sun_angles
from backend.planning.trajectory.records import Refusal, Task
from backend.planning.trajectory.sweep import CONTACT, Sweep
from backend.spatial import transform
from backend.spatial.types import Array

_TURN = 2.0 * np.pi
_OTHERS = np.deg2rad(np.arange(5.0, 155.0, 5.0))
"""How far the attitude at the goal may leave the present one where none is stated [rad]."""


class Carry(NamedTuple):
    """q = A x + b, of x = (swing, boom, stick, attitude) [rad]. A: (n, 4); b: (n,)."""

    A: Array
    b: Array

    def x(self, machine: Machine, q: Array) -> Array:
        """(..., 4) of q (..., n)."""
        return np.concatenate([q[..., :3], attitude_of(machine, q)[..., None]], axis=-1)

    def q(self, x: Array) -> Array:
        """(..., n) of x (..., 4)."""
        return np.asarray(x @ self.A.T + self.b)


def attitude_of(machine: Machine, q: Array) -> Array:
    """(...) elevation of the line from bucket pivot to tip above the plane of swing [rad]."""
    return np.asarray(sun_angles(machine, np.asarray(q)).sum(axis=-1))


def carry_of(machine: Machine, q: Array) -> Carry:
    """Joints beyond the bucket stay as in q (n,). Raises InputError where they are not at 0."""
    if np.abs(q[4:]).max(initial=0.0) > 1e-3:
        raise InputError(
            f"task: tilt and rotate of {machine.name} must be at 0; no trajectory is planned with "
            "a tilted bucket."
        )
    signs, offsets = np.array(machine.sun.signs), np.array(machine.sun.offsets)
    A = np.zeros((len(q), 4))
    A[0, 0] = A[1, 1] = A[2, 2] = 1.0
    A[3] = signs[2] * np.array([0.0, -signs[0], -signs[1], 1.0])
    b = np.zeros(len(q))
    b[3] = -signs[2] * offsets.sum()
    return Carry(A, b)


def cylinder(machine: Machine, q: Array) -> Array:
    """(..., 3) of the end point about the swing axis: theta [rad], r [m], z [m], theta not
    unwrapped. q: (..., n) [rad].
    """
    p = transform.apply(
        transform.inverse(machine.arm.T_root_swing), end_point(machine, q)[..., None, :]
    )[..., 0, :]
    return np.stack(
        [np.arctan2(p[..., 1], p[..., 0]), np.hypot(p[..., 0], p[..., 1]), p[..., 2]], axis=-1
    )


def from_cylinder(machine: Machine, where: Array, attitude: Array) -> tuple[Array, bool]:
    """Joint values (m, n) [rad], swing without jumps, that put the end point at (m, 3) theta, r, z;
    and whether all are reachable within the joints' ends, swing aside.
    """
    theta, r, z = where.T
    local = np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=1)
    found = inverse(machine, transform.apply(machine.arm.T_root_swing, local), attitude)
    q = found.q
    q[:, 0] = np.unwrap(q[:, 0])
    low, high = machine.lower[1:] - 1e-9, machine.upper[1:] + 1e-9
    inside = bool((q[:, 1:] >= low).all() and (q[:, 1:] <= high).all())
    return q, inside and bool(found.reachable.all())


def goals(machine: Machine, task: Task, sweep: Sweep) -> Array | Refusal:
    """(g, n) postures at the goal that touch nothing, the nearest turn of the swing first, or why
    there is none.
    """
    now = float(attitude_of(machine, task.q))
    if task.attitude is not None:
        tried = np.array([task.attitude])
    else:
        tried = now + np.concatenate([[0.0], np.stack([_OTHERS, -_OTHERS], axis=1).ravel()])
    p = np.broadcast_to(task.p_root, (len(tried), 3))
    found = [inverse(machine, p, tried, elbow) for elbow in (1, -1)]
    reachable = np.stack([f.reachable for f in found], axis=1).ravel()
    possible = reachable & np.stack([f.within_limits for f in found], axis=1).ravel()
    q = np.stack([f.q for f in found], axis=1).reshape(-1, len(machine.joints))
    if not reachable.any():
        return Refusal("goal", "the goal is out of the arm's reach.", proven=True)
    if not possible.any():
        at = "at that bucket attitude " if task.attitude is not None else ""
        return Refusal(
            "goal", f"the goal is beyond the joints' ends {at}of {machine.name}.", proven=True
        )
    worst: list[tuple[float, str]] = []
    for posture in q[possible]:
        near = sweep.near(posture)
        if not near:
            return _turns(machine, task.q, posture)
        worst = worst or near
    names = tuple(name for _, name in worst)
    d, name = worst[0]
    how = f"touches {name}" if d < CONTACT else f"is {d:.2f} m from {name}"
    asked = "" if d < CONTACT else f"; {task.clearance:.2f} m are asked for"
    return Refusal("goal", f"at the goal the machine {how}{asked}.", names, proven=True)


def _turns(machine: Machine, start: Array, goal: Array) -> Array:
    """The same posture on the turns of the swing that can be reached both ways round."""
    swing = machine.joints[0]
    near = start[0] + (goal[0] - start[0] + np.pi) % _TURN - np.pi
    other = near - _TURN if near > start[0] else near + _TURN
    values = [v for v in (near, other) if swing.lower - 1e-9 <= v <= swing.upper + 1e-9]
    out = np.repeat(goal[None], len(values), axis=0)
    out[:, 0] = values
    return out
