"""A machine and a method in simulated time: no processes, no clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from backend.collision import box_distance
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.machine.pose import pose_error, tool_pose
from backend.planning.act import act, sight, task_rates
from backend.planning.cushion import rate_bounds
from backend.planning.proximity import Limits, near_points, posed
from backend.planning.records import Action, Method, Settings, State, Wish
from backend.planning.stopping import stoppable
from backend.planning.task_path import JointPath, follow
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

STEP = 0.02
"""[s] of a cycle."""

_STIFFNESS = 2.0  # [1/s]
_MAKE_UP = (0.6, 0.8)  # [m/s], [rad/s] by which a path is caught up with
_THERE = (0.03, 0.03)  # [m], [rad] from the last goal that count as arrived
_FAR = 1e3  # [m] told where nothing is near


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
) -> Run:
    """The tool follows a path for its duration and `extra` seconds; None is without any limit."""

    def wish(t: float, q: Array) -> Wish:
        T = tool_pose(machine, posed(machine, q, T_site_root))
        return follow(path.goal(machine, t, T_site_root), T, _STIFFNESS, _MAKE_UP)

    seconds = path.duration + extra
    done = run(method, machine, limits, path.postures[0], wish, settings, seconds, T_site_root)
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
) -> Run:
    """`wish(t, q)` acted upon every dt from rest at q_start (n,); None is without any limit.

    guarded: a stop must stay possible at every step (see `stopping.stoppable`); only with
    settings.accelerations.
    """
    n, count = len(machine.joints), round(seconds / dt)
    q, rates = np.array(q_start, dtype=float), np.zeros(n)
    times, all_q, all_rates = np.arange(count) * dt, np.empty((count, n)), np.empty((count, n))
    distance, scale, braked = np.full(count, _FAR), np.ones(count), np.zeros(count)
    why: list[tuple[str, ...]] = []

    def clearance(postures: Array) -> Array:
        return clearances(machine, limits, postures, T_site_root)

    for i in range(count):
        asked = wish(float(times[i]), q)
        T = posed(machine, q, T_site_root)
        if method is None:
            low, high = rate_bounds(machine, q, rates, dt, settings.accelerations)
            wanted = task_rates(machine, T, asked, settings.damping)
            action = Action(np.clip(wanted, low, high), 1.0, ())
        else:
            near = near_points(
                machine,
                T,
                limits,
                sight(machine, T, method, settings),
                corners=method != "potential",
            )
            distance[i] = float(near.distance.min(initial=_FAR))
            state = State(rates, T_site_root)
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
    machine: Machine, limits: Limits, q: Array, T_site_root: Array | None = None
) -> Array:
    """(m,) shortest distance of the machine's moving bodies to limits and own bodies in postures
    q (m, n) [m], negative on overlap.
    """
    T = link_poses(machine, q, T_site_root)[:, machine.body_link_index]
    m, bodies = T.shape[:2]
    R = T[..., :3, :3]
    centers = (R @ machine.bodies.centers[..., None])[..., 0] + T[..., :3, 3]
    every = Boxes(
        centers.reshape(-1, 3),
        (R @ machine.bodies.rotations).reshape(-1, 3, 3),
        np.tile(machine.bodies.half_extents, (m, 1)),
    )
    moving = np.flatnonzero(machine.body_joints.any(axis=1))
    count = len(limits.boxes)
    instant = np.arange(m)[:, None, None] * bodies
    found = np.full(m, np.inf)
    if count:
        i = (instant + moving[None, :, None] + np.zeros((1, 1, count), np.int64)).ravel()
        j = np.broadcast_to(np.arange(count), (m, len(moving), count)).ravel()
        d, _ = box_distance.pair_distances(every, limits.boxes, i, j)
        found = d.reshape(m, -1).min(axis=1)
    if len(machine.self_pair_index):
        pairs = machine.self_pair_index[None] + np.arange(m)[:, None, None] * bodies
        a, b = pairs[..., 0].ravel(), pairs[..., 1].ravel()
        d, _ = box_distance.pair_distances(every, every, a, b)
        found = np.minimum(found, d.reshape(m, -1).min(axis=1))
    return found


def _parts(error: Array) -> tuple[float, float]:
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
