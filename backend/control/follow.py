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

A path may have tracks and a base, as one over an obstacle has. The tracks run in the same pace,
earlier by what they lag behind the joints, and make up for what the base is behind or ahead along
itself, but only where the path drives, and never by more than MADE_UP of its speed: where it
stands, what is wrong is for the operator to see. A base that is farther beside its place than the
path's tolerance ends it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from backend.control.climb import Climb
from backend.errors import InputError
from backend.spatial.rotation import from_attitude, to_attitude
from backend.spatial.transform import make
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
TOLERANCE = (0.10, float(np.radians(5.0)))
"""How far a base may be beside its place on the path, and turned from it [m, rad]."""
DRIVES = 0.02
"""Track speeds above this share of the path's fastest drive [1]."""
RUNS_ON = 0.5
"""Share of the tolerance that tracks may use up until they stand: the arm stands at once."""
MADE_UP = 0.5
"""Share of the path's own track speed by which it may be corrected."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """times: (m,) rising from 0 [s]; joints: (m, n) [rad], not wrapped; rates: (m, n) [rad/s].

    Of a machine that drives on its way: tracks: (m, 2) left, right [m/s]; base: (m, 4, 4)
    T_site_root, from which it may be off by tolerance [m, rad]; climb: what it climbs, and how.

    Raises InputError unless that is what they are, with m >= 2.
    """

    times: Array
    joints: Array
    rates: Array
    tracks: Array | None = None
    base: Array | None = None
    tolerance: tuple[float, float] = TOLERANCE
    climb: Climb | None = None

    def __post_init__(self) -> None:
        m = len(self.times)
        fits = self.joints.ndim == 2 and self.joints.shape == self.rates.shape
        if m < 2 or not fits or len(self.joints) != m:
            raise InputError(
                f"trajectory: {m} times for joints {self.joints.shape} and rates "
                f"{self.rates.shape}; allowed are (m,), (m, n) and (m, n), m of 2 or more."
            )
        rows: list[tuple[str, Array | None, tuple[int, ...]]] = [
            ("tracks", self.tracks, (2,)),
            ("base", self.base, (4, 4)),
        ]
        if self.climb is not None:
            k = self.climb.support.shape[1] if self.climb.support.ndim == 3 else 0
            rows += [("support", self.climb.support, (k, 3)), ("margin", self.climb.margin, ())]
        for what, found, shape in rows:
            if found is not None and found.shape != (m, *shape):
                raise InputError(f"trajectory: {m} times for {what} {found.shape}.")
        known = (self.times, self.joints, self.rates, self.tracks, self.base)
        if not all(v is None or np.isfinite(v).all() for v in known):
            raise InputError("trajectory: a value is not finite; allowed are finite numbers.")
        if self.climb is not None and self.base is None:
            raise InputError("trajectory: one that climbs says where its base is.")
        if not min(self.tolerance) > 0.0:
            raise InputError("trajectory: its tolerance must be greater than 0 m and 0 rad.")
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

    def tracks_at(self, t: float) -> Array:
        """(2,) left, right [m/s] at t [s]: linear between, at rest outside."""
        if self.tracks is None or not 0.0 < t < self.duration:
            return np.zeros(2)
        return np.array([np.interp(t, self.times, column) for column in self.tracks.T])

    def base_at(self, t: float) -> Array | None:
        """T_site_root (4, 4) at t [s]: linear between, its attitude, too."""
        if self.base is None:
            return None
        k = min(max(int(np.searchsorted(self.times, t, side="right")) - 1, 0), len(self.times) - 2)
        u = (t - self.times[k]) / (self.times[k + 1] - self.times[k])
        u = min(max(float(u), 0.0), 1.0)
        a, b = self.base[k], self.base[k + 1]
        before, after = (np.array(to_attitude(T[:3, :3])) for T in (a, b))
        attitude = before + u * ((after - before + np.pi) % (2.0 * np.pi) - np.pi)
        return make(from_attitude(*attitude.tolist()), a[:3, 3] + u * (b[:3, 3] - a[:3, 3]))


@dataclass(frozen=True)
class Follow:
    """at: the path's time [s]; pace: sigma of the last cycle; error: (n,) [rad], joints told minus
    seen; ended: why it is over, empty while it is not; trail: (own clock, path's time) of the last
    cycles [s, s]; wish: (n,) of the last cycle [rad/s], None where nothing was wished for; needed:
    (n,) the path's part of it; tracks: (2,) wished for in the last cycle [m/s]; seen: the path's
    time at which the base should have been where it was seen [s]; fresh: nothing moved yet since it
    was accepted, at its beginning or where it was left.
    """

    trajectory: Trajectory
    at: float = 0.0
    pace: float = 0.0
    error: Array | None = None
    ended: str = ""
    trail: tuple[tuple[float, float], ...] = ()
    wish: Array | None = None
    needed: Array | None = None
    tracks: Array = field(default_factory=lambda: np.zeros(2))
    seen: float = 0.0
    fresh: bool = True

    @property
    def arrived(self) -> bool:
        return self.ended == ARRIVED


ARRIVED = "arrived"


def advance(
    follow: Follow,
    q: Array,
    lag: float,
    moves: bool,
    dt: float,
    continuous: Array | None = None,
    T_site_root: Array | None = None,
    lead: float = 0.0,
    fastest: float = np.inf,
) -> tuple[Follow, Array]:
    """The following cycle, and the wish (n,) [rad/s]; that of the tracks is in `Follow.tracks`.

    q: (n,) joints as seen [rad], NaN where unknown; lag: T [s]; moves: whether the dead-man is held
    and nothing pauses; dt: since the last cycle [s]; continuous: (n,) joints without ends, which
    are compared modulo a turn; T_site_root: (4, 4) as seen, None where unknown; lead: what the
    tracks lag more than the joints [s]; fastest: of the tracks, from which they stand before the
    base is off its way when everything is let go, see `stands_within` [m/s].
    """
    still = np.zeros(len(q))
    follow = replace(follow, tracks=np.zeros(2))
    if follow.ended:
        return follow, still
    known = follow.trajectory.base is None or (
        T_site_root is not None and np.isfinite(T_site_root).all()
    )
    if not np.isfinite(q).all() or not known:
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
    follow = replace(follow, error=error, trail=trail, wish=None, needed=None, seen=then)
    if follow.fresh and most > NEAR:
        where_to = "the trajectory begins" if follow.at == 0.0 else "it was left"
        far = f"{np.degrees(most):.0f} degrees from where {where_to}"
        return replace(follow, ended=f"{far}; plan again"), still
    if most > LOST:
        return replace(follow, ended=f"{np.degrees(most):.0f} degrees off; plan again"), still
    off = beside(path, then, T_site_root)
    if off:
        return replace(follow, ended=f"{off}; plan again"), still
    if follow.at >= path.duration and most < THERE:
        return replace(follow, pace=0.0, ended=ARRIVED), still
    if not moves:
        return replace(follow, pace=0.0), still
    step = dt if dt < LONGEST else 0.0
    highest = 1.0 if follow.at == 0.0 else min(1.0, follow.pace + step / RAMP)
    pace = float(np.clip((0.5 * LOST - most) / (0.5 * LOST - KEPT), 0.0, highest))
    driven = float(np.abs(path.tracks_at(follow.at + pace * lead)).max())
    pace = min(pace, fastest / driven) if driven > 0.0 else pace
    at = min(follow.at + pace * step, path.duration)
    _, rates = path.at(at)
    needed, wish = pace * rates, pace * rates + GAIN * error
    tracks = pace * _driven(path, at + pace * lead, then, T_site_root)
    follow = replace(follow, at=at, pace=pace, tracks=tracks, fresh=False)
    return replace(follow, wish=wish, needed=needed), wish


def stands_within(path: Trajectory, lag: float, acceleration: float) -> float:
    """The track speed v from which a machine stands within RUNS_ON of the path's tolerance [m/s]:
    v lag + v^2 / (2 a). lag of its tracks [s]; acceleration, a: with which they brake [m/s^2].
    """
    way = RUNS_ON * path.tolerance[0]
    return float(acceleration * (np.sqrt(lag**2 + 2.0 * way / acceleration) - lag))


def beside(path: Trajectory, t: float, T_site_root: Array | None) -> str:
    """How far the base is beside its place on the path at t [s], in words; empty within the
    tolerance, and where the path has none.
    """
    wanted = path.base_at(t)
    if wanted is None:
        return ""
    if T_site_root is None:
        return "where the base is is not known"
    far, turned = apart(wanted, T_site_root)
    if not far <= path.tolerance[0]:
        return f"its base is {far:.2f} m off"
    return (
        "" if turned <= path.tolerance[1] else f"its base is {np.degrees(turned):.0f} degrees off"
    )


def apart(T_a: Array, T_b: Array) -> tuple[float, float]:
    """Distance of two places (4, 4) and the angle between their attitudes [m, rad]."""
    cosine = 0.5 * (float(np.trace(T_a[:3, :3].T @ T_b[:3, :3])) - 1.0)
    away = float(np.linalg.norm(T_a[:3, 3] - T_b[:3, 3]))
    return away, float(np.arccos(min(max(cosine, -1.0), 1.0)))


def _driven(path: Trajectory, t: float, seen: float, T_site_root: Array | None) -> Array:
    """(2,) track speeds at t [s], with what the base is behind made up for [m/s]."""
    speeds = path.tracks_at(t)
    if path.tracks is None or path.base is None or T_site_root is None:
        return speeds
    forward = float(speeds.mean())
    if abs(forward) <= DRIVES * float(np.abs(path.tracks).max()):
        return speeds
    wanted = path.base_at(seen)
    assert wanted is not None
    behind = float((wanted[:3, 3] - T_site_root[:3, 3]) @ T_site_root[:3, 0])
    most = MADE_UP * abs(forward)
    return np.asarray(speeds + min(max(GAIN * behind, -most), most))


def taken_up(follow: Follow) -> Follow:
    """What ended on the way, once more from there."""
    return Follow(follow.trajectory, at=follow.at, seen=follow.seen)


def left_at(path: Trajectory, at: float, q: Array, T: Array, continuous: Array | None) -> bool:
    """Whether a machine at q (n,), its base at T (4, 4), still is about where it left a path, at a
    time of that [s].
    """
    where = _where(path, q, at, continuous)
    off = _apart(path.at(where)[0] - q, continuous)
    return float(np.abs(off).max()) < NEAR and not beside(path, where, T)


def allowed(follow: Follow, sent: Array, tracks: Array | None = None) -> Follow:
    """The same cycle, once it is known what was sent of its wish: (n,) [rad/s] and (2,) [m/s]."""
    if follow.wish is None or follow.needed is None or not follow.trail:
        return follow
    counts = (np.abs(follow.needed) > SLOW) & (follow.wish * follow.needed > 0.0)
    shares = np.clip(sent[counts] / follow.wish[counts], 0.0, 1.0)
    if tracks is not None and follow.tracks.any():
        drives = np.abs(follow.tracks) > 0.5 * np.abs(follow.tracks).max()
        ways = np.clip(tracks[drives] / follow.tracks[drives], 0.0, 1.0)
        shares = np.concatenate([shares, ways])
    if not len(shares):
        return follow
    share = float(shares.min())
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
