"""A machine that is taken over an obstacle by plan, as a safety concern of that machine.

What the plan counts on comes in as a `Surmounting` with every cycle while it is followed, moving or
not: where the base should be, what the machine stands on, and what it touches. The obstacle is
exempt for the parts that touch it by plan, and for nothing else; without that input it is an
ordinary body of the site again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.safety import site, tip_over
from backend.safety.approach import Approach
from backend.safety.partner import Limits
from backend.safety.record import Concern, Evidence, Level
from backend.safety.tip_over import TipOver

NAME = "surmounting"
STALE = 0.25
"""What is told of a manoeuvre counts no longer than this [s]."""
LEFT = 0.5
"""Share of a planned margin or clearance that must be left."""
_LEAST = 1e-3  # between the two distances of a linear law [m]

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Surmounting:
    """plan: its name; time: when it was told, by the local clock [s]; obstacles: names of the
    site's bodies that are climbed; phase: in the plan's words; touching: parts of the machine that
    touch them by plan; position, attitude: of the base where the sensors should see it, site frame
    [m], and yaw, pitch, roll [rad]; tolerance: of both [m, rad]; support: what it stands on there,
    site frame [m]; margin: of its centre of mass to the edge of that, by plan [m]; clearance: of
    all other parts to the obstacles, the least by plan [m].
    """

    plan: str
    time: float
    obstacles: tuple[str, ...]
    phase: str
    touching: tuple[str, ...]
    position: Place
    attitude: tuple[float, float, float]
    tolerance: tuple[float, float]
    support: tuple[Place, ...]
    margin: float
    clearance: float


def judge(
    machine: str,
    label: str,
    joints: int,
    given: Surmounting,
    off: str,
    margin: float,
    rows: site.Rows,
    names: tuple[tuple[str, ...], tuple[str, ...]],
    limits: Limits,
    now: float,
    approach: Approach | None = None,
) -> Concern:
    """SLOW while all is as planned, limiting nothing; STOP for everything where it is not.

    off: how the pose left the plan, in words, empty within the tolerance; margin: as it stands now
    [m]; rows, names, approach: of the parts that must not touch what is climbed, as for the site,
    and limits: of their distance.
    """
    if off:
        nothing = np.zeros((joints, 2)), np.zeros(2)
        reason = f"{label} {given.phase}: {off}"
        return Concern(NAME, machine, Level.STOP, reason, *nothing, None, now)
    near = site.judge(machine, joints, rows, names, limits, now, approach, NAME)
    if near.level is not Level.CLEAR:
        return near
    left = f"{margin:.2f} m" if math.isfinite(margin) else "unknown"
    reason = f"{label} on {', '.join(given.obstacles)} · margin {left} · {given.phase}"
    return Concern(
        NAME, machine, Level.SLOW, reason, near.allowed, near.travel, None, now, approach
    )


def unknown(machine: str, joints: int, reason: str, now: float) -> Concern:
    """Nothing may move on an obstacle where it is not known how the machine stands there."""
    none = np.zeros((joints, 2)), np.zeros(2)
    evidence = Evidence(machine, "", float("nan"), None, float("inf"))
    return Concern(NAME, machine, Level.UNKNOWN, reason, *none, evidence, now)


def tips(
    machine: str,
    label: str,
    joints: int,
    given: Surmounting,
    stands: tuple[float, float, str],
    rules: TipOver,
    now: float,
) -> Concern:
    """Tipping over what a manoeuvre stands on. stands: margin [m], share and edge as they are now.

    STOP below what the rules keep or half of what is planned, whichever is less; never on the edge.
    """
    margin, share, edge = stands
    inradius = margin / share if share > 0.0 else math.inf
    keep = max(min(rules.keep * inradius, LEFT * given.margin), 0.0)
    free = np.ones((joints, 2)), np.ones(2)
    reason = f"{label} tips over {edge} · margin {max(margin, 0.0):.2f} m"
    if not margin > keep:
        nothing = np.zeros((joints, 2)), np.zeros(2)
        return Concern(tip_over.NAME, machine, Level.STOP, reason, *nothing, None, now)
    level = Level.SLOW if share < rules.slow else Level.CLEAR
    return Concern(tip_over.NAME, machine, level, reason, *free, None, now)


def detail(level: Level, label: str) -> str:
    """What an operator may do now; where nothing else says it."""
    if level is Level.SLOW:
        return f"{label} follows its plan while the dead-man is held; let go, and it stands."
    return f"{label} stands: it left its plan. Look before anything is moved by hand."


def limits_of(given: Surmounting, limits: Limits) -> Limits:
    """Of the parts that must not touch: the site's, and no more than the plan itself keeps."""
    stop = min(limits.stop_below, LEFT * given.clearance)
    slow = min(limits.slow_below, 0.5 * (1.0 + LEFT) * given.clearance)
    return Limits(max(slow, stop + _LEAST), stop)
