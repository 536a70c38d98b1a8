"""A trajectory for a task, or why there is none: goal, way, curve, timing, and the judge's word."""

from __future__ import annotations

from typing import Literal

import numpy as np

from backend.errors import InputError
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.planning.trajectory.carry import attitude_of, carry_of, goals
from backend.planning.trajectory.curve import Curve, free_curve
from backend.planning.trajectory.recheck import overdone, recheck
from backend.planning.trajectory.records import Checks, Obstacles, Refusal, Task, Trajectory
from backend.planning.trajectory.rows import limit_rows
from backend.planning.trajectory.sweep import CONTACT, Sweep, make_sweep
from backend.planning.trajectory.timing import Timed, casadi_timing, toppra_timing
from backend.planning.trajectory.way import Way, find_way, search
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.stability.dynamics import down, wrench_of
from backend.stability.masses import MassModel, mass_model, why_unknown
from backend.stability.polygon import Polygon, shrunk, support_polygon
from backend.stability.zmp import moments_of

Method = Literal["toppra", "casadi"]
METHODS: tuple[Method, ...] = ("toppra", "casadi")
STEP = 0.05
"""Between two rows of the result [s]."""
_RESERVE = 1.004  # for what lies between the samples of that
INTERVALS = (160, 800)
"""Fewest and most on the grid of the timing."""


def plan(
    machine: Machine, task: Task, obstacles: Obstacles, method: Method = "toppra"
) -> Trajectory | Refusal:
    """Time-optimal along a free way, re-checked. Raises InputError for a task that makes no sense.

    The root frame is the task's: obstacles and goal are given in it.
    """
    _check(machine, task)
    carry, notes = carry_of(machine, task.q), list[str]()
    why = why_unknown(machine)
    masses = None if why else mass_model(machine, task.payload)
    if why:
        notes.append(f"{why}: tipping over was not judged")
    whole = support_polygon(machine)
    kept = shrunk(whole, task.share)
    sweep = make_sweep(machine, obstacles, task.clearance)
    refused = _start(task, sweep, masses, kept)
    if refused is not None:
        return refused
    sweep = sweep.relaxed(task.q)
    ends = goals(machine, task, sweep)
    if isinstance(ends, Refusal):
        return ends
    if not stands(masses, kept, task, ends).all():
        return Refusal("tips", _tips("at the goal", masses, kept, task, ends[0]), proven=True)
    if np.abs(ends[0] - task.q).max() < 1e-6:
        raise InputError("task: the goal is where the machine is.")
    wide = sweep.widened(np.concatenate([task.q[None], ends]))
    way = find_way(
        machine, task, wide, carry, ends, lambda q: bool(stands(masses, kept, task, q).all())
    )
    if isinstance(way, Refusal):
        return way
    curve = free_curve(machine, way.points, 1.0 / task.max_velocity(machine), sweep)
    if curve is None:
        return Refusal("not found", "the way found is too tight to be rounded off.")
    intervals = int(np.clip(2 * curve.spans, *INTERVALS))
    rows = limit_rows(machine, task, curve, intervals, masses, kept)
    time = casadi_timing(rows) if method == "casadi" else toppra_timing(rows)
    if time is None:
        return Refusal("timing", "no timing keeps the limits along the way that was found.")
    # Limits hold at grid points; what they are exceeded by between them is made up for.
    time = time.slowed(_RESERVE * overdone(machine, task, curve, time))
    checks = recheck(machine, task, obstacles, sweep, curve, time, masses, whole)
    why = _failed(task, sweep, checks)
    if why:
        return Refusal("check", why)
    changed = float(attitude_of(machine, way.points[-1]) - attitude_of(machine, task.q))
    if task.attitude is None and abs(changed) > 1e-6:
        notes.append(f"the bucket's attitude changes by {np.degrees(changed):.0f} degrees")
    return _trajectory(curve, time, method, way, checks, tuple(notes))


