"""A snapshot's document on people, as the scene draws it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from backend.safety.swing_risk import Risk
from backend.tracking.records import Status
from cockpit.views.people_records import SeenLost, SeenPeople, SeenSensor, SeenTrack


def seen_people(document: Mapping[str, Any] | None) -> SeenPeople | None:
    """document: a backend.documents.people.PeopleModel as plain values, NaN or None for what is
    unknown; None where the site has no LiDAR.
    """
    if document is None:
        return None
    return SeenPeople(
        tracks=tuple(_track(track, document["risks"]) for track in document["tracks"]),
        lost=tuple(
            SeenLost(one["id"], np.array(one["position"], dtype=float), one["seen"])
            for one in document["lost"]
        ),
        sensors=tuple(
            SeenSensor(np.array(one["position"], dtype=float), _number(one["age"]))
            for one in document["sensors"]
        ),
        age=_number(document["age"]),
        reason=document["reason"],
    )


def _track(track: Mapping[str, Any], risks: Sequence[Mapping[str, Any]]) -> SeenTrack:
    """With the worst of its risks, the nearest of those alike."""
    own = [
        (-Risk[risk["level"]], math.inf if math.isnan(far) else far)
        for risk in risks
        if risk["id"] == track["id"]
        for far in (_number(risk["distance"]),)
    ]
    level, distance = min(own, default=(-Risk.SAFE, math.nan))
    return SeenTrack(
        id=track["id"],
        person=track["kind"] == "person",
        status=Status[track["status"].upper()],
        position=np.array(track["position"], dtype=float),
        yaw=track["yaw"],
        size=np.array(track["size"], dtype=float),
        ahead=np.array(track["ahead"]["position"], dtype=float),
        cov=np.array(track["ahead"]["cov"], dtype=float),
        risk=Risk(-level),
        distance=distance,
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value
