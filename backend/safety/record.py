"""The plug-in point: what every safety concern returns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from backend.safety.approach import Approach
from backend.spatial.types import Array


class Level(IntEnum):
    """In the order of severity. UNKNOWN allows no motion, as STOP does not in its directions."""

    CLEAR = 0
    SLOW = 1
    STOP = 2
    UNKNOWN = 3


@dataclass(frozen=True)
class Evidence:
    """What decided: own and other are "machine:part/k" or a site feature.

    points: (2, 3), on own and on other, site frame [m].
    """

    own: str
    other: str
    distance: float  # [m]; NaN when unknown
    points: Array | None
    time_to_contact: float  # [s]; inf when not approaching


@dataclass(frozen=True)
class Concern:
    """One concern's verdict on one machine.

    allowed: (n, 2) fraction of full speed, 0..1, per joint and direction (negative, positive);
    travel: (2,) the same for driving (backward, forward); approach: what its braking distances are
    judged by, None where the fractions say it all.
    """

    name: str  # "partner", "gauge", "self", "people", "tip-over", "stale"
    machine: str
    level: Level
    reason: str
    allowed: Array
    travel: Array
    evidence: Evidence | None
    time: float
    approach: Approach | None = None
