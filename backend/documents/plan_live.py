"""A trajectory's task from a live snapshot: what an operator asks, among all that is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from backend.documents.plan import by_role, cylindrical
from backend.documents.plan_state import PlanRequest
from backend.errors import InputError
from backend.fusion.inflation import spread
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.people import everybody, lost_boxes
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import surroundings, why_unknown
from backend.pipeline.working_gauge import site_of
from backend.planning.trajectory.announced import passed
from backend.planning.trajectory.carry import attitude_of
from backend.planning.trajectory.records import Obstacles, Task
from backend.safety.people import Watch
from backend.spatial import transform
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.types import Array

SHARE = 0.1
"""Of the way from the tracks' middle to an edge that is kept free, where the site keeps less."""
FAST = 0.05
"""A machine whose joints are slower than this is at rest [rad/s]."""


@dataclass(frozen=True, eq=False)
class LiveTask:
    """What is planned, as it was at `time` [s] of the snapshot's clock. T_site_root: (4, 4); keep:
    what the limiter keeps from everything [m], which the task's clearance exceeds; goal: (n,) [rad]
    where joint values were asked for.
    """

    machine: str
    time: float
    task: Task
    obstacles: Obstacles
    T_site_root: Array
    keep: float
    goal: Array | None


class Announced(NamedTuple):
    """What another machine is about to do: joints (m, n) [rad] from now on; T_site_root: (4, 4)."""

    joints: Array
    T_site_root: Array


def live_task(
    asked: PlanRequest,
    snapshot: Snapshot,
    config: Config,
    announced: Mapping[str, Announced] = MappingProxyType({}),
) -> LiveTask:
    """announced: trajectories of other machines, by name: all that they pass is kept clear of.

    Raises InputError for what makes no sense, and while anything is not known that counts."""
    name = asked.machine
    if name not in config.own:
        raise InputError(f'machine is "{name}"; allowed are {", ".join(config.own)}.')
    why = unknown(name, snapshot, config)
    if why:
        raise InputError(f"{why}: nothing is planned before that is known.")
    state, machine = snapshot.machines[name], config.machines[name]
    assert state.body is not None
    rates = state.pose.joint_velocities
    if not (np.abs(rates) < FAST).all():
        role = machine.joints[int(np.nanargmax(np.abs(rates)))].role
        raise InputError(f"{config.labels[name]} moves ({role}); a trajectory begins at rest.")
    T_site_root = state.body.link_poses[0]
    keep, T_root_site = kept(name, snapshot, config), transform.inverse(T_site_root)
    if not math.isfinite(keep):
        raise InputError(f"{config.labels[name]}: how far poses may be wrong is not known.")
    # Sensors may tell joints a little beyond their ends.
    q = np.clip(state.pose.joints, machine.lower, machine.upper)
    goal, attitude = None, asked.goal.attitude
    if asked.goal.joints is None:
        assert asked.goal.end_point is not None
        p_root = transform.apply(T_root_site, np.array([asked.goal.end_point]))[0]
    else:
        goal = _goal(machine, asked.goal.joints, q)
        p_root, attitude = end_point(machine, goal), float(attitude_of(machine, goal))
    keeps_free = 0.0 if config.stability is None else config.stability.keep
    task = Task(
        q=q,
        p_root=p_root,
        attitude=attitude,
        band=asked.attitude_band,
        payload=asked.payload,
        clearance=keep + asked.clearance,
        lift=asked.lift,
        share=max(SHARE, keeps_free),
        speeds=by_role(machine, asked.limits, "joint_velocities", "plan"),
        accelerations=by_role(machine, asked.limits, "joint_accelerations", "plan"),
        cylindrical=cylindrical(asked.limits.cylindrical),
        T_site_root=T_site_root,
    )
    obstacles = obstacles_of(name, snapshot, config, asked.ground)
    for other, way in announced.items():
        taken = passed(config.machines[other], way.joints, way.T_site_root).moved(T_root_site)
        boxes = concatenated([obstacles.boxes, taken])
        names = *obstacles.names, *(f"{other}:trajectory",) * len(taken)
        obstacles = replace(obstacles, boxes=boxes, names=names)
    return LiveTask(name, snapshot.time, task, obstacles, T_site_root, keep, goal)


def unknown(name: str, snapshot: Snapshot, config: Config) -> str:
    """What is not known of the machine `name` and of what it could meet; empty when all is."""
    why = why_unknown(name, snapshot.machines, snapshot.pairs)
    if why:
        own = snapshot.machines[name].pose.reasons
        return f"{config.labels[name]} {why}" if why in own or why == "is unknown" else why
    if snapshot.people is not None and snapshot.people.reason:
        return f"people: {snapshot.people.reason}"
    return ""


def kept(name: str, snapshot: Snapshot, config: Config) -> float:
    """What the limiter keeps at least from machines and the site [m]: the stop distance and what
    both poses may be wrong by.
    """
    wrong = {k: spread(config.machines[k], s.pose) for k, s in snapshot.machines.items()}
    others = [value for k, value in wrong.items() if k != name]
    return config.limits.stop_below + wrong[name] + max(others, default=0.0)


def obstacles_of(name: str, snapshot: Snapshot, config: Config, ground: bool) -> Obstacles:
    """All that the placed machine `name` could meet, in its root frame, and the ground's plane.

    People and what moves are wider by three sigma, and by what the limiter keeps from them beyond
    what it keeps from the site; who was lost lately still counts.
    """
    states = snapshot.machines
    body = states[name].body
    assert body is not None
    others = {
        k: (config.machines[k], state.body)
        for k, state in states.items()
        if k != name and state.body is not None
    }
    found = surroundings(
        config.machines[name],
        body,
        others,
        site_of(name, snapshot.gauge, config),
        people_of(snapshot, config),
    )
    return Obstacles(found.boxes, found.names, ground)


def people_of(snapshot: Snapshot, config: Config) -> tuple[Boxes, tuple[str, ...]]:
    """Everybody who counts, as wide as `obstacles_of` takes them, in the site frame."""
    people, watch = snapshot.people, config.people
    if people is None or watch is None:
        return NO_BOXES, ()
    boxes, names = everybody(people)
    lost = tuple(one for one in people.lost if snapshot.time - one.lost < watch.remembered)
    everyone = concatenated([boxes, lost_boxes(lost)])
    return everyone.inflated(_wider(watch, config)), (
        *names,
        *(f"person:P{one.id}" for one in lost),
    )


def _wider(watch: Watch, config: Config) -> float:
    return max(0.0, watch.stop_below - config.limits.stop_below)


def _goal(machine: Machine, joints: dict[str, float], q: Array) -> Array:
    """(n,) q with the values of `joints` in their places."""
    roles = [joint.role for joint in machine.joints]
    goal = q.copy()
    for role, value in joints.items():
        if role not in roles:
            raise InputError(f"goal.joints.{role} is unknown; allowed are {', '.join(roles)}.")
        k = roles.index(role)
        if not machine.lower[k] <= value <= machine.upper[k]:
            raise InputError(
                f"goal.joints.{role} is {value:.3f}; allowed is {machine.lower[k]:.3f} to "
                f"{machine.upper[k]:.3f} rad."
            )
        goal[k] = value
    return goal
