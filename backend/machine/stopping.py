"""How far a joint still moves after a stop is asked for."""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine
from backend.spatial.types import Array


def stopping_distances(machine: Machine, rates: Array, latency: float) -> Array:
    """(n,) signed [rad]: |v| latency + v^2 / (2 a), in the direction of v.

    rates: (n,) joint rates v [rad/s]; a: the joint's largest acceleration [rad/s^2]; latency: from
    asking to the first braking [s]. A rate that is not known gives NaN.
    """
    v = np.asarray(rates, dtype=float)
    a = machine.max_acceleration
    return np.asarray(np.sign(v) * (np.abs(v) * latency + v**2 / (2.0 * a)))


def full_stopping_distances(machine: Machine, latency: float) -> Array:
    """(n,) the same at every joint's full rate [rad]."""
    return stopping_distances(machine, machine.max_velocity, latency)
