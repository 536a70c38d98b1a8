"""A trajectory for a task, or why there is none: goal, way, curve, timing, and the judge's word."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.planning.trajectory.carry import attitude_of, carry_of
from backend.planning.trajectory.course import Course, Setting, course, setting
from backend.planning.trajectory.curve import Curve
from backend.planning.trajectory.penalty import Iteration
from backend.planning.trajectory.recheck import overdone, recheck
from backend.planning.trajectory.records import Checks, Obstacles, Refusal, Task, Trajectory
from backend.planning.trajectory.reference import by_penalty
from backend.planning.trajectory.rows import limit_rows
from backend.planning.trajectory.sweep import make_sweep
from backend.planning.trajectory.timing import Timed, casadi_timing, toppra_timing
from backend.planning.trajectory.way import search
from backend.spatial.boxes import Boxes

Method = Literal["toppra", "casadi", "penalty"]
METHODS: tuple[Method, ...] = ("toppra", "casadi", "penalty")
STEP = 0.05
"""Between two rows of the result [s]."""
MISSED, OVER = 0.01, 1.01
"""By how much the penalty method may miss the goal [m] and exceed limits along theta, r, z, which
it never keeps exactly."""
_RESERVE = 1.004  # for what lies between the samples of that
INTERVALS = (160, 800)
"""Fewest and most on the grid of the timing."""


def plan(
    machine: Machine,
    task: Task,
    obstacles: Obstacles,
    method: Method = "toppra",
    told: Callable[[Iteration], None] | None = None,
) -> Trajectory | Refusal:
    """Time-optimal along a free way, re-checked. Raises InputError for a task that makes no sense.

    The root frame is the task's: obstacles and goal are given in it. The penalty method's result
    comes with its violations; `told` hears of each of its steps.
    """
    within = setting(machine, task, obstacles)
    if isinstance(within, Refusal):
        return within
    if method == "penalty":
        return _penalty(machine, task, obstacles, within, told)
    found = course(machine, task, within)
    if isinstance(found, Refusal):
        return found
    way, curve = found
    time = timing(machine, task, within, found, method)
    if time is None:
        return Refusal("timing", "no timing keeps the limits along the way that was found.")
    checks = recheck(
        machine, task, obstacles, within.sweep, curve, time, within.masses, within.whole
    )
    broken = _broken(within, checks)
    if broken:
        return Refusal("check", broken[0])
    return _trajectory(curve, time, method, way.how, checks, _notes(machine, task, within))


def _penalty(
    machine: Machine,
    task: Task,
    obstacles: Obstacles,
    within: Setting,
    told: Callable[[Iteration], None] | None,
) -> Trajectory:
    made = by_penalty(machine, task, obstacles, within, told)
    checks = recheck(
        machine, task, obstacles, within.sweep, made.curve, made.time, within.masses, within.whole
    )
    broken = _broken(within, checks)
    if not made.reachable:
        broken.append("it leaves the arm's reach or the joints' ends.")
    if made.missed > MISSED:
        broken.append(f"it ends {made.missed:.2f} m from the goal.")
    if made.over > OVER:
        broken.append(f"it takes {made.over:.2f} times a limit along theta, r or z.")
    if made.moving > OVER - 1.0:
        broken.append(f"a joint still moves at the end, at {made.moving:.2f} of its full speed.")
    exact = f"it ends {1e3 * made.missed:.0f} mm from the goal"
    return _trajectory(
        made.curve,
        made.time,
        "penalty",
        f"{made.steps} steps of steepest descent",
        checks,
        (*_notes(machine, task, within), exact),
        tuple(broken),
    )


def _notes(machine: Machine, task: Task, within: Setting) -> tuple[str, ...]:
    changed = float(attitude_of(machine, within.ends[0]) - attitude_of(machine, task.q))
    if task.attitude is not None or abs(changed) <= 1e-6:
        return within.notes
    turned = f"the bucket's attitude changes by {np.degrees(changed):.0f} degrees"
    return (*within.notes, turned)


def timing(
    machine: Machine, task: Task, within: Setting, found: Course, method: Method = "toppra"
) -> Timed | None:
    """Time along the curve as short as the limits allow; None where none keeps them."""
    curve = found.curve
    intervals = int(np.clip(2 * curve.spans, *INTERVALS))
    rows = limit_rows(machine, task, curve, intervals, within.masses, within.kept)
    time = casadi_timing(rows) if method == "casadi" else toppra_timing(rows)
    if time is None:
        return None
    # Limits hold at grid points; what they are exceeded by between them is made up for.
    return time.slowed(_RESERVE * overdone(machine, task, curve, time))


def _broken(within: Setting, checks: Checks) -> list[str]:
    """Why the judge refuses, empty when it does not."""
    found = []
    if checks.min_clearance < within.sweep.kept - 1e-6 or checks.min_own <= 0.0:
        found.append("the re-check found the way nearer to something than it was planned.")
    if checks.min_ground <= 0.0:
        found.append("the re-check found the machine to touch the ground.")
    if checks.min_stability_margin <= 0.0:
        found.append("the re-check found the machine to tip over.")
    if max(checks.worst_rate, checks.worst_acceleration) > 1.001:
        found.append("the re-check found joints faster than their limits.")
    return found


def _trajectory(
    curve: Curve,
    time: Timed,
    method: str,
    how: str,
    checks: Checks,
    notes: tuple[str, ...],
    violations: tuple[str, ...] = (),
) -> Trajectory:
    t = time.times(STEP)
    q, rates, accelerations = time.sampled(curve, t)
    return Trajectory(t, q, rates, accelerations, method, how, checks, notes, violations)


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
