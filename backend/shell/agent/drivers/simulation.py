"""A simulated machine behind the driver's interface, in the time of the clock it is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from backend.machine.model import Machine
from backend.shell.agent.drivers.driver import Reading
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, standstill, step
from backend.shell.sim.postures import middle
from backend.spatial.types import Array

DT = 0.005  # [s]
LONGEST = 1.0  # of a stalled host that is made up for [s]


class SimDriver:
    """The dynamics of `backend.shell.sim`. q: (n,) joint values at the start [rad]."""

    def __init__(
        self, machine: Machine, clock: Callable[[], float], q: Array | None = None
    ) -> None:
        self._machine = machine
        self._clock = clock
        self._limits, self._lags = limits_of(machine), Hydraulics()
        start = middle(machine) if q is None else np.asarray(q, dtype=float)
        nothing = np.zeros(len(start))
        self.state = SimState(start, nothing, np.zeros(3), 0.0, 0.0, 0.0, np.zeros(2))
        self._demand = standstill(machine)
        self._time = clock()

    def read(self) -> Reading:
        self._advance()
        return Reading(self.state.q, self.state.qd, self._time)

    def write(self, joints: Array, tracks: Array) -> None:
        self._advance()
        self._demand = Demand(np.array(joints, dtype=float), np.array(tracks, dtype=float))

    def stop(self) -> None:
        self._advance()
        self._demand = standstill(self._machine)

    def close(self) -> None:
        self.stop()
        still = standstill(self._machine)
        self.state = replace(self.state, qd=still.joints, travel=still.travel)

    def _advance(self) -> None:
        now = self._clock()
        self._time = max(self._time, now - LONGEST)
        while self._time + DT <= now:
            self._time += DT
            self.state = step(self.state, self._demand, self._limits, self._lags, DT)
