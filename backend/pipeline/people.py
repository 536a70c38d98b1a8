"""Everybody around the machines now: the newest scan's tracks, carried on to this moment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backend.pipeline.people_records import (
    NOBODY,
    OBJECT,
    PERSON,
    Judged,
    Missing,
    People,
    Seen,
    Sensor,
    Tracked,
)
from backend.pipeline.records import MachineState
from backend.safety.people import Watch
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.rotation import rz
from backend.spatial.types import Array, BoolArray
from backend.tracking.records import HEIGHT, LENGTH, PX, PY, PZ, VX, VY, WIDTH, YAW, Status

TOLD = 60.0
"""How long the place of somebody who was lost is told [s]."""
FOUND = 1.5
"""Whoever is followed this near to such a place is taken for who was lost [m]."""
UNSTEADY = 1.0
"""Acceleration that people may have between two scans [m/s^2]."""
WIDEST = 1.3
TALLEST = 2.4
"""What is larger than these is no person [m]."""
TALL = 1.8
"""People count as being at least this tall, however little of them was seen [m]."""
MOVING = 0.5
"""Objects faster than this are judged as people are [m/s]."""
OVERLOOKED = 0.3
"""The lowest of somebody that a LiDAR may miss, down to the ground [m]."""
JUDGED = 0.09
"""Risks of the swing hold until the next scan, and no longer than this [s]."""
SMOOTHED = 0.25
"""Time over which the swing's acceleration is taken [s]."""


@dataclass(frozen=True)
class PeopleState:
    """What a cycle hands to the next. seen: newest scan; sensors: newest of each LiDAR; lost: whose
    places are told; swings: (time, swing rates by machine) of the last moments [s, rad/s]; judged:
    of the tracks of `seen` by own machine, while that is recent enough; judged_at [s].
    """

    seen: Seen | None = None
    sensors: tuple[Sensor, ...] = ()
    lost: tuple[Missing, ...] = ()
    swings: tuple[tuple[float, Mapping[str, float]], ...] = ()
    judged: Mapping[str, Judged] = field(default_factory=dict)
    judged_at: float = -math.inf

    def acceleration(self, machine: str) -> float:
        """Of the machine's swing over the last moments [rad/s^2], 0 while that is not known."""
        if len(self.swings) < 2:
            return 0.0
        (begin, before), (end, after) = self.swings[0], self.swings[-1]
        return (after[machine] - before[machine]) / max(end - begin, 1e-3)


def following(
    before: PeopleState, seen: Seen | None, machines: Mapping[str, MachineState], now: float
) -> PeopleState:
    """The state after a cycle's input. seen: None when no scan was worked out since."""
    rates = {name: float(state.pose.joint_velocities[0]) for name, state in machines.items()}
    swings = (*(s for s in before.swings if now - s[0] < SMOOTHED), (now, rates))
    if seen is None or (before.seen is not None and seen.time < before.seen.time):
        lost = tuple(one for one in before.lost if now - one.lost < TOLD)
        judged = before.judged if now - before.judged_at < JUDGED else {}
        return PeopleState(before.seen, before.sensors, lost, swings, judged, before.judged_at)
    newest = {(s.machine, s.name): s for s in (*before.sensors, *seen.sensors)}
    sure = seen.status != Status.TENTATIVE
    gone = _vanished(before.seen, seen)
    lost = tuple(
        one
        for one in (*before.lost, *seen.lost, *gone)
        if now - one.lost < TOLD and not _found(one, seen.state[sure][:, [PX, PY]])
    )
    return PeopleState(seen, tuple(newest.values()), lost, swings)


def present(state: PeopleState, watch: Watch, now: float) -> People:
    """Everybody at `now` [s]. Without a recent scan nobody can be told, and it says so."""
    seen = state.seen
    if seen is None:
        reason = "no LiDAR has been heard yet"
        return People(reason, math.nan, boundaries=watch.boundaries)
    age = now - seen.time
    reason = "" if age <= watch.stale else f"no LiDAR data for {age:.1f} s"
    tracked = carried_on(seen, now)
    return People(reason, age, state.sensors, tracked, state.lost, boundaries=watch.boundaries)


