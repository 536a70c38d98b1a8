"""The key `people` of a snapshot: what its schema takes and refuses."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Callable
from typing import Any

import jsonschema
import pytest

from backend.documents.people import LEAST_INDEX, index_number, ttc_number
from backend.shell.app.models import SnapshotModel
from backend.shell.app.wire import dumps
from cockpit.schemas import SCHEMAS

SCHEMA = SCHEMAS["people"][0].model_json_schema()
TRACK: dict[str, Any] = {
    "id": 7,
    "kind": "person",
    "status": "confirmed",
    "position": [3.0, 1.0, 0.9],
    "velocity": [-1.2, 0.1],
    "yaw": 0.2,
    "size": [0.5, 0.6, 1.8],
    "sigma": 0.1,
    "unseen": 0.1,
    "ahead": {"position": [1.8, 1.1], "cov": [[0.1, 0.02], [0.02, 0.2]]},
}
RISK: dict[str, Any] = {
    "id": 7,
    "machine": "left",
    "body": "left:bucket/0",
    "distance": 2.1,
    "ttc": math.inf,
    "index": math.inf,
    "ttc_ahead": 0.8,
    "index_ahead": LEAST_INDEX,
    "level": "EMERGENCY",
}
PEOPLE: dict[str, Any] = {
    "reason": "",
    "age": math.nan,
    "sensors": [
        {"machine": "left", "name": "lidar", "age": 0.1, "position": [0, 0, 2.0], "points": 28123}
    ],
    "tracks": [TRACK],
    "lost": [{"id": 3, "position": [5.0, 5.0, 0.9], "seen": 12.3, "lost": 10.1}],
    "risks": [RISK],
}


def test_what_goes_over_the_wire_follows_the_schema() -> None:
    sent = json.loads(dumps(PEOPLE))
    assert sent["age"] is None
    assert sent["risks"][0]["ttc"] is None
    jsonschema.validate(sent, SCHEMA)
    assert SnapshotModel.model_fields["people"].default is None


CHANGES: dict[str, Callable[[dict[str, Any]], object]] = {
    "a level that does not exist": lambda p: p["risks"][0].update(level="STOP"),
    "a kind that does not exist": lambda p: p["tracks"][0].update(kind="dog"),
    "a flat place": lambda p: p["tracks"][0].update(position=[1.0, 2.0]),
    "half a covariance": lambda p: p["tracks"][0]["ahead"].update(cov=[[1.0, 0.0]]),
    "a time before now": lambda p: p["risks"][0].update(ttc=-0.1),
    "no word on who was lost": lambda p: p.pop("lost"),
    "an index below the least": lambda p: p["risks"][0].update(index=2 * LEAST_INDEX),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_what_does_not_is_refused(change: Callable[[dict[str, Any]], object]) -> None:
    people = copy.deepcopy(PEOPLE)
    change(people)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(json.loads(dumps(people)), SCHEMA)


@pytest.mark.parametrize("x", [-math.inf, math.nan, -5e4])
def test_nothing_dangerous_becomes_null(x: float) -> None:
    assert index_number(x) == LEAST_INDEX
    assert json.loads(dumps(index_number(x))) is not None


def test_other_numbers_stay() -> None:
    assert (index_number(1.5), index_number(math.inf)) == (1.5, math.inf)
    assert (ttc_number(1.5), ttc_number(math.inf), ttc_number(math.nan)) == (1.5, math.inf, 0.0)
