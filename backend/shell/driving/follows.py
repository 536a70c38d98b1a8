"""Trajectories that operators accepted, and how far each machine is on its own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from backend.control import follow as rules
from backend.control.climb import Climb
from backend.control.console import State
from backend.control.follow import Follow, Trajectory
from backend.control.seat import Seat
from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.braking import age_of
from backend.pipeline.records import Snapshot
from backend.safety.limiter import Wish
from backend.safety.limits import Delay
from backend.safety.surmounting import Surmounting
from backend.spatial.rotation import to_attitude
from backend.spatial.types import Array

MOST_LAG = 0.6
"""No machine moves when its data and commands take longer [s]."""


class Plans(Protocol):
    """What may be followed, by the names of machine and plan."""

    def offered(self, machine: str, plan: str) -> Trajectory | str:
        """What can be followed from its beginning, or why it cannot."""
        ...

    def over(self, machine: str, plan: str) -> str:
        """Why what is followed must not be any more; empty while it may."""
        ...


class NoPlans:
    """Where nothing is planned."""

    def offered(self, machine: str, plan: str) -> Trajectory | str:
        """Never anything."""
        return f"{plan or 'a plan without a name'}: no trajectory of this machine is called so"

    def over(self, machine: str, plan: str) -> str:
        """Nothing is followed."""
        return "nothing is planned here"


@dataclass(frozen=True)
class Followed:
    """What a seat follows with one machine. token: of the lease; cycled: when last [s]."""

    seat: str
    token: int
    plan: str
    follow: Follow
    cycled: float = math.nan
    told: bool = False


class Follows:
    """By machine. Not thread-safe: whoever holds it locks."""

    def __init__(self, plans: Plans) -> None:
        self._plans = plans
        self._by_machine: dict[str, Followed] = {}

    def accept(self, machine: str, seat: str, token: int, plan: str) -> str:
        """Why not, empty when it is followed from now on, as soon as the dead-man is held.

        A climb that ended on its way is taken up where it was left: nobody should have to leave a
        machine there.
        """
        trajectory = self._plans.offered(machine, plan)
        if isinstance(trajectory, str):
            return trajectory
        follow, last = Follow(trajectory), self._by_machine.get(machine)
        again = last is not None and (last.plan, last.token) == (plan, token)
        if last is not None and again and trajectory.climb is not None and _left(last.follow):
            follow = rules.taken_up(last.follow)
        self._by_machine[machine] = Followed(seat, token, plan, follow)
        return ""

    def drop(self, machine: str, seat: str) -> None:
        """The seat follows nothing with the machine any more."""
        found = self._by_machine.get(machine)
        if found is not None and found.seat == seat:
            del self._by_machine[machine]

    def of(self, machine: str, seat: str) -> Followed | None:
        """What that seat follows with the machine."""
        found = self._by_machine.get(machine)
        return found if found is not None and found.seat == seat else None

    def newest(self, machine: str) -> Followed | None:
        """What is or was followed with the machine last, whoever's it is."""
        return self._by_machine.get(machine)

    def wish(
        self,
        name: str,
        machine: Machine,
        seat: tuple[str, Seat, int],
        snapshot: Snapshot,
        delay: Delay,
        now: float,
    ) -> Wish | None:
        """What following asks of the machine now; None where the sticks alone count.

        seat: its name, itself, the token of its lease. Whoever moves a stick drives by hand.
        """
        key, sat, token = seat
        found = self._by_machine.get(name)
        if found is None or found.follow.ended or (found.seat, found.token) != (key, token):
            return None
        console = sat.desk.consoles.get(name)
        if console is None or name != sat.desk.driven:
            return None
        over = self._plans.over(name, found.plan)
        if over:
            self._by_machine[name] = replace(found, follow=replace(found.follow, ended=over))
            return None
        if console.state in (State.ACTIVE, State.OVERRIDE, State.STOP):
            why = "a stick was moved" if console.state is State.ACTIVE else console.state.value
            self._by_machine[name] = replace(found, follow=replace(found.follow, ended=why))
            return None
        state = snapshot.machines[name]
        n = len(machine.joints)
        lag = float(delay.total(n, age_of(state, snapshot.time))[0]) - 0.5 * delay.up
        lag = min(lag, MOST_LAG) if math.isfinite(lag) else MOST_LAG
        dt = now - found.cycled
        body, path = None, found.follow.trajectory
        if path.base is not None and state.pose.validity is Validity.VALID:
            body = state.body
        following, rates = rules.advance(
            found.follow,
            state.pose.joints,
            lag,
            console.state is State.ENABLED,
            dt if dt > 0.0 else 0.0,
            np.array([joint.continuous for joint in machine.joints]),
            None if body is None else body.link_poses[0],
            delay.track_lag - delay.joint_lag,
            rules.stands_within(path, delay.track_lag, machine.tracks.max_acceleration),
        )
        self._by_machine[name] = replace(found, follow=following, cycled=now)
        full, fast = machine.max_velocity, machine.tracks.max_speed
        return Wish(np.clip(rates, -full, full), np.clip(following.tracks, -fast, fast))

    def allowed(self, name: str, sent: Array, tracks: Array) -> None:
        """What the limiter left of the wish of this cycle: (n,) [rad/s] and (2,) [m/s]."""
        found = self._by_machine.get(name)
        if found is not None:
            following = rules.allowed(found.follow, sent, tracks)
            self._by_machine[name] = replace(found, follow=following)

    def surmounting(self, now: float) -> dict[str, Surmounting]:
        """By machine what is climbed by plan, moving or not, until it is over; told at now [s]."""
        found = {}
        for machine, one in self._by_machine.items():
            climb = one.follow.trajectory.climb
            if climb is not None and not one.follow.ended:
                found[machine] = _surmounting(one, climb, now)
        return found

    def forget(self, held: Mapping[str, tuple[str, int]]) -> None:
        """What is climbed under a lease that is another's now is over. held: the seat and the token
        of each machine's lease.
        """
        for machine, one in self._by_machine.items():
            climbs = one.follow.trajectory.climb is not None and not one.follow.ended
            if climbs and held.get(machine) != (one.seat, one.token):
                over = replace(one.follow, ended="the machine was given back")
                self._by_machine[machine] = replace(one, follow=over)

    def ended(self) -> list[tuple[str, Followed]]:
        """What ended since it was asked last, each once."""
        found = [(m, f) for m, f in self._by_machine.items() if f.follow.ended and not f.told]
        for machine, one in found:
            self._by_machine[machine] = replace(one, told=True)
        return found


def _left(follow: Follow) -> bool:
    return bool(follow.ended) and not follow.arrived and follow.at > 0.0


def _surmounting(followed: Followed, climb: Climb, now: float) -> Surmounting:
    """As it should be seen now, and what it stands on then."""
    follow = followed.follow
    path, at = follow.trajectory, follow.seen
    base = path.base_at(at)
    assert base is not None
    yaw, pitch, roll = (float(angle) for angle in to_attitude(base[:3, :3]))
    k = min(int(np.searchsorted(path.times, at)), len(path.times) - 1)
    points = climb.support[k][np.isfinite(climb.support[k]).all(axis=1)]
    x, y, z = base[:3, 3].tolist()
    return Surmounting(
        plan=followed.plan,
        time=now,
        obstacles=climb.obstacles,
        phase=climb.phase_at(at),
        touching=climb.touching,
        position=(x, y, z),
        attitude=(yaw, pitch, roll),
        tolerance=path.tolerance,
        support=tuple((float(a), float(b), float(c)) for a, b, c in points),
        margin=float(climb.margin[k]),
        clearance=climb.clearance,
    )
