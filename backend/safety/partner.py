"""The other machines as a safety concern of one machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.safety.approach import Approach
from backend.safety.record import Concern, Evidence, Level
from backend.safety.scaling import allowed_speeds, linear
from backend.spatial.types import Array


@dataclass(frozen=True)
class Limits:
    """slow_below: p_u, stop_below: p_l (Mäkinen 2021, Section 3.3) [m]."""

    slow_below: float
    stop_below: float


@dataclass(frozen=True)
class Proximity:
    """One close pair of bodies, seen from one machine.

    own, other: "machine:part/k"; distance: as built [m]; margin: distance less what both poses
    may be wrong by [m]; points: (2, 3) on own and on other, site frame; gradient: (n,) change of
    distance per unit motion of own joints [m/rad]; travel_gradient: per metre driven forward;
    closing: speed at which the pair approaches, both machines moving [m/s].
    """

    own: str
    other: str
    distance: float
    margin: float
    points: Array
    gradient: Array
    travel_gradient: float
    closing: float


def judge(
    machine: str,
    joints: int,
    pairs: tuple[Proximity, ...],
    limits: Limits,
    now: float,
    approach: Approach | None = None,
) -> Concern:
    """CLEAR, SLOW or STOP from all close pairs of one machine; pairs may be empty.

    approach: what braking is judged by, where somebody drives.
    """
    free = np.ones((joints, 2)), np.ones(2)
    if not pairs:
        return Concern(
            "partner", machine, Level.CLEAR, "no machine near", *free, None, now, approach
        )
    margins = np.array([p.margin for p in pairs])
    fractions = linear(margins, limits.stop_below, limits.slow_below)
    allowed = allowed_speeds(np.array([p.gradient for p in pairs]), fractions)
    travel = allowed_speeds(np.array([[p.travel_gradient] for p in pairs]), fractions)[0]
    nearest = pairs[int(np.argmin(margins))]
    level = Level.CLEAR
    if nearest.margin <= limits.stop_below:
        level = Level.STOP
    elif nearest.margin < limits.slow_below:
        level = Level.SLOW
    closing = nearest.closing
    ttc = max(nearest.distance, 0.0) / closing if closing > 1e-3 else float("inf")
    evidence = Evidence(nearest.own, nearest.other, nearest.distance, nearest.points, ttc)
    reason = f"{part(nearest.own)} is {max(nearest.distance, 0.0):.2f} m from {nearest.other}"
    return Concern("partner", machine, level, reason, allowed, travel, evidence, now, approach)


def unknown(machine: str, joints: int, reason: str, now: float) -> Concern:
    """Nothing may move when the distance cannot be computed."""
    none = np.zeros((joints, 2)), np.zeros(2)
    evidence = Evidence(machine, "", float("nan"), None, float("inf"))
    return Concern("partner", machine, Level.UNKNOWN, reason, *none, evidence, now)


def part(body: str) -> str:
    """The part of "machine:part/k"."""
    return body.split(":", 1)[-1].split("/", 1)[0]
