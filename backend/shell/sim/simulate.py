"""Machines in simulated time: the same programs and dynamics without a clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.shell.sim.agent import follow
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.shell.sim.program import Program, reference
from backend.spatial.types import Array


@dataclass(frozen=True)
class Trajectory:
    """times: (k,) [s]; q: (k, n) [rad]; qd: (k, n) [rad/s]."""

    times: Array
    q: Array
    qd: Array


def on_schedule(
    program: Program, t: float, position: Array, yaw: float, pitch: float, roll: float
) -> SimState:
    """The machine where its program has it at t [s]; position: (3,) of the root, site frame [m].

    A machine that is switched on late appears there, so that it is in step with the others.
    """
    q, qd, _ = reference(program, t)
    return SimState(q, qd, position, yaw, pitch, roll, np.zeros(2))


def simulate(
    machine: Machine,
    program: Program,
    duration: float,
    dt: float = 0.005,
    hydraulics: Hydraulics | None = None,
) -> Trajectory:
    """The joints of a machine that runs its program from time 0, every dt [s]."""
    lags = hydraulics or Hydraulics()
    limits = limits_of(machine)
    state = on_schedule(program, 0.0, np.zeros(3), 0.0, 0.0, 0.0)
    times: Array = np.arange(round(duration / dt) + 1) * np.float64(dt)
    q = np.empty((len(times), len(program.start)))
    qd = np.empty_like(q)
    q[0], qd[0] = state.q, state.qd
    for i, t in enumerate(times[:-1]):
        joints = follow(reference(program, float(t)), state.q, lags)
        state = step(state, Demand(joints, np.zeros(2)), limits, lags, dt)
        q[i + 1], qd[i + 1] = state.q, state.qd
    return Trajectory(times, q, qd)
