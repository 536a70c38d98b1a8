"""Following a trajectory while its operator holds the dead-man: velocities, cycle by cycle.

The path's own time runs as fast as the machine keeps up, and stands while nothing may move, so that
a limit, a pause or a slow joint delays the trajectory and never leads off it. What comes out is a
wish like that of sticks: the limiter judges it against the scene as it is now.

    wish = sigma * rates(s) + GAIN * (joints(s then) - q),    s advances by sigma * dt

q is what the sensors saw T ago, T their age and the command's way: the machine is compared with
where it was told to be then. sigma falls from 1 to 0 while the error rises from KEPT to LOST / 2.
Where the limiter leaves a share of the wish, s advances by no more than that, and sigma falls to
it: all joints are slowed alike, at once, not only when the sensors have seen it.

A machine that is let go at speed runs on while it brakes: until it goes on, s is where on the path
it is, and then sigma rises in RAMP, as the joints cannot be as fast at once. Whoever goes on before
it stands finds it ahead of what it was told, and then s is where it is, too.
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
RAMP = 1.0
"""From standstill on the way to the path's own pace [s]."""
SLOW = 0.02
"""Joints that the path asks less of than this do not slow the others [rad/s]."""
RUN_ON = 1.5
"""How far from its time on the path a machine that was let go is looked for, either way [s]."""
LONGEST = 0.2
"""After a longer cycle than this the path's time does not advance: nothing moved meanwhile [s]."""
AHEAD = 0.1
"""A machine that is farther on its path than it was told goes on from there [s]."""
MEMORY = 1.0
"""How long it is kept when the path's time was where [s]; no machine's T is longer."""
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
    seen; ended: why it is over, empty while it is not; trail: (own clock, path's time) of the last
    cycles [s, s]; wish: (n,) of the last cycle [rad/s], None where nothing was wished for; needed:
    (n,) the path's part of it.
    """

    trajectory: Trajectory
    at: float = 0.0
    pace: float = 0.0
    error: Array | None = None
    ended: str = ""
    trail: tuple[tuple[float, float], ...] = ()
    wish: Array | None = None
    needed: Array | None = None

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
    path, dt = follow.trajectory, max(dt, 0.0)
    clock = follow.trail[-1][0] + dt if follow.trail else 0.0
    then = _then(follow, clock - lag)
    if follow.at > 0.0:
        where = _where(path, q, then if moves else follow.at, continuous)
        if not moves:
            follow, then = replace(follow, at=where), where
        elif where > then + AHEAD:
            follow, then = _sooner(follow, where - then), where
    error = _apart(path.at(then)[0] - q, continuous)
    most = float(np.abs(error).max())
    trail = _kept(follow, clock)
    follow = replace(follow, error=error, trail=trail, wish=None, needed=None)
    if follow.at == 0.0 and most > NEAR:
        far = f"{np.degrees(most):.0f} degrees from where the trajectory begins"
        return replace(follow, ended=f"{far}; plan again"), still
    if most > LOST:
        return replace(follow, ended=f"{np.degrees(most):.0f} degrees off; plan again"), still
    if follow.at >= path.duration and most < THERE:
        return replace(follow, pace=0.0, ended=ARRIVED), still
    if not moves:
        return replace(follow, pace=0.0), still
    step = dt if dt < LONGEST else 0.0
    highest = 1.0 if follow.at == 0.0 else min(1.0, follow.pace + step / RAMP)
    pace = float(np.clip((0.5 * LOST - most) / (0.5 * LOST - KEPT), 0.0, highest))
    at = min(follow.at + pace * step, path.duration)
    _, rates = path.at(at)
    needed, wish = pace * rates, pace * rates + GAIN * error
    return replace(follow, at=at, pace=pace, wish=wish, needed=needed), wish


def allowed(follow: Follow, sent: Array) -> Follow:
    """The same cycle, once it is known what was sent of its wish: (n,) [rad/s]."""
    if follow.wish is None or follow.needed is None or not follow.trail:
        return follow
    counts = (np.abs(follow.needed) > SLOW) & (follow.wish * follow.needed > 0.0)
    if not counts.any():
        return follow
    share = float(np.clip(sent[counts] / follow.wish[counts], 0.0, 1.0).min())
    before = follow.trail[-1][1]
    return replace(follow, at=before + share * (follow.at - before), pace=share * follow.pace)


def _then(follow: Follow, clock: float) -> float:
    """The path's time at an earlier time of the own clock [s]."""
    if not follow.trail:
        return follow.at
    clocks, times = zip(*follow.trail, strict=True)
    return float(np.interp(clock, clocks, times))


def _sooner(follow: Follow, by: float) -> Follow:
    """The path's time, now and in the last cycles, later by that [s]."""
    end = follow.trajectory.duration
    trail = tuple((clock, min(at + by, end)) for clock, at in follow.trail)
    return replace(follow, at=min(follow.at + by, end), trail=trail)


def _kept(follow: Follow, clock: float) -> tuple[tuple[float, float], ...]:
    """The trail with this cycle, without what is older than anybody asks for."""
    return (*(one for one in follow.trail if one[0] > clock - MEMORY), (clock, follow.at))


def _where(path: Trajectory, q: Array, at: float, continuous: Array | None) -> float:
    """The time at which the path is nearest to q (n,), downhill from `at` [s]: where it comes back
    to the same place later, that is not it.
    """
    times = np.arange(max(at - RUN_ON, 0.0), min(at + RUN_ON, path.duration) + 1e-9, 0.02)
    joints = np.stack([np.interp(times, path.times, column) for column in path.joints.T], axis=1)
    off = np.abs(_apart(joints - q, continuous)).max(axis=1)
    k = int(np.abs(times - at).argmin())
    for way in (1, -1):
        while 0 <= k + way < len(off) and off[k + way] < off[k]:
            k += way
    return float(times[k])


def _apart(error: Array, continuous: Array | None) -> Array:
    """(..., n) with those of joints without ends modulo a turn [rad]."""
    if continuous is None:
        return error
    turned = (error + np.pi) % (2.0 * np.pi) - np.pi
    return np.asarray(np.where(continuous, turned, error))
