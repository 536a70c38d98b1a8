"""What each machine can do from here: how far each joint may move, how long, and what ends it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from backend.cspace.margins import Margin, along, each_joint
from backend.fusion.inflation import joint_slack
from backend.machine.model import Machine
from backend.machine.stopping import full_stopping_distances, stopping_distances
from backend.pipeline.config import Config
from backend.pipeline.people_records import People
from backend.pipeline.records import (
    AS_THE_SITE_SAYS,
    Freedom,
    GaugeInForce,
    MachineMargins,
    MachineState,
    Motion,
    PairDistance,
)
from backend.pipeline.surroundings import Surroundings, growth, surroundings_of, why_unknown

STILL = 1e-3  # [rad/s] joints slower than this do not count as moving


def machine_margins(
    own: str,
    machines: Mapping[str, MachineState],
    pairs: Iterable[PairDistance],
    config: Config,
    gauge: GaugeInForce = AS_THE_SITE_SAYS,
    people: People | None = None,
) -> MachineMargins:
    """Every joint both ways, and all joints together as they move now."""
    reason = why_unknown(own, machines, pairs)
    if reason:
        return MachineMargins(own, float("nan"), reason, (), None)
    machine, pose = config.machines[own], machines[own].pose
    around = surroundings_of(own, machines, config, gauge, people)
    eta = growth(own, machines, config)
    n = len(machine.joints)
    directions = each_joint(n)
    rates = pose.joint_velocities
    moving = bool(np.isfinite(rates).all()) and float(np.abs(rates).max()) > STILL
    if moving:
        directions = np.concatenate([directions, rates[None]])
    found = along(machine, pose.joints, directions, around.boxes, eta, joint_slack(pose))
    now = stopping_distances(machine, rates, config.stop_latency).tolist()
    full = full_stopping_distances(machine, config.stop_latency).tolist()
    speeds = rates.tolist()
    return MachineMargins(
        own,
        eta,
        "",
        tuple(
            (
                _freedom(own, machine, around, found[2 * k], k, -1.0, speeds, now, full),
                _freedom(own, machine, around, found[2 * k + 1], k, 1.0, speeds, now, full),
            )
            for k in range(n)
        ),
        _motion(own, machine, around, found[-1]) if moving else None,
    )


def names(
    own: str, machine: Machine, around: Surroundings, margin: Margin
) -> tuple[str | None, str | None]:
    """(own body, what it meets) of a margin; both None at a joint's limit."""
    if margin.own is None or margin.hit is None:
        return None, None
    hit = (
        f"{own}:{machine.body_names[margin.hit]}" if margin.with_self else around.names[margin.hit]
    )
    return machine.body_names[margin.own], hit


def _freedom(
    own: str,
    machine: Machine,
    around: Surroundings,
    margin: Margin,
    joint: int,
    sign: float,
    rates: list[float],
    now: list[float],
    full: list[float],
) -> Freedom:
    body, hit = names(own, machine, around, margin)
    rate, fastest = sign * rates[joint], machine.joints[joint].max_velocity
    return Freedom(
        free=margin.free,
        own=body,
        hits=hit,
        time_now=margin.free / rate if rate > STILL else float("inf"),
        time_full=margin.free / fastest,
        stop_now=max(sign * now[joint], 0.0),
        stop_full=full[joint],
    )


def _motion(own: str, machine: Machine, around: Surroundings, margin: Margin) -> Motion:
    body, hit = names(own, machine, around, margin)
    return Motion(margin.free, body, hit)
