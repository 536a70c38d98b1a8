"""The people of a snapshot in the 3D scene: each at its worst for any machine."""

from __future__ import annotations

import math

import numpy as np

from backend.pipeline.people_records import Judged, Missing, People, Sensor, Tracked
from backend.safety.people import Risks
from backend.safety.swing_risk import Risk
from backend.tracking.records import Status
from cockpit.views.people_seen import seen_people


def judged(levels: list[Risk], distances: list[float]) -> Judged:
    k = len(levels)
    never, none = np.full(k, np.inf), np.zeros(k, np.int64)
    level = np.array(levels, dtype=np.int64)
    return Judged(
        np.array(distances), ("a:boom/0",) * k, Risks(none, never, never, never, never, level, none)
    )


def test_each_is_shown_at_its_worst_and_its_nearest() -> None:
    k = 3
    tracked = Tracked(
        np.array([3, 7, 9]),
        ("person", "object", "person"),
        np.array([Status.CONFIRMED, Status.COASTING, Status.TENTATIVE]),
        np.arange(9.0).reshape(k, 3),
        np.zeros((k, 2)),
        np.array([0.1, 0.2, 0.3]),
        np.ones((k, 3)),
        np.zeros(k),
        np.zeros(k),
        np.arange(6.0).reshape(k, 2),
        np.tile(np.eye(2), (k, 1, 1)),
    )
    people = People(
        "",
        0.2,
        (Sensor("a", "lidar", 99.5, (1.0, 2.0, 3.0), 100),),
        tracked,
        (Missing(5, (4.0, 5.0, 0.0), 90.0, 93.0),),
        {
            "a": judged([Risk.SAFE, Risk.WARNING, Risk.SAFE], [5.0, 3.0, 9.0]),
            "b": judged([Risk.EMERGENCY, Risk.WARNING, Risk.SAFE], [6.0, 2.0, 8.0]),
        },
    )
    seen = seen_people(people, 100.0)
    assert seen is not None
    assert [t.code for t in seen.tracks] == ["P3", "O7", "P9"]
    assert [t.risk for t in seen.tracks] == [Risk.EMERGENCY, Risk.WARNING, Risk.SAFE]
    assert [t.distance for t in seen.tracks] == [6.0, 2.0, 8.0]
    assert [t.status for t in seen.tracks][1] is Status.COASTING
    np.testing.assert_array_equal(seen.tracks[2].position, [6.0, 7.0, 8.0])
    assert (seen.lost[0].id, seen.lost[0].seen) == (5, 10.0)
    assert seen.sensors[0].age == 0.5
    assert seen_people(None, 100.0) is None
    nobody = seen_people(People("no LiDAR has been heard yet", math.nan), 100.0)
    assert nobody is not None
    assert nobody.tracks == ()
    assert nobody.reason
