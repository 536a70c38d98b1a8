"""The words in the scene, and how often they change."""

from __future__ import annotations

import math
from collections.abc import Hashable

from viser import LabelHandle

from backend.fusion.pose import FusedPose, Validity
from backend.pipeline.records import PairDistance, Snapshot
from backend.safety.record import Level

DIGITS_PERIOD = 0.5  # [s] between changes of digits; a change of meaning shows at once


def pair_level(
    snapshot: Snapshot, pair: PairDistance, slow_below: float, stop_below: float
) -> Level:
    """The severest of the two machines' own verdicts on each other and of the plain distance."""
    if math.isnan(pair.distance):
        return Level.UNKNOWN
    level = Level.CLEAR
    if pair.distance <= stop_below:
        level = Level.STOP
    elif pair.distance < slow_below:
        level = Level.SLOW
    for concern in snapshot.concerns:
        other = concern.evidence.other.split(":", 1)[0] if concern.evidence else ""
        if concern.name == "partner" and {concern.machine, other} == {pair.a, pair.b}:
            level = max(level, concern.level)
    return level


def distance_text(distance: float, level: Level, exact: bool) -> str:
    """The words on the line between the nearest points; never a number when unknown."""
    if level is Level.UNKNOWN or not math.isfinite(distance):
        return "? clearance unknown"
    shown = max(distance, 0.0)
    number = f"{shown:.2f} m" if shown < 10.0 else f"{shown:.1f} m"
    if level is Level.STOP:
        return f"STOP · {number}"
    if level is Level.SLOW:
        return f"▲ SLOW · {number}"
    return number if exact else f"over {number}"


def oldest(pose: FusedPose) -> float:
    """The largest age of a stream that was ever received [s]; inf when none was."""
    ages = [s.age for s in pose.streams.values() if math.isfinite(s.age)]
    return max(ages, default=math.inf)


def name_text(label: str, validity: Validity, age: float) -> str:
    """A machine's name, and what is wrong with its pose."""
    if validity is Validity.VALID:
        return label
    seconds = f" {age:.1f} s" if math.isfinite(age) else ""
    return f"{label} · {validity.value}{seconds}"


class Words:
    """A label whose digits change at most every half second, and whose meaning changes at once."""

    def __init__(self, label: LabelHandle) -> None:
        self.label = label
        self._meaning: Hashable = None
        self._changed = -math.inf

    def show(self, text: str, meaning: Hashable, now: float) -> None:
        """meaning: what must show at once when it changes (a level, a validity); now [s]."""
        if meaning != self._meaning or now - self._changed >= DIGITS_PERIOD:
            if self.label.text != text:
                self.label.text = text
            self._meaning, self._changed = meaning, now
        self.label.visible = True

    def hide(self) -> None:
        self.label.visible = False
        self._meaning = None
