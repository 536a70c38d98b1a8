"""The strip along its track of a machine that stands on one, with what it did lately."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from backend.errors import InputError
from backend.fusion.inflation import spread
from backend.fusion.pose import Validity
from backend.pipeline.along_cycle import thinned
from backend.pipeline.along_track import Placement, Question, Stretch, along_track, placement
from backend.pipeline.config import Config
from backend.pipeline.place import base_transform
from backend.pipeline.records import Snapshot
from backend.pipeline.working_gauge import site_of
from backend.spatial.types import Array

if TYPE_CHECKING:
    from backend.site.travel import Way

NEAR = 1.5
"""[m] beside a track within which a machine counts as standing on it."""

AHEAD = 50.0
"""[m] of track that are judged, each way."""

_TURN = math.radians(15.0)  # off the track's heading, either way round, that is still along it


@dataclass(frozen=True)
class AlongImage:
    """place: of the machine's root on the track; length: of the track [m]; eta: a clearance of this
    or less violates, the configured growth and what is not known of the pose; cap: how far is
    looked [m]; postures: that the last `seconds` [s] were thinned to; reason: why nothing is known,
    else empty; stretches: in order.
    """

    own: str
    track: str
    state_time: float
    length: float
    place: Placement | None
    eta: float
    cap: float
    seconds: float
    postures: int
    reason: str
    stretches: tuple[Stretch, ...]

    @property
    def key(self) -> str:
        return self.own


def own_way(snapshot: Snapshot, ways: Sequence[Way], own: str) -> Way | None:
    """The track nearest to where a machine stands, within NEAR and along its heading."""
    pose = snapshot.machines[own].pose
    if snapshot.machines[own].body is None:
        return None
    best, found = NEAR, None
    for way in ways:
        station, beside = way.nearest(pose.position)
        if not beside <= best:
            continue
        heading = float(way.line.at(np.array([station])).heading[0])
        if abs(math.sin(pose.yaw - heading)) <= math.sin(_TURN):
            best, found = beside, way
    return found


def along_image(
    snapshot: Snapshot, config: Config, own: str, way: Way, postures: Array, seconds: float
) -> AlongImage:
    """postures: (m, n) of the last `seconds`, the oldest first [rad]; other machines do not count.

    A machine whose pose is not valid gets no stretch, but the reason.
    """
    state, machine = snapshot.machines[own], config.machines[own]
    # How old the pose is does not count: the question is of other places, at another time.
    eta = config.eta + spread(machine, state.pose)
    question = Question(eta=eta, cap=max(Question().cap, eta + 1.0))
    place: Placement | None = None
    stretches: tuple[Stretch, ...] = ()
    reason, kept = "", 0
    if state.body is None or state.pose.validity is not Validity.VALID:
        reason = state.pose.reasons[0] if state.pose.reasons else "is unknown"
    else:
        try:
            station, _ = way.nearest(state.pose.position)
            place = placement(way.frames, station, base_transform(state.pose))
            cycle = thinned(machine, np.concatenate([postures, state.pose.joints[None]]))
            kept = len(cycle.postures)
            span = max(0.0, place.station - AHEAD), min(way.length, place.station + AHEAD)
            bodies = site_of(own, snapshot.gauge, config).without((way.name,))
            stretches = along_track(
                *(machine, cycle, way.frames, place, bodies, span),
                *(question, way.known(machine.bounding_radius)),
            )
        except InputError as error:
            reason = str(error)
    return AlongImage(
        *(own, way.name, snapshot.state_time, way.length, place, question.eta, question.cap),
        *(seconds, kept, reason, stretches),
    )
