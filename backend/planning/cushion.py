"""End cushions: how fast a joint may be so that it still stops before the end of its travel."""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine
from backend.spatial.types import Array


def cushioned(machine: Machine, q: Array, dt: float) -> tuple[Array, Array]:
    """(lowest, highest) joint rates (n,) [rad/s] from which braking ends within the joints' travel.

    A rate v held for dt and then braked by a needs v dt + v^2 / (2 a); it may use what is left of
    the travel. Followed from step to step the bound never asks for more braking than a. Outside of
    its travel a joint may only go back. q: (n,) [rad].
    """
    return (
        -_fastest(machine, q - machine.lower, dt),
        _fastest(machine, machine.upper - q, dt),
    )


def rate_bounds(
    machine: Machine, q: Array, rates: Array, dt: float, accelerations: bool
) -> tuple[Array, Array]:
    """(lowest, highest) joint rates (n,) for the next dt: speed limits, end cushions and, with
    `accelerations`, what can be reached from `rates` (n,); the last wins where they contradict.
    """
    low, high = cushioned(machine, q, dt)
    if accelerations:
        step = machine.max_acceleration * dt
        low = np.clip(low, rates - step, rates + step)
        high = np.clip(high, rates - step, rates + step)
    return low, high


def _fastest(machine: Machine, left: Array, dt: float) -> Array:
    a = machine.max_acceleration
    room = np.where(np.isfinite(left), np.maximum(left, 0.0), np.inf)
    with np.errstate(invalid="ignore"):
        v = a * (np.sqrt(dt**2 + 2.0 * room / a) - dt)
    return np.asarray(np.minimum(v, machine.max_velocity))
