"""What each machine's braking is judged by: its approaches to all partners near it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from backend.fusion.inflation import spread
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState
from backend.safety.approach import Approach, Motion, approach, joined
from backend.safety.braking import accelerations, full_speeds, stopping_distance
from backend.safety.record import Concern, Evidence, Level

LONGEST_DELAY = 0.7
"""Delays up to this are looked ahead for; above, motion is locked anyway [s]."""


def approach_of(
    own: str, machines: Mapping[str, MachineState], now: float, config: Config
) -> Approach | None:
    """None when no partner can be reached before everything stands."""
    state, machine = machines[own], config.machines[own]
    assert state.body is not None
    age = age_of(state, now)
    parts = []
    for name, other in machines.items():
        partner = config.machines[name]
        if name == own or other.body is None:
            continue
        apart = np.linalg.norm(other.body.swing_center - state.body.swing_center)
        way = _driven(config, own) + _driven(config, name)
        if apart > machine.bounding_radius + partner.bounding_radius + way:
            continue
        doubt = spread(machine, state.pose) + spread(partner, other.pose)
        parts.append(
            approach(
                machine,
                motion_of(state),
                partner,
                motion_of(other),
                name,
                config.limits.stop_below + doubt,
                age,
                LONGEST_DELAY,
            )
        )
    return joined(parts) if parts else None


def age_of(state: MachineState, now: float) -> float:
    """Age of what is known of a machine, by which its braking counts [s]."""
    return max(now - state.pose.time, min(state.pose.streams["joints"].age, 1.0), 0.0)


def unknown_ages(
    driven: frozenset[str], machines: Mapping[str, MachineState], now: float, config: Config
) -> Iterable[Concern]:
    """One concern for every driven machine while the age of its data or a partner's is not known.

    Ages that count from arrival leave out the way, and braking distances would be too short.
    """
    if not driven:
        return
    silent = [
        name
        for name, state in machines.items()
        if state.body is not None and state.pose.streams["joints"].age_source != "offset"
    ]
    for own in (name for name in config.own if silent and name in driven):
        label = config.labels[own if own in silent else silent[0]]
        n = len(config.machines[own].joints)
        nothing = Evidence(own, "", float("nan"), None, float("inf"))
        reason = f"{label} clock is silent: age unknown"
        zeros = np.zeros((n, 2)), np.zeros(2)
        yield Concern("age", own, Level.UNKNOWN, reason, *zeros, nothing, now)


def motion_of(state: MachineState) -> Motion:
    """Of a placed machine."""
    assert state.body is not None
    pose = state.pose
    poses = state.body.link_poses
    return Motion(poses, poses[0], pose.joint_velocities, pose.base_velocity, pose.yaw_rate)


def _driven(config: Config, name: str) -> float:
    """How far the tracks carry a machine before it stands, from full speed [m]."""
    machine = config.machines[name]
    full, a = full_speeds(machine)[-1:], accelerations(machine)[-1:]
    return float(stopping_distance(full, LONGEST_DELAY, a)[0]) + config.limits.slow_below
