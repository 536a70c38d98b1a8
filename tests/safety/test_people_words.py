"""People in an operator's words."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from backend.machine.load import load_machine
from backend.safety import people_words, words
from backend.safety.record import Concern, Evidence, Level

LABELS = {"left": "LEFT"}
MINI = load_machine("mini")


def concern(
    level: Level,
    allowed: list[list[float]],
    travel: tuple[float, float] = (1.0, 1.0),
    **more: object,
) -> Concern:
    given = {"other": "person:P7", "distance": 1.1, **more}
    evidence = Evidence("left:counterweight/0", points=None, time_to_contact=0.8, **given)  # type: ignore[arg-type]
    return Concern(
        *("people", "left", level, "no LiDAR data for 0.8 s", np.array(allowed), np.array(travel)),
        evidence,
        0.0,
    )


def swing_left(fraction: float) -> list[list[float]]:
    """Only the swing to the left is limited."""
    low, _ = words.directions(MINI)["swing"]
    row = [fraction, 1.0] if low == "swing left" else [1.0, fraction]
    return [row, *[[1.0, 1.0]] * (len(MINI.joints) - 1)]


def test_a_stop_for_somebody_reads_as_agreed() -> None:
    stop = concern(Level.STOP, swing_left(0.0))
    assert words.line(stop, LABELS) == "STOP · LEFT counterweight ↔ person P7 · 1.1 m"
    told = words.detail(stop, MINI, LABELS)
    assert told == "Swing left blocked. Free: swing right. Wait for P7."


def test_slowing_for_an_object_says_how_much_and_nothing_of_waiting() -> None:
    slow = concern(Level.SLOW, swing_left(0.409), other="object:O9", distance=0.784)
    assert words.line(slow, LABELS) == "SLOW · LEFT counterweight ↔ object O9 · 0.78 m"
    told = words.detail(slow, MINI, LABELS)
    assert told == "Swing left limited to 40 %. Free: swing right. Watch O9."


def test_driving_is_named_too_and_a_hundredth_is_no_freedom() -> None:
    stop = concern(Level.STOP, swing_left(1.0), travel=(0.004, 1.0))
    told = words.detail(stop, MINI, LABELS)
    assert told == "Drive back blocked. Free: drive ahead. Wait for P7."


@pytest.mark.parametrize(
    ("distance", "text"),
    [(0.994, "0.99 m"), (0.996, "1.0 m"), (-0.2, "0.00 m"), (math.nan, "unknown")],
)
def test_distances_as_the_page_writes_them(distance: float, text: str) -> None:
    line = words.line(concern(Level.STOP, swing_left(0.0), distance=distance), LABELS)
    assert line.endswith(f"person P7 · {text}")
    assert len(line) <= words.LINE_LENGTH


def test_who_is_unknown_stops_in_words() -> None:
    blind = concern(Level.UNKNOWN, [[0.0, 0.0]] * len(MINI.joints), (0.0, 0.0))
    blind = replace(blind, reason="people: no LiDAR data for 0.8 s")
    assert words.line(blind, LABELS) == "UNKNOWN · people: no LiDAR data for 0.8 s"
    assert words.detail(blind, MINI, LABELS) == (
        "Nobody knows where people are: do not move LEFT. Check its LiDAR."
    )
    lost = replace(blind, reason="LEFT joint angles are 0.3 s old")
    assert words.detail(lost, MINI, LABELS) == (
        "Clearance unknown: do not move LEFT. Check radio and sensors of the one named."
    )


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ((2, 0, 0, 0.1), "People: 2 seen, 0.1 s old"),
        ((0, 1, 0, 0.14), "People: 0 seen, 1 object, 0.1 s old"),
        ((1, 2, 1, 0.0), "People: 1 seen, 2 objects, 1 lost, 0.0 s old"),
        ((3, 0, 0, math.nan), "People: unknown, no LiDAR data yet"),
        ((3, 0, 0, 0.8, "no LiDAR data for 0.8 s"), "People: unknown, no LiDAR data for 0.8 s"),
    ],
)
def test_whether_they_are_seen(given: tuple, text: str) -> None:
    assert people_words.seen(*given) == text