def stands(masses: MassModel | None, support: Polygon, task: Task, q: Array) -> Array:
    """(m,) whether the machine at rest in postures (m, n) presses inside of `support`."""
    if masses is None:
        return np.ones(len(q), dtype=bool)
    return np.asarray(_at_rest(masses, support, task, q).min(axis=-1) >= 0.0)


def _at_rest(masses: MassModel, support: Polygon, task: Task, q: Array) -> Array:
    still = np.zeros_like(q)
    return moments_of(wrench_of(masses, q, still, still, down(task.T_site_root)), support)


def _tips(where: str, masses: MassModel | None, support: Polygon, task: Task, q: Array) -> str:
    assert masses is not None
    edge = support.names[int(_at_rest(masses, support, task, q[None])[0].argmin())]
    load = f" with {task.payload:g} kg" if task.payload > 0.0 else ""
    return (
        f"{where} the machine{load} is too near to tipping over its {edge} edge: less than "
        f"{100 * task.share:.0f} % of the way to it is left."
    )


def _check(machine: Machine, task: Task) -> None:
    if task.q.shape != (len(machine.joints),):
        raise InputError(f"task: q has {len(task.q)} values; {machine.name} has a joint for each.")
    outside = (task.q < machine.lower - 1e-6) | (task.q > machine.upper + 1e-6)
    if outside.any():
        role = machine.joints[int(np.argmax(outside))].role
        raise InputError(f"task: {role} is beyond its ends; no trajectory begins there.")


def _start(task: Task, sweep: Sweep, masses: MassModel | None, support: Polygon) -> Refusal | None:
    touching = [name for d, name in sweep.near(task.q) if d < CONTACT]
    if touching:
        why = f"at the start the machine touches {touching[0]}."
        return Refusal("start", why, tuple(touching), proven=True)
    if not stands(masses, support, task, task.q[None]).all():
        return Refusal("tips", _tips("at the start", masses, support, task, task.q), proven=True)
    return None


def _failed(task: Task, sweep: Sweep, checks: Checks) -> str:
    """Why the judge refuses, empty when it does not."""
    if checks.min_clearance < sweep.kept - 1e-6 or checks.min_own <= 0.0:
        return "the re-check found the way nearer to something than it was planned."
    if checks.min_stability_margin <= 0.0:
        return "the re-check found the machine to tip over."
    if max(checks.worst_rate, checks.worst_acceleration) > 1.001:
        return "the re-check found joints faster than their limits."
    return ""


def _trajectory(
    curve: Curve, time: Timed, method: str, way: Way, checks: Checks, notes: tuple[str, ...]
) -> Trajectory:
    t = time.times(STEP)
    q, rates, accelerations = time.sampled(curve, t)
    return Trajectory(t, q, rates, accelerations, method, way.how, checks, notes)


def rehearse(machine: Machine) -> Trajectory | Refusal:
    """Makes the compiled parts ready and loads the rest: a swing and a search in the air, past a
    box. Returns what came of the swing.
    """
    low = np.where(np.isfinite(machine.lower), machine.lower, -1.0)
    high = np.where(np.isfinite(machine.upper), machine.upper, 1.0)
    q = 0.5 * (low + high)
    q[4:] = 0.0
    goal = q.copy()
    goal[0] += 0.5
    task = Task(q, end_point(machine, goal), band=0.2)
    aside = 3.0 * np.array([[0.0, 0.0, machine.bounding_radius]])
    box = Boxes(aside, np.eye(3)[None], np.full((1, 3), 0.1))
    obstacles = Obstacles(box, ("box",), ground=False)
    sweep, carry = make_sweep(machine, obstacles, task.clearance).relaxed(q), carry_of(machine, q)
    search(machine, task, sweep, carry, goal[None], np.zeros(len(sweep.names), np.int64), 0, 50)
    return plan(machine, task, obstacles)
