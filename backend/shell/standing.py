"""Whether a machine is still where it stood when something was planned for it."""

from __future__ import annotations

import math

import numpy as np

from backend.machine.model import Machine
from backend.spatial.angles import wrap
from backend.spatial.types import Array

DRIVEN = 0.15
"""A machine whose base moved farther than this [m], or turned by more than TURNED [rad], since is
somewhere else.
"""
TURNED = math.radians(1.5)


def elsewhere(T_then: Array, T_now: Array, driven: float = DRIVEN) -> str:
    """How far the base moved since, in words; empty while it stands where it stood."""
    moved = float(np.linalg.norm(T_now[:3, 3] - T_then[:3, 3]))
    if moved > driven:
        return f"the machine's base moved by {moved:.2f} m"
    cosine = 0.5 * (float(np.trace(T_then[:3, :3].T @ T_now[:3, :3])) - 1.0)
    turned = math.acos(min(max(cosine, -1.0), 1.0))
    return f"the base turned by {math.degrees(turned):.1f} degrees" if turned > TURNED else ""


def off_by(machine: Machine, q: Array, start: Array) -> float:
    """The largest difference of a joint [rad]; those without ends modulo a turn."""
    off = q - start
    off = np.where([joint.continuous for joint in machine.joints], wrap(off), off)
    return float(np.abs(off).max())
