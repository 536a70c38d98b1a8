"""What each machine's braking is judged by: its approaches to all partners near it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from backend.fusion.inflation import spread
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState
from backend.safety.approach import Approach, Motion, approach, joined
from backend.safety.braking import accelerations, full_speeds, stopping_distance

LONGEST_DELAY = 0.7
"""Delays up to this are looked ahead for; above, motion is locked anyway [s]."""


def approach_of(
    own: str, machines: Mapping[str, MachineState], now: float, config: Config
) -> Approach | None:
    """None when no partner can be reached before everything stands."""
    state, machine = machines[own], config.machines[own]
    assert state.body is not None
    ages = [state.pose.streams[key].age for key in ("joints", "position", "heading")]
    age = max(now - state.pose.time, min(ages[0], 1.0), 0.0)
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