def carried_on(seen: Seen, now: float) -> Tracked:
    """The tracks of a scan where they are at `now`, at most a second later [s]."""
    if not len(seen.id):
        return NOBODY
    dt = min(max(now - seen.time, 0.0), 1.0)
    velocity = seen.state[:, [VX, VY]]
    F = np.eye(4)
    F[0, 2] = F[1, 3] = dt
    cov = F @ seen.cov @ F.T
    sigma = largest(cov[:, :2, :2]) + 0.5 * UNSTEADY * dt**2
    position = seen.state[:, [PX, PY, PZ]].copy()
    position[:, :2] += velocity * dt
    size = seen.state[:, [LENGTH, WIDTH, HEIGHT]]
    small = (size[:, :2].max(axis=1) <= WIDEST) & (size[:, 2] <= TALLEST)
    return Tracked(
        seen.id,
        tuple(PERSON if person else OBJECT for person in small),
        seen.status,
        position,
        velocity,
        seen.state[:, YAW],
        size,
        sigma,
        now - seen.last_seen,
        seen.ahead,
        seen.ahead_cov,
    )


def largest(cov: Array) -> Array:
    """(k,) standard deviation [m] along the longest axis of each covariance (k, 2, 2)."""
    if not len(cov):
        return np.zeros(0)
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(cov)[:, 1], 1e-6)))


def name_of(tracked: Tracked, k: int) -> str:
    """ "person:P7", "object:O9"."""
    kind = tracked.kind[k]
    return f"{kind}:{kind[0].upper()}{tracked.id[k]}"


def counts(tracked: Tracked) -> BoolArray:
    """(k,) who limits a machine: people, and whatever moves; what was seen once does not yet."""
    person = np.array([kind == PERSON for kind in tracked.kind], dtype=bool)
    moving = np.linalg.norm(tracked.velocity, axis=1) > MOVING
    sure = tracked.status != Status.TENTATIVE
    return np.asarray(sure & (person | moving), dtype=bool)


def boxes_of(tracked: Tracked, sigmas: float = 0.0) -> Boxes:
    """Upright boxes from the ground up, wider by `sigmas` standard deviations of the place."""
    k = len(tracked)
    if not k:
        return NO_BOXES
    person = np.array([kind == PERSON for kind in tracked.kind], dtype=bool)
    half = 0.5 * tracked.size
    half[:, :2] = np.maximum(half[:, :2], np.where(person, 0.25, 0.1)[:, None])
    low = tracked.position[:, 2] - half[:, 2] - OVERLOOKED
    high = tracked.position[:, 2] + half[:, 2]
    high = np.where(person, np.maximum(high, low + OVERLOOKED + TALL), high)
    wide = sigmas * np.minimum(tracked.sigma, 1.0)
    centers = np.column_stack([tracked.position[:, :2], 0.5 * (low + high)])
    extents = np.column_stack([half[:, :2] + wide[:, None], 0.5 * (high - low)])
    return Boxes(centers, rz(tracked.yaw), extents)


def everybody(people: People, sigmas: float = 3.0) -> tuple[Boxes, tuple[str, ...]]:
    """Those who limit machines, as boxes and names; nobody while they are not known."""
    tracked = people.tracked
    if people.reason or not len(tracked):
        return NO_BOXES, ()
    picked = np.flatnonzero(counts(tracked))
    return boxes_of(tracked, sigmas).take(picked), tuple(
        name_of(tracked, k) for k in picked.tolist()
    )


def lost_boxes(lost: tuple[Missing, ...]) -> Boxes:
    """Where those stood who were lost: a step to every side."""
    k = len(lost)
    if not k:
        return NO_BOXES
    centers = np.array([one.position for one in lost], dtype=float)
    return Boxes(centers, np.tile(np.eye(3), (k, 1, 1)), np.tile([0.7, 0.7, 0.5 * TALL], (k, 1)))


def _vanished(before: Seen | None, seen: Seen) -> tuple[Missing, ...]:
    """Those who were followed and are neither followed nor told as lost: the process that followed
    them was started again, or a scan's news did not arrive.
    """
    if before is None:
        return ()
    told = {*seen.id.tolist(), *(one.id for one in seen.lost)}
    sure = np.flatnonzero(before.status != Status.TENTATIVE)
    return tuple(
        Missing(int(before.id[k]), _place(before, k), float(before.last_seen[k]), seen.time)
        for k in sure.tolist()
        if int(before.id[k]) not in told
    )


def _place(seen: Seen, k: int) -> tuple[float, float, float]:
    x, y, z = seen.state[k, [PX, PY, PZ]].tolist()
    return x, y, z


def _found(one: Missing, places: Array) -> bool:
    apart = np.linalg.norm(places - np.array(one.position[:2]), axis=1)
    return bool((apart < FOUND).any())
