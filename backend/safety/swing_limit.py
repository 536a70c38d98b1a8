"""What levels leave of a swing: EMERGENCY stops the dangerous direction, WARNING slows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.safety.record import Concern, Level
from backend.safety.swing_risk import Risk
from backend.spatial.types import Array, IntArray

WARNED = 0.4
"""Share of full speed that a warning leaves the swing towards somebody."""


def fractions(level: IntArray, side: IntArray) -> Array:
    """(2,) what is left of the swing's negative and positive speed.

    level: (k,) `Risk` of each; side: (k,) the direction that comes nearer, 0 negative.
    """
    left = np.ones(2)
    for k in np.flatnonzero(level > Risk.SAFE):
        stopped = level[k] == Risk.EMERGENCY
        left[side[k]] = min(left[side[k]], 0.0 if stopped else WARNED)
    return left


def swing_limited(found: Concern, left: Array, worst: int) -> Concern:
    """A concern with its swing, the first joint, limited to `left` (2,), and as severe as `worst`
    (a `Risk`). What is unknown stays so.
    """
    if worst == Risk.SAFE or found.level is Level.UNKNOWN:
        return found
    allowed = found.allowed.copy()
    allowed[0] = np.minimum(allowed[0], left)
    level = Level.STOP if worst == Risk.EMERGENCY else Level.SLOW
    return replace(found, level=max(found.level, level), allowed=allowed)
