"""Task paths: goal poses over time, given in joint space (Mäkinen 2021, Section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.machine.pose import pose_error, tool_jacobian_at, tool_pose
from backend.planning.proximity import posed
from backend.planning.records import Wish
from backend.spatial.types import Array, frozen


class Goal(NamedTuple):
    """T_site_tool (4, 4) and its twist (6,) [m/s, rad/s]."""

    pose: Array
    twist: Array


@dataclass(frozen=True)
class JointPath:
    """Postures (m, n) [rad] that are passed at rest, and the seconds (m - 1,) between them.

    Between two postures every joint follows 10 s^3 - 15 s^4 + 6 s^5, so that speed and
    acceleration are zero at both.
    """

    postures: Array
    seconds: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "postures", frozen(self.postures, (None, None), "postures"))
        count = len(self.postures) - 1
        object.__setattr__(self, "seconds", frozen(self.seconds, (count,), "seconds"))
        if not (self.seconds > 0.0).all():
            raise InputError("path: the seconds between two postures must be above 0.")

    @cached_property
    def times(self) -> Array:
        """(m,) when each posture is passed [s]."""
        return np.concatenate([[0.0], np.cumsum(self.seconds)])

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    def at(self, t: float) -> tuple[Array, Array]:
        """Joint values (n,) [rad] and rates (n,) [rad/s] at time t [s]; at rest outside."""
        k = int(np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.seconds) - 1))
        s = float(np.clip((t - self.times[k]) / self.seconds[k], 0.0, 1.0))
        way = self.postures[k + 1] - self.postures[k]
        part = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        speed = 30.0 * s**2 * (1.0 - s) ** 2 / self.seconds[k]
        return self.postures[k] + part * way, speed * way

    def goal(self, machine: Machine, t: float, T_site_root: Array | None = None) -> Goal:
        q, rates = self.at(t)
        T = posed(machine, q, T_site_root)
        return Goal(tool_pose(machine, T), tool_jacobian_at(machine, T) @ rates)


def follow(goal: Goal, T_site_tool: Array, stiffness: float, most: tuple[float, float]) -> Wish:
    """The twist that follows a goal: its own, and `stiffness` [1/s] times the pose error, of which
    at most most = (m/s, rad/s) is made up for."""
    error = stiffness * pose_error(goal.pose, T_site_tool)
    back = np.concatenate([_short(error[:3], most[0]), _short(error[3:], most[1])])
    return Wish(twist=goal.twist + back)


def _short(v: Array, most: float) -> Array:
    return np.asarray(v * min(1.0, most / max(float(np.linalg.norm(v)), 1e-12)))
