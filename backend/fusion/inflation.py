"""How far bodies are grown for what is not known exactly: eta.

    eta = configured + 3 sigma + speed * age

sigma^2 = sigma_position^2 + (reach * sigma_yaw)^2 + sum_k (lever_k * sigma_k)^2, the bucket
tip's standard deviation from independent errors, at full stretch (an upper bound in every posture).
speed * age = |base velocity| * age of the position + sum_k lever_k |rate_k| * age of the joints,
the way the tip can have gone since its data were measured. Ages are the worst cases of the clock's
bounds, so that eta grows with age before the pose goes stale.
"""

from __future__ import annotations

import math

import numpy as np

from backend.fusion.pose import FusedPose
from backend.machine.model import Machine
from backend.spatial.types import Array

OLDEST = 1.0  # any pose is long stale by then; keeps eta finite for drawing [s]


def levers(machine: Machine) -> Array:
    """(n,) distance from each joint's axis to the bucket tip at full stretch, at most [m]."""
    _, boom, stick, bucket = machine.sun.lengths
    reach = {"swing": machine.max_reach, "boom": boom + stick + bucket, "stick": stick + bucket}
    return np.array([reach.get(joint.role, bucket) for joint in machine.joints])


def spread(machine: Machine, pose: FusedPose) -> float:
    """3 sigma of the bucket tip from independent errors, at full stretch [m]."""
    variance = (
        pose.sigma_position**2
        + (machine.max_reach * pose.sigma_yaw) ** 2
        + float(np.sum((levers(machine) * pose.joint_sigmas) ** 2))
    )
    return 3.0 * math.sqrt(variance)


def eta(machine: Machine, pose: FusedPose, configured: float) -> float:
    """Inflation of every body of one machine [m]. configured: the site's factor [m]."""
    arms = levers(machine)
    base_age = min(pose.streams["position"].age, OLDEST)
    arm_age = min(pose.streams["joints"].age, OLDEST)
    travelled = float(np.linalg.norm(pose.base_velocity)) * base_age
    swept = float(arms @ np.abs(pose.joint_velocities)) * arm_age
    return configured + spread(machine, pose) + travelled + swept


def joint_slack(pose: FusedPose) -> Array:
    """(n,) how far each joint may be from its value: 3 sigma + |rate| * age [rad]."""
    age = min(pose.streams["joints"].age, OLDEST)
    return np.asarray(3.0 * pose.joint_sigmas + np.abs(pose.joint_velocities) * age)
