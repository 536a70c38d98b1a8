"""The tasks of `bench_plan`: random ones among boxes, and one as in Yamashita and Kikuuwe 2025."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from backend.collision.box_distance import lower_bounds
from backend.machine.kinematics import body_boxes, end_point, link_poses
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.planning.trajectory.carry import attitude_of, from_cylinder
from backend.planning.trajectory.curve import Curve, curve_along
from backend.planning.trajectory.records import Cylindrical, Obstacles, Task
from backend.planning.trajectory.sweep import make_sweep
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray


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


def lifted_curve() -> tuple[Machine, Task, Curve]:
    """As in Yamashita and Kikuuwe 2025: an ex13 carries 1.5 t from 30 to 150 degrees at 5 m, here
    lifted by 1.5 m over something.
    """
    machine, start, end = load_machine("ex13"), np.pi / 6, 5 * np.pi / 6
    where = np.array([[start, 5.0, 1.0], [start, 5.0, 2.5], [end, 5.0, 2.5], [end, 5.0, 1.0]])
    dense = np.concatenate(
        [a + np.linspace(0, 1, 30)[:, None] * (b - a) for a, b in pairwise(where)]
    )
    q, inside = from_cylinder(machine, dense, np.full(len(dense), -1.9))
    if not inside:
        raise RuntimeError("ex13 cannot make the move that it is to be measured by")
    task = Task(q[0], np.zeros(3), payload=1500.0, share=0.2)
    return machine, task, curve_along(q, 1.0 / machine.max_velocity, 0.4)


def _apart(machine: Machine, boxes: Boxes, postures: Array, least: float) -> BoolArray:
    """(n,) which boxes are farther than `least` [m] from the machine in all postures."""
    kept = np.ones(len(boxes), dtype=bool)
    for T in link_poses(machine, postures):
        kept &= lower_bounds(body_boxes(machine, T), boxes).min(axis=0) > least
    return kept


def paper_task() -> tuple[Machine, Task, Obstacles]:
    """As in Yamashita and Kikuuwe 2025: the same carry with the limits that it states, something
    on the line from start to goal; load, heights and the obstacle are not given there.
    """
    machine = load_machine("ex13")
    ends = np.array([[np.pi / 6, 5.0, 1.0], [5 * np.pi / 6, 5.0, 1.0]])
    q, inside = from_cylinder(machine, ends, np.full(2, -1.9))
    if not inside:
        raise RuntimeError("ex13 cannot make the move that it is to be measured by")
    limits = Cylindrical(np.array([0.08, 1.0, 0.25]), np.array([0.04, 5.0, 3.0]))
    task = Task(
        q[0],
        end_point(machine, q[1]),
        attitude=-1.9,
        payload=1500.0,
        clearance=0.1,
        lift=0.5,
        cylindrical=limits,
    )
    top = 0.5 * (machine.arm.T_root_swing[2, 3] + 1.6)
    thing = Boxes(np.array([[0.0, 5.2, top]]), np.eye(3)[None], np.array([[0.3, 0.3, top]]))
    return machine, task, Obstacles(thing, ("thing",))
