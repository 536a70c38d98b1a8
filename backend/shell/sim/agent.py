"""The machine's own agent: what it obeys, when it stops, how it finds back to its program.

It obeys the newest command only while that is younger than its time-to-live, counted from arrival
on the machine's own clock; a sequence is never obeyed twice, and an older token never.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from backend.machine.model import Machine
from backend.shell.link.messages import Command
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, standstill
from backend.shell.sim.motion import Motion, at, path_through, shortest
from backend.shell.sim.program import Program, entry_posture, next_entry, reference
from backend.spatial.types import Array

TIME_TO_LIVE = 0.2
"""The longest that one command is obeyed, whatever it says [s]."""
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
    """command: the newest accepted one; heard_at: when it arrived, schedule time [s]."""

    mode: Mode
    command: Command | None = None
    heard_at: float = -math.inf
    accepted: int = 0
    refused: int = 0
    rejoin: Rejoin | None = None


def fresh(program: Program) -> Agent:
    """The agent of a machine that was just switched on."""
    return Agent(Mode.PROGRAM if program.script or program.cycle else Mode.HOLD)


def hear(agent: Agent, command: Command, machine: Machine, now: float) -> Agent:
    """The agent after a command arrived at `now` [s]; refused commands are only counted."""
    last = agent.command
    newer = (
        last is None
        or command.token > last.token
        or (command.token == last.token and command.sequence > last.sequence)
    )
    if not newer or not _sound(command, machine):
        return replace(agent, refused=agent.refused + 1)
    return replace(agent, command=command, heard_at=now, accepted=agent.accepted + 1)


def _sound(command: Command, machine: Machine) -> bool:
    known = {joint.name for joint in machine.joints} | {joint.role for joint in machine.joints}
    travel = (command.travel_left, command.travel_right)
    return (
        0.0 < command.time_to_live < math.inf
        and set(command.names) <= known
        and bool(np.isfinite(command.velocity).all())
        and all(math.isfinite(value) for value in travel)
    )


def act(
    agent: Agent, program: Program, hydraulics: Hydraulics, state: SimState, now: float
) -> tuple[Agent, SimState, Demand]:
    """What the machine is asked to do at `now` [s on the schedule].

    The state comes back with the swing counted from another turn when the way back needs it, which
    moves nothing.
    """
    command = agent.command
    if command is not None and now - agent.heard_at < min(command.time_to_live, TIME_TO_LIVE):
        agent = replace(agent, mode=Mode.REMOTE, rejoin=None)
        return agent, state, demand_of(command, program.machine)
    if agent.mode is Mode.REMOTE:
        agent = replace(agent, mode=Mode.STOPPED)
    if agent.mode is Mode.STOPPED and now - agent.heard_at >= RESUME_AFTER:
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


def demand_of(command: Command, machine: Machine) -> Demand:
    """The velocities of a command in the order of Machine.joints; joints not named stand still."""
    by_name = dict(zip(command.names, command.velocity, strict=True))
    joints = [by_name.get(j.name, by_name.get(j.role, 0.0)) for j in machine.joints]
    return Demand(np.array(joints), np.array([command.travel_left, command.travel_right]))


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
