"""People and objects in an operator's words: the concern's two lines, and whether they are seen."""

from __future__ import annotations

import math

from backend.safety.partner import part
from backend.safety.record import Concern, Evidence, Level

NAME = "people"
TRAVEL = ("drive back", "drive ahead")


def line(level: str, own: str, evidence: Evidence) -> str:
    """`LEVEL · MACHINE part ↔ person P7 · value`. own: the machine's label; evidence.other:
    "person:P7" or "object:O9".
    """
    kind, _, code = evidence.other.partition(":")
    other = f"{kind} {code}".strip()
    return f"{level} · {own} {part(evidence.own)} ↔ {other} · {_metres(evidence.distance)}"


def detail(concern: Concern, own: str, directions: tuple[tuple[str, str], ...]) -> str:
    """What is blocked or limited, which levers are free, and whom to wait for.

    own: the machine's label; directions: per joint the words for its negative and positive motion.
    """
    if concern.level is Level.UNKNOWN and not concern.reason.startswith("people:"):
        return f"Clearance unknown: do not move {own}. Check radio and sensors of the one named."
    if concern.level is Level.UNKNOWN:
        return f"Nobody knows where people are: do not move {own}. Check its LiDAR."
    blocked, limited, free = [], [], []
    rows = [*zip(concern.allowed, directions, strict=True), (concern.travel, TRAVEL)]
    for allowed, words in rows:
        for fraction, back, word in zip(allowed, allowed[::-1], words, strict=True):
            if fraction < 0.01:
                blocked.append(word)
            elif fraction < 1.0:
                limited.append(f"{word} limited to {math.floor(100 * fraction)} %")
            elif back < 1.0:
                free.append(word)
    said = [f"{', '.join(blocked)} blocked"] if blocked else []
    said += [", ".join(limited)] if limited else []
    said += [f"free: {', '.join(free)}"] if free else []
    said.append(_advice(concern))
    return " ".join(f"{text[0].upper()}{text[1:]}." for text in said)


def seen(persons: int, objects: int, lost: int, age: float, reason: str = "") -> str:
    """Whether people are seen, for the state of the backend: `People: 2 seen, 0.1 s old`.

    persons, objects: tracks that are confirmed or coast; lost: given up near a machine; age: of the
    newest scan [s], NaN before the first; reason: why people are not known, else empty.
    """
    if reason or not math.isfinite(age):
        return f"People: unknown, {reason or 'no LiDAR data yet'}"
    more = f", {objects} object{'' if objects == 1 else 's'}" if objects else ""
    more += f", {lost} lost" if lost else ""
    return f"People: {persons} seen{more}, {age:.1f} s old"


def _advice(concern: Concern) -> str:
    _, _, code = concern.evidence.other.partition(":") if concern.evidence else ("", "", "")
    who = code or "them"
    return f"wait for {who}" if concern.level is Level.STOP else f"watch {who}"


def _metres(distance: float) -> str:
    """As the page writes distances: centimetres only below a metre."""
    if math.isnan(distance):
        return "unknown"
    shown = max(distance, 0.0)
    return f"{shown:.2f} m" if shown < 0.995 else f"{shown:.1f} m"
