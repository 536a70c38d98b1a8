"""Where careless drives begin, and who drives them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from backend.collision.verdict import contact
from backend.control.patterns import Sticks
from backend.machine import kinematics
from backend.machine.model import Machine
from backend.shell.sim.dynamics import SimState
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

SETTLE = 1.0  # before the sticks move [s]
CLEAR_AT_START = 0.6  # [m]


class Hands(Protocol):
    """An operator's hands."""

    def at(self, t: float) -> Sticks: ...


class Careless:
    """Sticks thrown to and fro at full deflection, each on its own.

    Pedals rest more often than sticks, so that the machines do not soon drive out of reach.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._until = np.zeros(6)
        self._value = np.zeros(6)

    def at(self, t: float) -> Sticks:
        for k in np.flatnonzero(t >= self._until):
            self._until[k] = t + 0.2 + self._rng.exponential(1.0)
            odds = [0.4, 0.2, 0.4] if k < 4 else [0.15, 0.7, 0.15]
            self._value[k] = self._rng.choice([-1.0, 0.0, 1.0], p=odds)
        return Sticks(*(float(v) for v in self._value)) if t > SETTLE else Sticks()


def bodies_of(machine: Machine, state: SimState) -> Boxes:
    """The true bodies, site frame."""
    return kinematics.body_boxes(
        machine, kinematics.link_poses(machine, state.q, state.T_site_root)
    )


def fastest(machine: Machine) -> float:
    """No point of the machine is ever faster [m/s]."""
    levers = machine.stretched_levers.max(axis=0)
    tracks = machine.tracks
    turning = 2.0 * tracks.max_speed / tracks.gauge * (machine.bounding_radius + tracks.length)
    return float(levers @ machine.max_velocity) + tracks.max_speed + turning


def placed(machines: Sequence[Machine], rng: np.random.Generator) -> list[SimState]:
    """Two machines at rest within each other's reach, `CLEAR_AT_START` apart at least."""
    reach = sum(machine.max_reach for machine in machines)
    while True:
        apart = rng.uniform(0.35, 0.65) * reach
        direction = rng.uniform(-math.pi, math.pi)
        there = apart * np.array([math.cos(direction), math.sin(direction), 0.0])
        states = [
            _somewhere(machine, position, rng)
            for machine, position in zip(machines, (np.zeros(3), there), strict=True)
        ]
        both = [bodies_of(m, s) for m, s in zip(machines, states, strict=True)]
        touches, gap = contact(both[0], both[1])
        if not touches and gap >= CLEAR_AT_START:
            return states


def _somewhere(machine: Machine, position: Array, rng: np.random.Generator) -> SimState:
    low = np.where(np.isfinite(machine.lower), machine.lower, -math.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, math.pi)
    q = rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
    yaw = float(rng.uniform(-math.pi, math.pi))
    return SimState(q, np.zeros_like(q), position, yaw, 0.0, 0.0, np.zeros(2))
