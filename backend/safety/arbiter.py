"""The most restrictive concern wins."""

from __future__ import annotations

import numpy as np

from backend.safety.record import Concern, Level
from backend.spatial.types import Array


def arbitrate(
    concerns: tuple[Concern, ...], machine: str, joints: int
) -> tuple[Level, Array, Array]:
    """(level, allowed (n, 2), travel (2,)) for one machine.

    A machine without any concern record is UNKNOWN and may not move: silence is not safety.
    """
    own = [c for c in concerns if c.machine == machine]
    if not own:
        return Level.UNKNOWN, np.zeros((joints, 2)), np.zeros(2)
    level = max(c.level for c in own)
    allowed = np.min([c.allowed for c in own], axis=0)
    travel = np.min([c.travel for c in own], axis=0)
    return level, allowed, travel
