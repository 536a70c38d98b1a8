"""People in recordings: what was told comes back bit by bit, and so does what was shown."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import msgspec
import numpy as np
import pytest

from backend.documents.people_document import people_document
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.people_records import (
    Judged,
    Missing,
    PartnerRisk,
    People,
    Seen,
    Sensor,
    Tracked,
)
from backend.safety.partner import Limits
from backend.safety.people import Risks
from backend.safety.swing_risk import Boundaries
from backend.shell.app.wire import dumps
from backend.shell.session.people_message import people_message, seen_of
from backend.shell.session.recorded_people import recorded_people
from backend.site.site import load_site


def some(rng: np.random.Generator, k: int = 3) -> Seen:
    return Seen(
        1.1,
        1.17,
        (Sensor("left", "lidar", 1.1, (0.1, 0.2, 2.3), 27_001),),
        np.arange(k) + 4,
        rng.integers(0, 3, k),
        rng.normal(size=(k, 11)),
        rng.normal(size=(k, 4, 4)),
        rng.normal(size=(k, 2)),
        rng.normal(size=(k, 2, 2)),
        rng.normal(size=k),
        (Missing(2, (1.0, 2.0, 0.9), 0.5, 1.1),),
    )


@pytest.mark.parametrize("k", [0, 1, 5])
def test_what_was_told_comes_back_bit_by_bit(k: int) -> None:
    seen = some(np.random.default_rng(k), k)
    again = seen_of(json.loads(msgspec.json.encode(people_message(seen))))
    for field in fields(Seen):
        a, b = getattr(seen, field.name), getattr(again, field.name)
        if isinstance(a, np.ndarray):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)
        else:
            assert a == b


@pytest.mark.parametrize("name", ["state", "cov", "id", "status", "sensors", "lost", "time"])
def test_what_is_damaged_is_refused(name: str) -> None:
    message = people_message(some(np.random.default_rng(0)))
    for bad in ("x", [1.0], None):
        with pytest.raises((ValueError, TypeError, KeyError)):
            seen_of({**message, name: bad})
    del message[name]
    with pytest.raises(KeyError):
        seen_of(message)


def test_what_was_shown_comes_back() -> None:
    rng = np.random.default_rng(1)
    mini = load_machine("mini")
    config = Config(
        load_site("demo").frame, {"left": mini}, {"left": "LEFT"}, ("left",), Limits(0.8, 0.2), 0.1,
        "LIVE",
    )  # fmt: skip
    k = 2
    tracked = Tracked(
        np.arange(k) + 1,
        ("person", "object"),
        np.array([1, 2]),
        rng.normal(size=(k, 3)),
        rng.normal(size=(k, 2)),
        rng.normal(size=k),
        rng.normal(size=(k, 3)),
        rng.normal(size=k),
        rng.normal(size=k),
        rng.normal(size=(k, 2)),
        rng.normal(size=(k, 2, 2)),
    )
    bodies = tuple(f"left:{mini.body_names[b]}" for b in (3, 7))
    risks = Risks(
        np.array([3, 7]), np.array([1.0, np.inf]), np.array([-np.inf, 2.0]), np.array([0.5, 0.25]),
        np.array([4.0, np.inf]), np.array([2, 0]), np.zeros(k, np.int64),
    )  # fmt: skip
    partner = PartnerRisk(
        "left", "right", "left:boom/0", "right:stick/1", 1.5, -np.inf, np.inf, 2.0, 2
    )
    people = People(
        "",
        0.125,
        (Sensor("left", "lidar", 99.5, (0.0, 0.5, 2.0), 123),),
        tracked,
        (Missing(9, (1.0, 2.0, 0.5), 90.0, 93.0),),
        {"left": Judged(np.array([0.5, 3.0]), bodies, risks, (partner,))},
        Boundaries(index=(0.5, 3.0), ttc=(0.8, 2.0)),
    )
    document = people_document(people, 100.0)
    again = recorded_people(json.loads(dumps(document)), 100.0, config)
    assert again is not None
    assert people_document(again, 100.0) == document
    del document["machines"], document["boundaries"]  # as recorded before these were told
    before = recorded_people(json.loads(dumps(document)), 100.0, config)
    assert before is not None
    assert people_document(before, 100.0)["machines"] == []
    assert recorded_people(None, 100.0, config) is None
    unknown = replace(people, reason="no LiDAR data for 0.9 s", age=float("nan"))
    back = recorded_people(json.loads(dumps(people_document(unknown, 100.0))), 100.0, config)
    assert back is not None
    assert np.isnan(back.age)
    assert back.reason == unknown.reason
