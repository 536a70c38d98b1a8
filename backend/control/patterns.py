"""Sticks to joint velocities: ISO 10968's pattern and SAE's, which swaps boom and stick.

    ISO   left: sideways swing, forwards stick out      right: forwards boom down, sideways bucket
    SAE   left: sideways swing, forwards boom down      right: forwards stick out, sideways bucket

To the left swings left and curls the bucket; to the right swings right and dumps it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from backend.machine.model import Machine
from backend.spatial.types import Array

DEAD_ZONE = 0.08
"""Deflection that counts as neutral; beyond it the rest is stretched to 0..1."""
FINE = 0.3
"""Share of full speed in fine mode."""


class Pattern(Enum):
    ISO = "ISO"
    SAE = "SAE"


class Method(Enum):
    """What shapes the wish before the limiter: nothing, or one of Mäkinen's ways in `planning`."""

    BRAKING = "braking"
    SCALING = "scaling"
    POTENTIAL = "potential"
    CONSTRAINED = "constrained"


@dataclass(frozen=True)
class Sticks:
    """Deflections in -1..1: x to the right, y forwards; pedals: of the left and right track."""

    left_x: float = 0.0
    left_y: float = 0.0
    right_x: float = 0.0
    right_y: float = 0.0
    track_left: float = 0.0
    track_right: float = 0.0


@dataclass(frozen=True)
class Setting:
    """How the sticks are read. fine: at `FINE` of full speed; method: near limits."""

    pattern: Pattern = Pattern.ISO
    fine: bool = False
    method: Method = Method.BRAKING


def deflection(value: float) -> float:
    """-1..1 past the dead zone, 0 within it and for what is not a number."""
    if not abs(value) > DEAD_ZONE:
        return 0.0
    past = (min(abs(value), 1.0) - DEAD_ZONE) / (1.0 - DEAD_ZONE)
    return past if value > 0.0 else -past


def neutral(sticks: Sticks) -> bool:
    """Whether every stick is within its dead zone; a value that is not a number is not neutral."""
    return all(abs(value) <= DEAD_ZONE for value in vars(sticks).values())


def with_pattern(setting: Setting, pattern: Pattern, sticks: Sticks) -> Setting:
    """The setting after the operator chose a pattern: only in neutral, else unchanged."""
    return replace(setting, pattern=pattern) if neutral(sticks) else setting


def with_method(setting: Setting, method: Method, sticks: Sticks) -> Setting:
    """The setting after the operator chose a method: only in neutral, else unchanged."""
    return replace(setting, method=method) if neutral(sticks) else setting


def velocities(machine: Machine, sticks: Sticks, setting: Setting) -> tuple[Array, Array]:
    """(joints (n,) [rad/s], tracks (2,) [m/s]) that the sticks ask for, by the machine's signs."""
    left_y, right_y = deflection(sticks.left_y), deflection(sticks.right_y)
    out, down = (left_y, right_y) if setting.pattern is Pattern.ISO else (right_y, left_y)
    # Sun 2020, Fig. 2: positive raises; the sidecar's signs turn that into the joint's own.
    raising = {
        "swing": -deflection(sticks.left_x) * machine.sun.azimuth_sign,
        "boom": -down * machine.sun.signs[0],
        "stick": out * machine.sun.signs[1],
        "bucket": deflection(sticks.right_x) * machine.sun.signs[2],
    }
    share = FINE if setting.fine else 1.0
    joints = np.array([raising.get(joint.role, 0.0) for joint in machine.joints])
    tracks = np.array([deflection(sticks.track_left), deflection(sticks.track_right)])
    return share * joints * machine.max_velocity, share * tracks * machine.tracks.max_speed
