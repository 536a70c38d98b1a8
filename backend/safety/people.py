"""People and moving objects around a machine as a safety concern of it (Rasul 2021, Section 4).

Three things count, and the most restrictive wins: the distance to every body (Mäkinen 2021, Eq.
(3.11) corrected), the braking distances while somebody walks towards the machine, and the levels of
the swing by time to collision and warning index, now and in a second.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from backend.safety import site
from backend.safety.approach import Approach
from backend.safety.partner import Limits
from backend.safety.record import Concern
from backend.safety.swing_limit import fractions, swing_limited
from backend.safety.swing_risk import Boundaries, Risk
from backend.spatial.types import Array, IntArray

NAME = "people"


@dataclass(frozen=True)
class Watch:
    """How people are judged. slow_below, stop_below: distances of people to bodies at which motion
    towards them begins to slow and stops [m]; walking: speed at which anybody may begin to come
    nearer [m/s]; boundaries: of the swing's levels; stale: without a scan for so long people are
    unknown [s]; remembered: how long the place of somebody who was lost counts as taken [s];
    uncertainty: of sensors and control in the swing's safety clearance [m].
    """

    slow_below: float = 2.0
    stop_below: float = 0.6
    walking: float = 1.0
    boundaries: Boundaries = field(default_factory=Boundaries)
    stale: float = 0.5
    remembered: float = 10.0
    uncertainty: float = 0.2

    @property
    def limits(self) -> Limits:
        return Limits(self.slow_below, self.stop_below)


@dataclass(frozen=True)
class Risks:
    """What the swing of one machine is to k people and objects. body: (k,) own body that is
    soonest; ttc, index: (k,) now, ttc_ahead, index_ahead: (k,) in a second [s, -]; level: (k,)
    `Risk`, the worse of both; side: (k,) the direction of the swing that comes nearer, 0 negative.
    """

    body: IntArray
    ttc: Array
    index: Array
    ttc_ahead: Array
    index_ahead: Array
    level: IntArray
    side: IntArray


def judge(
    machine: str,
    joints: int,
    rows: site.Rows,
    names: tuple[tuple[str, ...], tuple[str, ...]],
    watch: Watch,
    risks: Risks,
    now: float,
    approach: Approach | None = None,
) -> Concern:
    """The verdict on one machine. names: of own bodies and of the people ("person:P7"), to which
    `risks` belong in the same order; the swing is the first joint.
    """
    found = site.judge(machine, joints, rows, names, watch.limits, now, approach, NAME)
    if not len(risks.level) or risks.level.max() == Risk.SAFE:
        return found
    left = fractions(risks.level, risks.side)
    limited = swing_limited(found, left, int(risks.level.max()))
    worst = int(np.lexsort((risks.ttc, -risks.level))[0])
    if limited.level > found.level or not len(rows.margin):
        return replace(limited, reason=_words(risks, worst, names))
    return limited


def unknown(machine: str, joints: int, reason: str, now: float) -> Concern:
    """Nothing may move where nobody can say who stands there."""
    return site.unknown(machine, joints, reason, now, NAME)


def _words(risks: Risks, k: int, names: tuple[tuple[str, ...], tuple[str, ...]]) -> str:
    own = names[0][int(risks.body[k])].split(":", 1)[-1].split("/", 1)[0]
    soon = min(float(risks.ttc[k]), float(risks.ttc_ahead[k]) + 1.0)
    who = names[1][k].split(":", 1)[-1]
    when = f"in {soon:.1f} s" if np.isfinite(soon) else "within its braking distance"
    return f"{own} meets {who} {when}"
