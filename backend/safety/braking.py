"""How fast a motion may be that must stop within a distance: v T + v^2 / (2 a) <= d.

T: total delay from measuring to the first braking [s]; a: deceleration. This is ours: Mäkinen 2021
scales by distance alone, for machines that stop at once.
"""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine
from backend.spatial.types import Array


def stopping_distance(v: Array, delay: Array | float, a: Array) -> Array:
    """|v| T + v^2 / (2 a), elementwise [rad or m]."""
    return np.asarray(np.abs(v) * delay + v**2 / (2.0 * a))


def braking_speed(distance: Array, delay: Array | float, a: Array) -> Array:
    """The greatest v with v T + v^2 / (2 a) <= distance; 0 for a distance of 0 or less."""
    d = np.maximum(distance, 0.0)
    # The larger root, written so that small distances keep their digits.
    return np.asarray(2.0 * d / np.maximum(delay + np.sqrt(delay * delay + 2.0 * d / a), 1e-300))


def accelerations(machine: Machine) -> Array:
    """(n + 2,) of the joints and of both tracks [rad/s^2, m/s^2]."""
    return np.append(machine.max_acceleration, [machine.tracks.max_acceleration] * 2)


def full_speeds(machine: Machine) -> Array:
    """(n + 2,) of the joints and of both tracks [rad/s, m/s]."""
    return np.append(machine.max_velocity, [machine.tracks.max_speed] * 2)
