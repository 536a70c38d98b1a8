"""The people of a snapshot as the 3D scene shows them, each at its worst for any machine."""

from __future__ import annotations

import math

import numpy as np

from backend.pipeline.people_records import PERSON, People
from backend.safety.swing_risk import Risk
from backend.tracking.records import Status
from cockpit.views.people_records import SeenLost, SeenPeople, SeenSensor, SeenTrack


def seen_people(people: People | None, now: float) -> SeenPeople | None:
    """None where nobody watches. now: the snapshot's time [s]."""
    if people is None:
        return None
    return SeenPeople(
        tuple(_track(people, k) for k in range(len(people.tracked))),
        tuple(SeenLost(one.id, np.array(one.position), now - one.seen) for one in people.lost),
        tuple(SeenSensor(np.array(one.position), now - one.time) for one in people.sensors),
        people.age,
        people.reason,
    )


def _track(people: People, k: int) -> SeenTrack:
    tracked = people.tracked
    risk, distance = Risk.SAFE, math.nan
    for judged in people.judged.values():
        level, apart = Risk(int(judged.risks.level[k])), float(judged.distance[k])
        if math.isnan(distance) or (level, -apart) > (risk, -distance):
            risk, distance = level, apart
    return SeenTrack(
        int(tracked.id[k]),
        tracked.kind[k] == PERSON,
        Status(int(tracked.status[k])),
        tracked.position[k],
        float(tracked.yaw[k]),
        tracked.size[k],
        tracked.ahead[k],
        tracked.ahead_cov[k],
        risk,
        distance,
    )
