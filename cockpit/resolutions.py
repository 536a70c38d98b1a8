"""How densely the machines' motion is sampled: Sun 2020, Section 5.1."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from backend.cspace.resolution import resolution
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot


def resolutions(snapshot: Snapshot, config: Config, cycle_time: float) -> dict[str, dict[str, Any]]:
    """Per machine, at the rate that images really have. cycle_time: of the images [s]."""
    found = {}
    for name, state in snapshot.machines.items():
        speed = float(np.linalg.norm(state.pose.base_velocity))
        if not math.isfinite(speed):
            continue
        now = resolution(cycle_time, speed, state.pose.joint_velocities)
        roles = [joint.role for joint in config.machines[name].joints]
        found[name] = {
            "points_per_m": now.points_per_metre,
            "points_per_rad": dict(zip(roles, now.points_per_radian.tolist(), strict=True)),
        }
    return found
