"""One marker for one near miss, however long it lasts and however the distance trembles."""

from __future__ import annotations

import math
from types import SimpleNamespace

from backend.pipeline.records import PairDistance
from backend.shell.session.near_miss import NearMiss, NearMisses


def watched(distances: list[float], stop_below: float = 0.2) -> list[NearMiss]:
    misses = NearMisses(stop_below)
    found = []
    for k, d in enumerate(distances):
        near = not d > 50.0
        pair = PairDistance("left", "right", f"stick/{k}", "bucket/1", d, None, "", 1, near)
        found += misses.update(SimpleNamespace(time=10.0 + k, pairs=(pair,)))  # type: ignore[arg-type]
    return found


def test_the_smallest_distance_and_its_time_are_kept() -> None:
    (miss,) = watched([1.0, 0.19, 0.12, 0.05, 0.15, 0.25, 0.29, 0.31, 1.0])
    assert miss == NearMiss("left", "stick/3", "right", "bucket/1", 0.05, 13.0, 11.0, 17.0)
    assert miss.text == "LEFT stick ↔ RIGHT bucket 0.05 m"


def test_trembling_about_the_threshold_is_one_near_miss() -> None:
    assert len(watched([1.0, *[0.19, 0.21] * 50, 0.5])) == 1
    assert len(watched([0.1, 0.31, 0.1, 0.31])) == 2


def test_not_below_the_stop_distance_is_none() -> None:
    assert watched([1.0, 0.21, 0.2, 0.21, 1.0]) == []


def test_unknown_distances_neither_begin_nor_end_one() -> None:
    assert watched([math.nan, 0.1, math.nan, math.nan, 0.15]) == []
    (miss,) = watched([0.1, math.nan, 0.15, 99.0])  # 99: a lower bound of machines far apart
    assert (miss.distance, miss.begin, miss.end) == (0.1, 10.0, 13.0)


def test_contact_is_said_and_an_unfinished_one_is_told_at_the_end() -> None:
    misses = NearMisses(0.2)
    pair = PairDistance("left", "right", "stick/0", "boom/0", -0.1, None, "", 1, True)
    assert misses.update(SimpleNamespace(time=1.0, pairs=(pair,))) == []  # type: ignore[arg-type]
    (miss,) = misses.close()
    assert miss.text == "LEFT stick ↔ RIGHT boom contact"
    assert misses.close() == []
