"""Random tasks among random obstacles, and a judge that shares no code with what plans."""

from __future__ import annotations

from typing import NamedTuple

import fcl
import numpy as np

from backend.collision.box_distance import lower_bounds
from backend.machine.kinematics import body_boxes, end_point, link_poses
from backend.machine.model import Machine
from backend.planning.trajectory.carry import attitude_of
from backend.planning.trajectory.records import Obstacles, Task, Trajectory
from backend.planning.trajectory.sweep import make_sweep
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray
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


def random_task(machine: Machine, seed: int) -> tuple[Task, Obstacles]:
    """Start and goal at random; slabs, poles, walls and loose boxes over, under and beside."""
    rng = np.random.default_rng(seed)
    reach = machine.max_reach
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
    while True:
        start, goal = (low + rng.random(len(low)) * (high - low) for _ in range(2))
        start[4:] = goal[4:] = 0.0
        tips = end_point(machine, np.stack([start, goal]))
        clear = make_sweep(machine, Obstacles(), 0.2)
        if tips[:, 2].min() > 0.2 and not clear.near(start) and not clear.near(goal):
            break
    count = int(rng.integers(2, 12))
    around = rng.uniform(-np.pi, np.pi, count)
    far = reach * rng.uniform(0.35, 0.95, count)
    up = rng.uniform(0.0, 0.8 * reach, count)
    centers = np.stack([far * np.cos(around), far * np.sin(around), up], axis=1)
    shapes = np.array([[0.05, 0.05, 0.5], [0.5, 0.5, 0.04], [0.04, 0.5, 0.4], [0.12, 0.12, 0.12]])
    half = shapes[rng.integers(0, 4, count)] * reach * rng.uniform(0.3, 1.0, (count, 1))
    turns = rotation.from_quaternion(
        np.stack([np.cos(around / 2), 0 * around, 0 * around, np.sin(around / 2)], axis=1)
    )
    boxes = Boxes(centers, turns, half)
    kept = _apart(machine, boxes, np.stack([start, goal]), 0.25)
    boxes = boxes.take(kept)
    names = tuple(f"box {k}" for k in range(len(boxes)))
    task = Task(
        start,
        tips[1],
        attitude=float(attitude_of(machine, goal)) if rng.random() < 0.7 else None,
        band=float(rng.choice([0.0, 0.3, 1.0])),
        payload=float(rng.choice([0.0, 0.5, 1.0])) * machine.payload,
        clearance=float(rng.choice([0.05, 0.1, 0.2])),
    )
    return task, Obstacles(boxes, names)


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


def _apart(machine: Machine, boxes: Boxes, postures: Array, least: float) -> BoolArray:
    """(n,) which boxes are farther than `least` [m] from the machine in all postures."""
    kept = np.ones(len(boxes), dtype=bool)
    for T in link_poses(machine, postures):
        kept &= lower_bounds(body_boxes(machine, T), boxes).min(axis=0) > least
    return kept


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
