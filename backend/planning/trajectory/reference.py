"""The penalty method's answer to a task, as joint values over time, for the same judge as ours."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from backend.errors import InputError
from backend.machine.model import Machine
from backend.planning.trajectory.carry import attitude_of, cylinder, from_cylinder
from backend.planning.trajectory.course import Setting
from backend.planning.trajectory.curve import Curve
from backend.planning.trajectory.penalty import (
    Critical,
    Descent,
    Inside,
    Iteration,
    Problem,
    descent,
)
from backend.planning.trajectory.records import Obstacles, Task
from backend.planning.trajectory.timing import Timed
from backend.spatial import transform
from backend.spatial.types import Array
from backend.stability.simple_model import critical_lift, critical_swing, two_masses

_REACH = (0.84, 1.1)
"""Of the shorter and the longer of both reaches that r may take: 4.2 and 5.5 m at the paper's 5."""


class Answer(NamedTuple):
    """curve: over time [s], not along a length; reachable: within the arm's reach and the joints'
    ends everywhere; missed: the goal by how much [m]; over: the greatest share of a limit along
    theta, r, z that is used; moving: that of a joint's full speed at the end; steps: the descent's.
    """

    curve: Curve
    time: Timed
    reachable: bool
    missed: float
    over: float
    moving: float
    steps: int


def by_penalty(
    machine: Machine,
    task: Task,
    obstacles: Obstacles,
    within: Setting,
    told: Callable[[Iteration], None] | None = None,
) -> Answer:
    """Where the descent ends. Raises InputError where the task lacks limits along theta, r, z."""
    return answer(machine, task, within, descent(problem(machine, task, obstacles, within), told))


def problem(machine: Machine, task: Task, obstacles: Obstacles, within: Setting) -> Problem:
    """The task for the end point as a point, `clearance` away from obstacles; the edges are those
    of `within.kept`. Raises InputError where it lacks limits along theta, r, z.
    """
    limits = task.cylindrical
    if not (np.isfinite(limits.speed).all() and np.isfinite(limits.acceleration).all()):
        raise InputError(
            "method penalty: knows no joints; limits.cylindrical must state speeds and "
            "accelerations along theta, r and z."
        )
    begin, _ = _begin(machine, task, within)
    goal = _goal(machine, task, within)
    speed, acceleration = limits.speed.copy(), limits.acceleration.copy()
    speed[0] = min(speed[0], task.max_velocity(machine)[0])
    acceleration[0] = min(acceleration[0], task.max_acceleration(machine)[0])
    least, most = sorted((begin[1], goal[1]))
    return Problem(
        start=np.array([0.0, begin[1], begin[2]]),
        goal=goal,
        speed=speed,
        acceleration=acceleration,
        reach=(_REACH[0] * least, _REACH[1] * most),
        top=machine.max_reach,
        lift=task.lift,
        critical=_critical(machine, task, within),
        inside=_inside(machine, task, obstacles, within),
    )


def answer(machine: Machine, task: Task, within: Setting, found: Descent) -> Answer:
    """In joint values: the attitude turns evenly from that of the start to that of the goal."""
    found = found.done()
    q, reachable = _joints(machine, task, within, found.place)
    q[0] = task.q
    reachable &= bool((q >= machine.lower - 1e-6).all() and (q <= machine.upper + 1e-6).all())
    curve = Curve(make_interp_spline(found.t, q, k=3), float(found.t[-1]))
    ones = np.ones_like(found.t)
    time = Timed(found.t, found.t, ones, np.zeros(len(ones) - 1))
    off = found.place[-1] - _goal(machine, task, within)
    off[0] *= found.place[-1, 1]
    limits = task.cylindrical
    over = max(
        float((np.abs(found.speed) / limits.speed).max()),
        float((np.abs(found.acceleration) / limits.acceleration).max()),
    )
    rate = curve.at(np.array([curve.length]), 1)[0]
    moving = float((np.abs(rate) / task.max_velocity(machine)).max())
    return Answer(curve, time, reachable, float(np.linalg.norm(off)), over, moving, found.steps)


