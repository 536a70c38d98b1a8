"""How fast each motion of a machine may be, from the verdicts of all concerns.

Motions are the joints, then the left and the right track: m = n + 2. Directions are (negative,
positive). Of all concerns the most restrictive wins; a motion is limited only where it approaches.

    Mäkinen 2021, Eq. (3.11) corrected:  fraction = (p - p_l) / (p_u - p_l)      in `scaling`
    ours:   c s + 1/2 b s^2 <= min(share room, room - w (T + v / a)),  s = v T + v^2 / (2 a)

c, b: slope and bend of a row of `approach`; w: closing speed of the partner, which is taken to keep
its present velocity while this machine brakes. T: age of the data, way of the command, lag of the
hydraulics. share: half beside a partner, who may start at the same moment, seen only later; when
either stops within half of the room, both stop apart. All of it beside what stands still.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.safety import limit_kernels
from backend.safety.approach import Approach
from backend.safety.braking import accelerations, braking_speed, full_speeds
from backend.safety.record import Concern, Level
from backend.spatial.types import Array

CUSHION = np.radians(0.5)
"""Joints stop this far before their ends [rad]."""
STALE = 0.25
"""A verdict older than this allows nothing [s]."""


@dataclass(frozen=True)
class Delay:
    """up: from deciding on a command to its arrival on the machine [s]; round_trip: there and back
    [s]; joint_lag, track_lag: of the machine's velocity loops [s]; cycle: between commands [s].
    """

    up: float
    round_trip: float
    joint_lag: float = 0.08
    track_lag: float = 0.20
    cycle: float = 0.02

    def total(self, joints: int, age: float) -> Array:
        """(m,) T of each motion for data of that age [s]."""
        lags = np.array([self.joint_lag] * joints + [self.track_lag] * 2)
        return np.asarray(age + self.up + self.cycle + lags)


@dataclass(frozen=True)
class Cause:
    """Why one direction is limited. concern: "partner", "end", ...; empty when it is free."""

    concern: str = ""
    reason: str = ""


FREE = Cause()


@dataclass(frozen=True)
class Limits:
    """fraction: (m, 2) of full speed, 0..1; causes: the same shape; parts: every approach that
    counts for motions at once, with the T (m,) that it counts with.
    """

    fraction: Array
    causes: tuple[tuple[Cause, Cause], ...]
    parts: tuple[tuple[str, Approach, Array], ...]


def limits(
    machine: Machine, concerns: tuple[Concern, ...], delay: Delay, now: float, lift: float = 0.0
) -> Limits:
    """What the concerns of one machine leave of each motion.

    lift: no fraction falls below it, for an override.
    """
    n = len(machine.joints)
    fraction = np.ones((n + 2, 2))
    causes = [[FREE, FREE] for _ in range(n + 2)]
    parts: list[tuple[str, Approach, Array]] = []

    def lower(values: Array, name: str, reasons: list[list[str]]) -> None:
        for k, side in np.argwhere(values < fraction):
            fraction[k, side] = values[k, side]
            causes[k][side] = Cause(name, reasons[k][side])

    if not concerns:
        nothing = np.zeros((n + 2, 2))
        lower(nothing, "none", [["nothing watches over this machine"] * 2] * (n + 2))
    for concern in concerns:
        stale = now - concern.time
        if concern.level is Level.UNKNOWN or not stale <= STALE:
            old = f"judged {stale:.1f} s ago" if not stale <= STALE else concern.reason
            lower(np.zeros((n + 2, 2)), concern.name, [[old] * 2] * (n + 2))
            continue
        scaled = np.concatenate([concern.allowed, np.tile(concern.travel, (2, 1))])
        lower(scaled, concern.name, [[concern.reason] * 2] * (n + 2))
        if concern.approach is not None and len(concern.approach.room):
            T = delay.total(n, concern.approach.age)
            values, reasons = _braking(machine, concern.approach, T)
            lower(values, concern.name, reasons)
            parts.append((concern.name, concern.approach, T))
    fraction = np.maximum(fraction, lift)
    return Limits(fraction, tuple((a, b) for a, b in causes), tuple(parts))


def _braking(machine: Machine, part: Approach, T: Array) -> tuple[Array, list[list[str]]]:
    full = full_speeds(machine)
    speed, row = limit_kernels.single(
        part.room, part.slope, part.bend, part.closing, part.rates, full, T,
        accelerations(machine), part.share,
    )  # fmt: skip
    reasons = [[why(part, int(r)) if r >= 0 else "" for r in pair] for pair in row]
    return speed / full[:, None], reasons


def why(part: Approach, row: int) -> str:
    """The two bodies of a row and what is left between them."""
    own, other = part.own[part.index[row, 0]], part.others[part.index[row, 1]]
    left = max(float(part.room[row]), 0.0)
    return f"{own} must stop before {other}: {left:.2f} m left"


def ends(machine: Machine, q: Array, T: Array) -> Array:
    """(n, 2) fraction of full speed that still stops before a joint's end.

    q: (n,) [rad]; T: (n,) total delay [s].
    """
    left = np.stack([q - machine.lower, machine.upper - q], axis=1) - CUSHION
    a, full = machine.max_acceleration[:, None], machine.max_velocity[:, None]
    speed = np.where(np.isfinite(left), braking_speed(np.minimum(left, 100.0), T[:, None], a), full)
    return np.asarray(np.minimum(speed / full, 1.0))


def at_once(machine: Machine, wish: Array, found: Limits) -> tuple[Array, dict[int, Cause]]:
    """What is left of `wish` (m,) [rad/s, m/s] when all its motions happen together, and the
    causes of those that were cut.
    """
    speed, causes = wish, {}
    for name, part, T in found.parts:
        speed, row = limit_kernels.together(
            speed, part.room, part.slope, part.bend, part.closing, part.rates, T,
            accelerations(machine), part.share,
        )  # fmt: skip
        causes.update({k: Cause(name, why(part, int(r))) for k, r in enumerate(row) if r >= 0})
    return speed, causes
