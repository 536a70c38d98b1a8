"""What a trajectory over an obstacle counts on, beside where it leads: the plan's side of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array

TOUCHING = ("tracks", "bucket")
"""Parts that touch what is climbed, unless the plan says otherwise."""


@dataclass(frozen=True)
class Phase:
    """A stretch of the trajectory. start, end: of its time [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class Climb:
    """obstacles: names of the site's bodies that are climbed; phases: in order; touching: parts of
    the machine that touch them by plan; clearance: of all other parts to them, the least by plan
    [m]; support: (m, k, 3) what the machine stands on at each of the trajectory's times, site
    frame, NaN where these are fewer than k [m]; margin: (m,) of its centre of mass to the edge of
    that [m].

    Raises InputError unless that is what they are.
    """

    obstacles: tuple[str, ...]
    phases: tuple[Phase, ...]
    support: Array
    margin: Array
    touching: tuple[str, ...] = TOUCHING
    clearance: float = 0.0

    def __post_init__(self) -> None:
        if not self.obstacles or not self.phases:
            raise InputError("climb: it names what is climbed, and its phases.")
        if not np.isfinite(self.margin).all() or not self.clearance >= 0.0:
            raise InputError("climb: margins must be finite, the clearance 0 m or more.")

    def phase_at(self, t: float) -> str:
        """The name of the phase at t [s]; before the first it is the first, and so on."""
        begun = [phase.name for phase in self.phases if phase.start <= t]
        return begun[-1] if begun else self.phases[0].name