def _goal(machine: Machine, task: Task, within: Setting) -> Array:
    """(3,) of a `Problem`."""
    _, turn = _begin(machine, task, within)
    return np.array([abs(turn), *cylinder(machine, within.ends[0])[1:]])


def _begin(machine: Machine, task: Task, within: Setting) -> tuple[Array, float]:
    """(3,) theta, r, z at the start, and the angle from there to the goal [rad]."""
    turn = machine.sun.azimuth_sign * (within.ends[0, 0] - task.q[0])
    return cylinder(machine, task.q), float(turn)


def _joints(machine: Machine, task: Task, within: Setting, place: Array) -> tuple[Array, bool]:
    """(N, n) joint values of places (N, 3) of a `Problem`, and whether all can be."""
    begin, turn = _begin(machine, task, within)
    where = place.copy()
    where[:, 0] = begin[0] + np.sign(turn) * place[:, 0]
    phi0, phi1 = (float(attitude_of(machine, q)) for q in (task.q, within.ends[0]))
    share = np.clip(place[:, 0] / max(abs(turn), 1e-9), 0.0, 1.0)
    q, reachable = from_cylinder(machine, where, phi0 + share * (phi1 - phi0))
    q[:, 0] += task.q[0] - q[0, 0]
    q[:, 4:] = task.q[4:]
    return q, reachable


def _critical(machine: Machine, task: Task, within: Setting) -> Critical:
    """(7) and (9), corrected, of arm and load as one mass; none where masses are not known."""
    masses = within.masses

    def critical(place: Array, acceleration: Array) -> tuple[Array, Array]:
        if masses is None:
            return np.full(len(place), np.inf), np.full(len(place), np.inf)
        two = two_masses(masses, within.kept, _joints(machine, task, within, place)[0])
        swing = critical_swing(two, acceleration[:, 2], acceleration[:, 1])
        return swing.min(axis=1), critical_lift(two).min(axis=1)

    return critical


def _inside(machine: Machine, task: Task, obstacles: Obstacles, within: Setting) -> Inside:
    """Boxes, `clearance` larger on all sides, cut by a line outwards and one upwards."""
    begin, turn = _begin(machine, task, within)
    T = transform.inverse(machine.arm.T_root_swing)
    boxes = obstacles.boxes
    centers = transform.apply(T, boxes.centers) if len(boxes) else np.zeros((0, 3))
    turns, half = T[:3, :3] @ boxes.rotations, boxes.half_extents + task.clearance

    def inside(place: Array) -> tuple[Array, Array]:
        theta = begin[0] + np.sign(turn) * place[:, 0]
        out = np.stack([np.cos(theta), np.sin(theta), np.zeros_like(theta)], axis=1)
        p = place[:, 1:2] * out + place[:, 2:] * [0.0, 0.0, 1.0]
        entry, height = np.full(len(place), np.inf), np.full(len(place), -np.inf)
        for c, R, h in zip(centers, turns, half, strict=True):
            local = (p - c) @ R
            hit = (np.abs(local) < h).all(axis=1)
            if hit.any():
                back = _to_side(local[hit], -out[hit] @ R, h)
                up = _to_side(local[hit], np.broadcast_to(R[2], (int(hit.sum()), 3)), h)
                entry[hit] = np.minimum(entry[hit], place[hit, 1] - back)
                height[hit] = np.maximum(height[hit], place[hit, 2] + up)
        return entry, height

    return inside


def _to_side(p: Array, direction: Array, half: Array) -> Array:
    """(m,) how far from points p (m, 3) in a box along (m, 3) the side lies [m]."""
    with np.errstate(divide="ignore"):
        far = (half - np.sign(direction) * p) / np.abs(direction)
    return np.asarray(far.min(axis=1))
