"""What stands on the site as a safety concern of one machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.safety.approach import Approach
from backend.safety.partner import Limits, part
from backend.safety.record import Concern, Evidence, Level
from backend.safety.scaling import allowed_speeds, linear
from backend.spatial.types import Array, IntArray

NAME = "site"


@dataclass(frozen=True)
class Rows:
    """r close pairs of own bodies and bodies of the site, several for each, in any order.

    own, other: (r,) indices of bodies; distance: as built [m]; margin: distance less what the pose
    may be wrong by [m]; points: (r, 2, 3) on own and on other, site frame; gradient: (r, n) change
    of distance per unit motion of own joints [m/rad]; travel: (r,) per metre driven forward;
    closing: (r,) speed at which the own body approaches [m/s].
    """

    own: IntArray
    other: IntArray
    distance: Array
    margin: Array
    points: Array
    gradient: Array
    travel: Array
    closing: Array


def judge(
    machine: str,
    joints: int,
    rows: Rows,
    names: tuple[tuple[str, ...], tuple[str, ...]],
    limits: Limits,
    now: float,
    approach: Approach | None = None,
    name: str = NAME,
) -> Concern:
    """CLEAR, SLOW or STOP from all close pairs (Mäkinen 2021, Eq. (3.11) corrected).

    names: of own bodies ("left:boom/0") and of the site's ("site:wall"); approach: what braking is
    judged by, where somebody drives; name: of the concern. Of all pairs the most restrictive wins
    in each direction.
    """
    free = np.ones((joints, 2)), np.ones(2)
    if not len(rows.margin):
        return Concern(name, machine, Level.CLEAR, "nothing near", *free, None, now, approach)
    fractions = linear(rows.margin, limits.stop_below, limits.slow_below)
    allowed = allowed_speeds(rows.gradient, fractions)
    travel = allowed_speeds(rows.travel[:, None], fractions)[0]
    k = int(np.argmin(rows.margin))
    level = Level.CLEAR
    if rows.margin[k] <= limits.stop_below:
        level = Level.STOP
    elif rows.margin[k] < limits.slow_below:
        level = Level.SLOW
    own, other = names[0][rows.own[k]], names[1][rows.other[k]]
    distance, closing = float(rows.distance[k]), float(rows.closing[k])
    ttc = max(distance, 0.0) / closing if closing > 1e-3 else float("inf")
    evidence = Evidence(own, other, distance, rows.points[k], ttc)
    reason = f"{part(own)} is {max(distance, 0.0):.2f} m from {part(other)}"
    return Concern(name, machine, level, reason, allowed, travel, evidence, now, approach)


def unknown(machine: str, joints: int, reason: str, now: float, name: str = NAME) -> Concern:
    """Nothing may move where a machine stands among obstacles, but not where."""
    none = np.zeros((joints, 2)), np.zeros(2)
    evidence = Evidence(machine, "", float("nan"), None, float("inf"))
    return Concern(name, machine, Level.UNKNOWN, reason, *none, evidence, now)
