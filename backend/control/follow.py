"""Following a trajectory while its operator holds the dead-man: velocities, cycle by cycle.

The path's own time runs as fast as the machine keeps up, and stands while nothing may move, so that
a limit, a pause or a slow joint delays the trajectory and never leads off it. What comes out is a
wish like that of sticks: the limiter judges it against the scene as it is now.

    wish = sigma * rates(s) + GAIN * (joints(s - sigma * T) - q),    s advances by sigma * dt

q is what the sensors saw, T their age and the command's way: the machine is compared with where it
was told to be by then. sigma falls from 1 to 0 while the error rises from KEPT to LOST / 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array

GAIN = 1.0
"""[1/s] by which what is left of the error is made up."""
NEAR = float(np.radians(3.0))
"""A trajectory begins this near to its first posture [rad]."""
KEPT = float(np.radians(2.0))
"""Errors up to this do not slow the path's time [rad]."""
LOST = float(np.radians(12.0))
"""Beyond this the machine is no longer on its trajectory [rad]."""
THERE = float(np.radians(0.7))
"""At the end each joint is brought this near to its goal [rad]."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """times: (m,) rising from 0 [s]; joints: (m, n) [rad], not wrapped; rates: (m, n) [rad/s].

    Raises InputError unless that is what they are, with m >= 2.
    """

    times: Array
    joints: Array
    rates: Array

    def __post_init__(self) -> None:
        m = len(self.times)
        fits = self.joints.ndim == 2 and self.joints.shape == self.rates.shape
        if m < 2 or not fits or len(self.joints) != m:
            raise InputError(
                f"trajectory: {m} times for joints {self.joints.shape} and rates "
                f"{self.rates.shape}; allowed are (m,), (m, n) and (m, n), m of 2 or more."
            )
        if not all(np.isfinite(v).all() for v in (self.times, self.joints, self.rates)):
            raise InputError("trajectory: a value is not finite; allowed are finite numbers.")
        if self.times[0] != 0.0 or not (np.diff(self.times) > 0.0).all():
            raise InputError("trajectory: its times do not rise from 0 s.")

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    def at(self, t: float) -> tuple[Array, Array]:
        """(n,) joints [rad] and rates [rad/s] at t [s]: cubic between, at rest outside."""
        if t <= 0.0:
            return self.joints[0], np.zeros_like(self.rates[0])
        if t >= self.duration:
            return self.joints[-1], np.zeros_like(self.rates[0])
        k = int(np.searchsorted(self.times, t, side="right")) - 1
        h = self.times[k + 1] - self.times[k]
        u = (t - self.times[k]) / h
        a, b = self.joints[k], self.joints[k + 1]
        va, vb = self.rates[k] * h, self.rates[k + 1] * h
        rise, bend = 3.0 * (b - a) - 2.0 * va - vb, va + vb - 2.0 * (b - a)
        q = a + u * (va + u * (rise + u * bend))
        return q, (va + u * (2.0 * rise + 3.0 * u * bend)) / h


@dataclass(frozen=True)
class Follow:
    """at: the path's time [s]; pace: sigma of the last cycle; error: (n,) [rad], joints told minus
    seen; ended: why it is over, empty while it is not.
    """

    trajectory: Trajectory
    at: float = 0.0
    pace: float = 0.0
    error: Array | None = None
    ended: str = ""

    @property
    def arrived(self) -> bool:
        return self.ended == ARRIVED


ARRIVED = "arrived"


def advance(
    follow: Follow, q: Array, lag: float, moves: bool, dt: float, continuous: Array | None = None
) -> tuple[Follow, Array]:
    """The following cycle, and the wish (n,) [rad/s].

    q: (n,) joints as seen [rad], NaN where unknown; lag: T [s]; moves: whether the dead-man is held
    and nothing pauses; dt: since the last cycle [s]; continuous: (n,) joints without ends, which
    are compared modulo a turn.
    """
    still = np.zeros(len(q))
    if follow.ended:
        return follow, still
    if not np.isfinite(q).all():
        return replace(follow, pace=0.0), still
    path = follow.trajectory
    told, _ = path.at(follow.at - follow.pace * lag)
    error = told - q
    if continuous is not None:
        turned = (error + np.pi) % (2.0 * np.pi) - np.pi
        error = np.where(continuous, turned, error)
    most = float(np.abs(error).max())
    follow = replace(follow, error=error)
    if follow.at == 0.0 and most > NEAR:
        where = f"{np.degrees(most):.0f} degrees from where the trajectory begins"
        return replace(follow, ended=f"{where}; plan again"), still
    if most > LOST:
        return replace(follow, ended=f"{np.degrees(most):.0f} degrees off; plan again"), still
    if follow.at >= path.duration and most < THERE:
        return replace(follow, pace=0.0, ended=ARRIVED), still
    if not moves:
        return replace(follow, pace=0.0), still
    pace = float(np.clip((0.5 * LOST - most) / (0.5 * LOST - KEPT), 0.0, 1.0))
    at = min(follow.at + pace * max(dt, 0.0), path.duration)
    _, rates = path.at(at)
    return replace(follow, at=at, pace=pace), pace * rates + GAIN * error
