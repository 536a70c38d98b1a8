"""A machine and a method in simulated time: no processes, no clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from backend.machine.kinematics import body_boxes
from backend.machine.model import Machine
from backend.machine.pose import pose_error, tool_pose
from backend.planning import proximity_kernels
from backend.planning.act import act, sight, task_rates
from backend.planning.cushion import rate_bounds
from backend.planning.proximity import Limits, near_points, posed
from backend.planning.records import Action, Method, Settings, State, Wish
from backend.planning.stopping import stoppable
from backend.planning.task_path import JointPath, follow
from backend.spatial.types import Array

STEP = 0.02
"""[s] of a cycle."""

_STIFFNESS = 2.0  # [1/s]
_MAKE_UP = (0.6, 0.8)  # [m/s], [rad/s] by which a path is caught up with
_THERE = (0.03, 0.03)  # [m], [rad] from the last goal that count as arrived
_JUDGED = 1.0  # [m] beyond which a stop's clearance does not matter
_FAR = 1e3  # [m] told where nothing is near


Tell = Callable[[float], None]


def untold(_: float) -> None:
    """Nobody is told how far a run is."""


class Run(NamedTuple):
    """m instants: times (m,) [s]; q (m, n) [rad]; rates (m, n) [rad/s], commanded at the instant;
    distance (m,) shortest to a limit or an own body [m]; scale (m,) see Action; error (m, 2) of the
    tool from the goal [m], [rad], NaN without a path; braked (m,) whether a stop was enforced;
    arrived: when the end of the path was reached [s], NaN where never; why: of each instant.
    """

    times: Array
    q: Array
    rates: Array
    distance: Array
    scale: Array
    error: Array
    braked: Array
    arrived: float
    why: tuple[tuple[str, ...], ...]


def follow_path(
    method: Method | None,
    machine: Machine,
    limits: Limits,
    path: JointPath,
    settings: Settings,
    extra: float = 0.0,
    T_site_root: Array | None = None,
    tell: Tell = untold,
) -> Run:
    """The tool follows a path for its duration and `extra` seconds; None is without any limit.

    tell: see `run`.
    """

    def wish(t: float, q: Array) -> Wish:
        T = tool_pose(machine, posed(machine, q, T_site_root))
        return follow(path.goal(machine, t, T_site_root), T, _STIFFNESS, _MAKE_UP)

    seconds = path.duration + extra
    q_start = path.postures[0]
    done = run(method, machine, limits, q_start, wish, settings, seconds, T_site_root, tell=tell)
    error = np.array(
        [
            _parts(
                pose_error(
                    path.goal(machine, float(t), T_site_root).pose,
                    tool_pose(machine, posed(machine, q, T_site_root)),
                )
            )
            for t, q in zip(done.times, done.q, strict=True)
        ]
    )
    there = (done.times >= path.duration - 1e-9) & (error < _THERE).all(axis=1)
    arrived = float(done.times[np.argmax(there)]) if there.any() else float("nan")
    return done._replace(error=error, arrived=arrived)


def run(
    method: Method | None,
    machine: Machine,
    limits: Limits,
    q_start: Array,
    wish: Callable[[float, Array], Wish],
    settings: Settings,
    seconds: float,
    T_site_root: Array | None = None,
    guarded: bool = False,
    dt: float = STEP,
    tell: Tell = untold,
) -> Run:
    """`wish(t, q)` acted upon every dt from rest at q_start (n,); None is without any limit.

    guarded: a stop must stay possible at every step (see `stopping.stoppable`); only with
    settings.accelerations. tell: called with the time of every step [s]; what it raises ends the
    run.
    """
    n, count = len(machine.joints), round(seconds / dt)
    q, rates = np.array(q_start, dtype=float), np.zeros(n)
    times: Array = np.arange(count, dtype=float) * dt
    all_q, all_rates = np.empty((count, n)), np.empty((count, n))
    distance, scale, braked = np.full(count, _FAR), np.ones(count), np.zeros(count)
    why: list[tuple[str, ...]] = []

    def clearance(postures: Array) -> Array:
        return clearances(machine, limits, postures, T_site_root, cap=_JUDGED)

    for i in range(count):
        tell(float(times[i]))
        asked = wish(float(times[i]), q)
        T = posed(machine, q, T_site_root)
        if method is None:
            low, high = rate_bounds(machine, q, rates, dt, settings.accelerations)
            wanted = task_rates(machine, T, asked, settings.damping)
            action = Action(np.clip(wanted, low, high), 1.0, (), np.zeros(0, dtype=np.int64))
        else:
            state = State(rates, T_site_root)
            near = near_points(
                machine,
                T,
                limits,
                sight(machine, T, method, settings, state, dt),
                corners=method != "potential",
            )
            distance[i] = float(near.distance.min(initial=_FAR))
            action = act(method, machine, q, asked, near, state, dt, settings)
        moved = action.rates
        if guarded and method is not None:
            keep = 0.5 * settings.thresholds.lower
            moved, as_asked = stoppable(machine, q, rates, moved, dt, clearance, keep)
            braked[i] = not as_asked
        all_q[i], all_rates[i], scale[i] = q, moved, action.scale
        why.append(action.why)
        q, rates = q + moved * dt, moved
    error = np.full((count, 2), np.nan)
    return Run(times, all_q, all_rates, distance, scale, error, braked, float("nan"), tuple(why))


def clearances(
    machine: Machine,
    limits: Limits,
    q: Array,
    T_site_root: Array | None = None,
    cap: float = np.inf,
) -> Array:
    """(m,) shortest distance of the machine's moving bodies to limits and own bodies in postures
    q (m, n) [m], negative on overlap, `cap` where it is longer.
    """
    count = len(limits.boxes)
    moving = np.flatnonzero(machine.body_joints.any(axis=1))
    outer = np.stack([np.repeat(moving, count), np.tile(np.arange(count), len(moving))], axis=1)
    found = np.empty(len(q))
    b = limits.boxes
    for k, posture in enumerate(q):
        a = body_boxes(machine, posed(machine, posture, T_site_root))
        mine = (a.centers, a.rotations, a.half_extents)
        own = proximity_kernels.shortest(*mine, *mine, machine.self_pair_index, cap)
        found[k] = proximity_kernels.shortest(
            *mine, b.centers, b.rotations, b.half_extents, outer, own
        )
    return found


def _parts(error: Array) -> tuple[float, float]:
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
