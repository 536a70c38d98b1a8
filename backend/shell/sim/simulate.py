"""Machines in simulated time: the same programs and dynamics without a clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.shell.sim.program import Program, reference
from backend.spatial.types import Array

GAIN = 3.0  # [1/s] how fast a joint returns to its reference


@dataclass(frozen=True)
class Trajectory:
    """times: (k,) [s]; q: (k, n) [rad]; qd: (k, n) [rad/s]."""

    times: Array
    q: Array
    qd: Array


def follow(program: Program, hydraulics: Hydraulics, t: float, q: Array) -> Demand:
    """Velocities that keep the joints q (n,) on the program's reference at t [s].

    The reference's acceleration makes up for the lag, so that the machine is not behind.
    """
    q_ref, qd_ref, qdd_ref = reference(program, t)
    joints = qd_ref + hydraulics.joint_lag * qdd_ref + GAIN * (q_ref - q)
    return Demand(joints, np.zeros(2))


def at_start(program: Program, position: Array, yaw: float, pitch: float, roll: float) -> SimState:
    """The machine at rest in the program's start posture; position: (3,) site frame [m]."""
    n = len(program.start)
    return SimState(program.start, np.zeros(n), position, yaw, pitch, roll, np.zeros(2))


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
    state = at_start(program, np.zeros(3), 0.0, 0.0, 0.0)
    times: Array = np.arange(round(duration / dt) + 1) * np.float64(dt)
    q = np.empty((len(times), len(program.start)))
    qd = np.empty_like(q)
    q[0], qd[0] = state.q, state.qd
    for i, t in enumerate(times[:-1]):
        state = step(state, follow(program, lags, float(t), state.q), limits, lags, dt)
        q[i + 1], qd[i + 1] = state.q, state.qd
    return Trajectory(times, q, qd)
