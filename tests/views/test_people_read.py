"""A snapshot's document on people as the scene draws it."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from backend.documents.people import PeopleModel
from backend.safety.swing_risk import Risk
from backend.shell.app.wire import dumps
from backend.tracking.records import Status
from cockpit.views.people_read import seen_people


def track(number: int, **more: Any) -> dict[str, Any]:
    return {
        "id": number,
        "kind": "person",
        "status": "confirmed",
        "position": [3, 1, 0.9],
        "velocity": [-1.2, 0.1],
        "yaw": 0.2,
        "size": [0.5, 0.6, 1.8],
        "sigma": 0.1,
        "unseen": 0.1,
        "ahead": {"position": [1.8, 1.1], "cov": [[0.1, 0.02], [0.02, 0.2]]},
        **more,
    }


def risk(number: int, machine: str, level: str, distance: float) -> dict[str, Any]:
    none = dict.fromkeys(("ttc", "index", "ttc_ahead", "index_ahead"), math.inf)
    own = {"id": number, "machine": machine, "body": f"{machine}:boom/0", "distance": distance}
    return {**own, **none, "level": level}


def document(**more: Any) -> dict[str, Any]:
    sensor = {"machine": "left", "name": "lidar", "age": math.nan, "position": [0, 0, 2]}
    return {
        "reason": "",
        "age": 0.1,
        "sensors": [{**sensor, "points": 0}],
        "tracks": [track(7), track(9, kind="object", status="coasting"), track(12)],
        "lost": [{"id": 3, "position": [5, 5, 0.9], "seen": 12.3, "lost": 9.0}],
        "risks": [
            risk(7, "left", "SAFE", 0.5),
            risk(7, "right", "EMERGENCY", 4.0),
            risk(7, "third", "EMERGENCY", 3.0),
            risk(9, "left", "WARNING", math.nan),
        ],
        **more,
    }


@pytest.mark.parametrize("sent", [False, True], ids=["as it is", "over the wire"])
def test_the_worst_risk_counts_and_everything_is_kept(sent: bool) -> None:
    given = json.loads(dumps(document())) if sent else document()
    PeopleModel.model_validate(given)
    seen = seen_people(given)
    assert seen is not None
    seven, nine, twelve = seen.tracks
    assert (seven.code, seven.risk, seven.distance) == ("P7", Risk.EMERGENCY, 3.0)
    assert (nine.code, nine.risk, nine.status) == ("O9", Risk.WARNING, Status.COASTING)
    assert not math.isfinite(nine.distance)
    assert twelve.risk is Risk.SAFE
    np.testing.assert_array_equal(seven.cov, [[0.1, 0.02], [0.02, 0.2]])
    np.testing.assert_array_equal(seven.ahead, [1.8, 1.1])
    assert (seen.lost[0].id, seen.lost[0].seen) == (3, 12.3)
    assert math.isnan(seen.sensors[0].age)
    assert seen.age == 0.1


def test_no_lidar_is_nobody() -> None:
    assert seen_people(None) is None
