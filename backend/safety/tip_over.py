"""Tipping over as a safety concern of one machine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backend.safety.record import Concern, Level
from backend.spatial.types import Array

NAME = "tip-over"


@dataclass(frozen=True)
class TipOver:
    """keep: share of the way from the middle to an edge of the tracks that must be left; slow: the
    share below which it is told. payload: by machine [kg], the rated one where it is not stated.
    limits: whether motions are limited by it. required: whether a machine about which nothing is
    known may not move.

    By default it may: whether masses are trusted or the slope is measured is a property of the
    site's equipment, not an event, and a machine that could never be moved would be driven without
    the cockpit. Its state reads UNKNOWN all the time; it never reads safe. A site that lifts loads
    asks for it with `required`.
    """

    keep: float = 0.1
    slow: float = 0.25
    payload: Mapping[str, float] = field(default_factory=dict)
    limits: bool = True
    required: bool = False

    def __post_init__(self) -> None:
        if not 0.0 <= self.keep < self.slow <= 1.0:
            raise ValueError(
                f"keep ({self.keep}) must be 0 or more and less than slow ({self.slow}), at most 1"
            )


def judge(
    machine: str,
    label: str,
    share: float,
    edge: str,
    allowed: Array,
    travel: Array,
    rules: TipOver,
    now: float,
) -> Concern:
    """CLEAR, SLOW or STOP. share, edge: of the ZMP as the machine moves now; allowed: (n, 2) and
    travel: (2,) fractions from which no braking takes more than `keep`.
    """
    level = Level.CLEAR
    if not share > rules.keep:
        level = Level.STOP
    elif share < rules.slow:
        level = Level.SLOW
    left = math.floor(100.0 * max(share, 0.0)) if math.isfinite(share) else 0
    reason = f"{label} tips over {edge} · margin {left} %"
    return Concern(NAME, machine, level, reason, allowed, travel, None, now)


def unknown(machine: str, label: str, joints: int, why: str, now: float) -> Concern:
    """Nothing may move where it must be known whether a machine tips, and is not."""
    none = np.zeros((joints, 2)), np.zeros(2)
    return Concern(NAME, machine, Level.UNKNOWN, f"{label} tip-over: {why}", *none, None, now)
