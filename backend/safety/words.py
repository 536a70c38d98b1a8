"""Concerns in an operator's words: two short lines, the machine and the freeing lever named."""

from __future__ import annotations

import math

from backend.machine.model import Machine
from backend.safety import people_words, site, surmounting, tip_over
from backend.safety.partner import part
from backend.safety.record import Concern, Level

_RAISING = {"boom": ("down", "up"), "stick": ("in", "out"), "bucket": ("curl", "dump")}
LINE_LENGTH = 50


def directions(machine: Machine) -> dict[str, tuple[str, str]]:
    """Per joint role the words for its negative and its positive direction.

    A positive angle of Sun 2020 raises; the machine's map says how its own joint values turn.
    """
    words = {}
    signs = dict(zip(("boom", "stick", "bucket"), machine.sun.signs, strict=True))
    for joint in machine.joints:
        if joint.role == "swing":
            low, high = ("right", "left") if machine.sun.azimuth_sign > 0 else ("left", "right")
        elif joint.role in _RAISING:
            low, high = _RAISING[joint.role]
            if signs[joint.role] < 0:
                low, high = high, low
        else:
            low, high = "-", "+"
        words[joint.role] = (f"{joint.role} {low}", f"{joint.role} {high}")
    return words


def line(concern: Concern, labels: dict[str, str]) -> str:
    """`LEVEL · MACHINE part ↔ cause · value`, at most 50 characters."""
    evidence = concern.evidence
    if concern.level is Level.UNKNOWN or evidence is None or not evidence.other:
        return _fit(f"{concern.level.name} · {concern.reason}")
    own = labels.get(concern.machine, concern.machine.upper())
    if concern.name == people_words.NAME:
        return _fit(people_words.line(concern.level.name, own, evidence))
    other_machine, _, _ = evidence.other.partition(":")
    other = f"{labels.get(other_machine, other_machine.upper())} {part(evidence.other)}"
    if concern.name in (site.NAME, surmounting.NAME):
        other = part(evidence.other)
    value = f"{max(evidence.distance, 0.0):.2f} m"
    return _fit(f"{concern.level.name} · {own} {part(evidence.own)} ↔ {other} · {value}")


def detail(concern: Concern, machine: Machine, labels: dict[str, str]) -> str:
    """What is limited and which levers are free."""
    own = labels.get(concern.machine, concern.machine.upper())
    if concern.name == people_words.NAME:
        return people_words.detail(concern, own, tuple(directions(machine).values()))
    if concern.name == surmounting.NAME and concern.evidence is None:
        return surmounting.detail(concern.level, own)
    if concern.level is Level.UNKNOWN and concern.name == tip_over.NAME:
        return f"The site asks for it: do not move {own}. State its masses, measure its slope."
    if concern.level is Level.UNKNOWN:
        return f"Clearance unknown: do not move {own}. Check radio and sensors of the one named."
    limited, free = [], []
    for joint, allowed, words in zip(
        machine.joints, concern.allowed, directions(machine).values(), strict=True
    ):
        del joint
        if min(allowed) >= 1.0:
            continue
        for fraction, back, word in zip(allowed, allowed[::-1], words, strict=True):
            if fraction < 1.0:
                limited.append(
                    f"{word} {math.floor(100 * fraction)} %" if fraction else f"{word} stop"
                )
            elif back < 1.0:
                free.append(word)
    parts = []
    if limited:
        parts.append(f"Advice: {', '.join(limited)}.")
    if free:
        parts.append(f"Free: {', '.join(free)}.")
    if concern.name == tip_over.NAME and not parts:
        return "No lever is limited by it."
    return " ".join(parts) or "No joint of this machine shortens the distance."


def _fit(text: str) -> str:
    return text if len(text) <= LINE_LENGTH else text[: LINE_LENGTH - 1] + "…"
