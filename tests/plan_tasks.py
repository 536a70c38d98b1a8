"""A judge of trajectories that shares no code with what plans them."""

from __future__ import annotations

from typing import NamedTuple

import fcl
import numpy as np

from backend.machine.kinematics import body_boxes, end_point, link_poses
from backend.machine.model import Machine
from backend.planning.trajectory.records import Obstacles, Task, Trajectory
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.stability.masses import mass_model
from backend.stability.polygon import support_polygon
from backend.stability.zmp import edge_moments


class Judged(NamedTuple):
    """contact: an obstacle, the ground or another part is touched; tipped; beyond: of a joint's
    ends, speed or acceleration, as a share of the limit; missed: [m] from the goal.
    """

    contact: bool
    tipped: bool
    beyond: float
    missed: float


def judged(machine: Machine, task: Task, obstacles: Obstacles, made: Trajectory) -> Judged:
    """Only from the rows of the result: cubic between them, python-fcl, and all edges' moments."""
    t = np.linspace(0.0, made.duration, max(200, int(made.duration / 0.01)))
    q, rates = _between(made, t)
    moved = machine.body_joints.any(axis=1)
    fixed = [_box(c, R, h) for c, R, h in zip(*_arrays(obstacles.boxes), strict=True)]
    touched = False
    for T in link_poses(machine, q):
        boxes = body_boxes(machine, T)
        bodies = [_box(c, R, h) for c, R, h in zip(*_arrays(boxes), strict=True)]
        touched |= bool(boxes.corners()[moved, :, 2].min() <= 0.0)
        for k in np.flatnonzero(moved):
            touched |= any(_touch(bodies[k], one) for one in fixed)
        touched |= any(_touch(bodies[i], bodies[j]) for i, j in machine.self_pairs)
    moments = edge_moments(
        mass_model(machine, task.payload),
        support_polygon(machine),
        made.q,
        made.rates,
        made.accelerations,
        task.T_site_root,
    )
    beyond = max(
        float((np.abs(rates) / machine.max_velocity).max()),
        float((np.abs(made.accelerations) / machine.max_acceleration).max()),
    )
    if (q < machine.lower - 1e-6).any() or (q > machine.upper + 1e-6).any():
        beyond = np.inf
    missed = float(np.linalg.norm(end_point(machine, made.q[-1]) - task.p_root))
    return Judged(touched, bool(moments.min() < 0.0), beyond, missed)


def _between(made: Trajectory, t: Array) -> tuple[Array, Array]:
    """Cubic Hermite of the rows' values and rates."""
    from scipy.interpolate import CubicHermiteSpline

    spline = CubicHermiteSpline(made.time, made.q, made.rates)
    return spline(t), made.rates


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers, boxes.rotations, boxes.half_extents


def _box(center: Array, R: Array, half: Array) -> fcl.CollisionObject:
    return fcl.CollisionObject(fcl.Box(*(2.0 * half)), fcl.Transform(R, center))


def _touch(a: fcl.CollisionObject, b: fcl.CollisionObject) -> bool:
    return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()))
