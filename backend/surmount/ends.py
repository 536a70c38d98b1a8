"""Where a manoeuvre may end: P4, so that the machine stands when it lifts the bucket."""

from __future__ import annotations

import numpy as np

from backend.surmount.machine import Climber
from backend.surmount.moves import on_ground
from backend.surmount.records import Step
from backend.surmount.statics import weights_of
from backend.surmount.support import margin

SPARE = 1.5
"""Times the margin that is demanded: the arm is moved afterwards."""


def least_p4(climber: Climber, step: Step) -> float:
    """The least distance [m] of P_b past the edge at which the machine stands with the margin
    demanded, its arm stretched far back over the ground behind; that of half of the crawler's base
    where none within it does.
    """
    a, r = climber.a, climber.r
    _, l2, l3, _ = climber.machine.sun.lengths
    for p4 in np.arange(0.1, 2.01, 0.05) * a:
        stance = on_ground(climber, float(p4), step.height)
        T = stance.T[None]
        # The bucket as far behind the crawler as the arm has it mostly.
        behind = p4 - climber.machine.sun.lengths[0] - 0.8 * (l2 + l3)
        q, _ = climber.arm(T, np.array([min(behind, -r), climber.edge[0]]), -1)
        centre = weights_of(climber, T, q).centre
        if margin(centre[:, :2], stance.lines[None])[0] >= SPARE * climber.demands.margin:
            return float(p4)
    return a
