"""A simulated machine's agent: it obeys through the gate of every agent, and has a program.

Between commands it stands; some time after the last one it finds back to its program, but not
after somebody pressed stop: then only when the machine was leased again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from backend.shell.agent.gate import Gate, demand
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, standstill
from backend.shell.sim.motion import Motion, at, path_through, shortest
from backend.shell.sim.program import Program, entry_posture, next_entry, reference
from backend.spatial.types import Array

RESUME_AFTER = 5.0
"""Standstill between the last command and the way back to the program [s]."""
GAIN = 3.0
"""How fast a joint returns to its reference [1/s]."""
ASTRAY = math.radians(15.0)
"""A machine this far from its program's reference rejoins it instead of hurrying after it."""
REJOIN_PACE = 1.5
"""Moves back to the program take this much longer than they could."""


class Mode(Enum):
    """PROGRAM: on the schedule. REMOTE: obeys a command. STOPPED: commands ceased. REJOINING: on
    the way back to the schedule. HOLD: stands where it is, with no program to go back to.
    """

    PROGRAM = "program"
    REMOTE = "remote"
    STOPPED = "stopped"
    REJOINING = "rejoining"
    HOLD = "hold"


@dataclass(frozen=True)
class Rejoin:
    """Motions on schedule time, then the wait for `entry` [s on the schedule]."""

    motions: tuple[Motion, ...]
    entry: float


@dataclass(frozen=True)
class Agent:
    """gate: what it obeys; asked: of the machine at the last step, (joints, tracks), None when it
    was not commanded then.
    """

    mode: Mode
    gate: Gate = field(default_factory=Gate)
    rejoin: Rejoin | None = None
    asked: Demand | None = None


def fresh(program: Program) -> Agent:
    """The agent of a machine that was just switched on."""
    return Agent(Mode.PROGRAM if program.script or program.cycle else Mode.HOLD)


def act(
    agent: Agent,
    program: Program,
    hydraulics: Hydraulics,
    state: SimState,
    now: float,
    dt: float,
) -> tuple[Agent, SimState, Demand]:
    """What the machine is asked to do at `now` [s on the schedule], dt [s] after the last time.

    The state comes back with the swing counted from another turn when the way back needs it, which
    moves nothing.
    """
    gate = agent.gate
    if gate.obeys(now):
        before = agent.asked or Demand(state.qd, state.travel)
        asked = Demand(*demand(gate, program.machine, (before.joints, before.travel), now, dt))
        return replace(agent, mode=Mode.REMOTE, rejoin=None, asked=asked), state, asked
    if agent.mode is Mode.REMOTE:
        agent = replace(agent, mode=Mode.STOPPED, asked=None)
    rested = now - gate.heard_at >= RESUME_AFTER and not gate.lease.stopped_by
    if agent.mode is Mode.STOPPED and rested:
        has_program = bool(program.script or program.cycle)
        agent = replace(agent, mode=Mode.REJOINING if has_program else Mode.HOLD)
    if agent.mode in (Mode.STOPPED, Mode.HOLD):
        return agent, state, standstill(program.machine)
    if agent.mode is Mode.PROGRAM:
        wanted = reference(program, now)
        if np.abs(wanted[0] - state.q).max() < ASTRAY:
            return agent, state, Demand(follow(wanted, state.q, hydraulics), np.zeros(2))
        agent = replace(agent, mode=Mode.REJOINING, rejoin=None)
    rejoin = agent.rejoin
    if rejoin is None:
        state = _unwound(state, program)
        rejoin = way_back(program, state.q, now)
        agent = replace(agent, rejoin=rejoin)
    if now >= rejoin.entry:
        agent = replace(agent, mode=Mode.PROGRAM, rejoin=None)
        wanted = reference(program, now)
    else:
        wanted = _on_the_way(rejoin, now)
    return agent, state, Demand(follow(wanted, state.q, hydraulics), np.zeros(2))


def follow(wanted: tuple[Array, Array, Array], q: Array, hydraulics: Hydraulics) -> Array:
    """Joint velocities (n,) [rad/s] that keep q on the reference (q, qd, qdd).

    The reference's acceleration makes up for the lag, so that the machine is not behind.
    """
    q_ref, qd_ref, qdd_ref = wanted
    return np.asarray(qd_ref + hydraulics.joint_lag * qdd_ref + GAIN * (q_ref - q))


def way_back(program: Program, q: Array, now: float) -> Rejoin:
    """From rest at q (n,): first the arm as at home, then the swing, then wait for the entry."""
    home = entry_posture(program)
    raised = home.copy()
    raised[0] = q[0]
    made: list[Motion] = []
    t = now
    for begin, end in ((q, raised), (raised, home)):
        path = path_through(np.stack([begin, end]), program.limits)
        made.append(Motion(t, REJOIN_PACE * shortest(path, program.limits), path))
        t = made[-1].end
    return Rejoin(tuple(made), next_entry(program, t))


def _on_the_way(rejoin: Rejoin, now: float) -> tuple[Array, Array, Array]:
    begun = [motion for motion in rejoin.motions if motion.start <= now]
    return at(begun[-1] if begun else rejoin.motions[0], now)


def _unwound(state: SimState, program: Program) -> SimState:
    """The same posture with a continuous swing counted from the turn nearest to home."""
    if not program.machine.joints[0].continuous:
        return state
    turns = round(float(state.q[0] - program.home[0]) / (2.0 * math.pi))
    q = state.q.copy()
    q[0] -= 2.0 * math.pi * turns
    return replace(state, q=q)
