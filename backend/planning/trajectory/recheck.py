"""The judge of a finished trajectory: python-fcl at dense samples and the full ZMP, nothing of what
planned it."""

from __future__ import annotations

import numpy as np

from backend.collision.peer import FclScene
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.planning.trajectory.curve import Curve
from backend.planning.trajectory.records import Checks, Obstacles, Task
from backend.planning.trajectory.sweep import Sweep
from backend.planning.trajectory.timing import Timed
from backend.spatial.types import Array
from backend.stability.masses import MassModel
from backend.stability.polygon import Polygon
from backend.stability.zmp import margin, zmp

TURN, WAY = np.deg2rad(1.0), 0.02
"""Between two samples no joint turns by more [rad], no end point moves farther [m]."""


def recheck(
    machine: Machine,
    task: Task,
    obstacles: Obstacles,
    sweep: Sweep,
    curve: Curve,
    time: Timed,
    masses: MassModel | None,
    support: Polygon,
) -> Checks:
    """Distances are the shorter of two: exact ones by features, and python-fcl's."""
    t = _instants(machine, curve, time)
    q, rates, accelerations = time.sampled(curve, t)
    stable = np.nan
    if masses is not None:
        point = zmp(masses, q, rates, accelerations, task.T_site_root)
        stable = float(margin(point, support).min())
    own, outer, ground = sweep.least_along(q)
    return Checks(
        min_clearance=min(outer, _by_fcl(machine, obstacles, q)),
        min_own=own,
        min_ground=ground,
        min_stability_margin=stable,
        worst_rate=float((np.abs(rates) / task.max_velocity(machine)).max()),
        worst_acceleration=float((np.abs(accelerations) / task.max_acceleration(machine)).max()),
        samples=len(t),
    )


def overdone(machine: Machine, task: Task, curve: Curve, time: Timed) -> float:
    """By what factor the timing must be slowed so that no joint is too fast between grid points."""
    _, rates, accelerations = time.sampled(curve, _instants(machine, curve, time))
    rate = float((np.abs(rates) / task.max_velocity(machine)).max())
    hard = float((np.abs(accelerations) / task.max_acceleration(machine)).max())
    return max(1.0, rate, float(np.sqrt(hard)))


def _by_fcl(machine: Machine, obstacles: Obstacles, q: Array) -> float:
    """Shortest distance by python-fcl of what moves to the obstacles, of postures (m, n) [m]."""
    if not len(obstacles.boxes):
        return np.inf
    moving = np.flatnonzero(machine.body_joints.any(axis=1))
    frames = machine.body_link_index[moving]
    return FclScene(obstacles.boxes).least_along(
        machine.bodies.take(moving), frames, link_poses(machine, q)
    )


def _instants(machine: Machine, curve: Curve, time: Timed) -> Array:
    """(m,) [s] ends of the intervals and as many between as TURN and WAY ask for."""
    q = curve.at(time.s)
    lever = machine.stretched_levers.max(axis=0)
    moved = np.abs(np.diff(q, axis=0))
    parts = np.maximum(moved.max(axis=1) / TURN, (moved * lever).sum(axis=1) / WAY)
    parts = np.maximum(np.ceil(1.2 * parts), 1).astype(int)
    out = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(time.t[:-1], time.t[1:], parts, strict=True)
    ]
    return np.append(np.concatenate(out), time.t[-1])
