"""The agent: obeys fresh commands only, stops by itself, finds back to the schedule."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from backend.control.lease import Kind, Request
from backend.machine.load import load_machine
from backend.shell.agent.gate import TIME_TO_LIVE, hear, hear_limits, names_of, negotiate
from backend.shell.link.messages import Command, MotionLimits
from backend.shell.sim.agent import RESUME_AFTER, Mode, act, fresh
from backend.shell.sim.dynamics import Hydraulics, limits_of, step
from backend.shell.sim.program import reference
from backend.shell.sim.program_file import load_program
from backend.shell.sim.simulate import on_schedule
from backend.site.site import load_site

MACHINE = load_machine("mini")
SITE = load_site("demo")
LEFT = load_program(MACHINE, SITE, "left")
HOLD = replace(LEFT, script=(), cycle=(), script_length=0.0)
LIMITS, LAGS = limits_of(MACHINE), Hydraulics()
DT = 0.01


ONES = np.ones(6)


def limits(sequence=1, token=1):
    """Every motion free."""
    return MotionLimits("left", 0.0, 0.0, sequence, 0.2, token, names_of(MACHINE), ONES, ONES)


def leased(agent, now=0.0):
    """The agent after "ann" asked for its lease, or refreshed it."""
    lease = agent.gate.lease
    kind = Kind.REFRESH if lease.held(now) else Kind.REQUEST
    gate, answer = negotiate(agent.gate, Request(kind, "ann", token=lease.token), now)
    assert answer.granted
    return replace(agent, gate=gate)


def commanded(agent, said, now):
    """The agent after a command and fresh limits with the same token."""
    gate = hear(agent.gate, said, MACHINE, now)
    free = limits(1 + (gate.limits.sequence if gate.limits else 0), said.token)
    return replace(agent, gate=hear_limits(gate, free, MACHINE, now))


def command(sequence=1, token=1, velocity=(0.2,), names=("swing",), ttl=0.2, travel=(0.0, 0.0)):
    return Command(
        "left", 0.0, 0.0, sequence, ttl, "ann", token, names, np.array(velocity), *travel
    )


class Run:
    """A machine with its agent in simulated time."""

    def __init__(self, program, t=0.0):
        self.program, self.t = program, t
        self.agent = fresh(program)
        self.state = on_schedule(program, t, np.zeros(3), 0.0, 0.0, 0.0)
        self.worst_jump = 0.0

    def until(self, t, commands=None):
        while self.t < t - 1e-9:
            self.t += DT
            if commands:
                self.agent = leased(self.agent, self.t)
                said = replace(commands(self.t), token=self.agent.gate.lease.token)
                self.agent = commanded(self.agent, said, self.t)
            before = self.state.qd
            self.agent, state, demand = act(self.agent, self.program, LAGS, self.state, self.t, DT)
            self.state = step(state, demand, LIMITS, LAGS, DT)
            self.worst_jump = max(self.worst_jump, float(np.abs(self.state.qd - before).max()))
        return self


def steady(velocity=0.2):
    count = iter(range(1, 10**6))
    return lambda t: command(next(count), velocity=(velocity,))


def test_command_pauses_the_program_and_silence_stops_the_machine():
    run = Run(LEFT).until(2.0)
    assert run.agent.mode is Mode.PROGRAM
    run.until(4.0, steady(0.3))
    assert run.agent.mode is Mode.REMOTE
    assert run.state.qd[0] == pytest.approx(0.3, abs=1e-3)
    np.testing.assert_allclose(run.state.qd[1:], 0.0, atol=1e-3)
    run.until(4.0 + TIME_TO_LIVE + 2 * DT)
    assert run.agent.mode is Mode.STOPPED
    run.until(5.0)
    np.testing.assert_allclose(run.state.qd, 0.0, atol=1e-3)
    here = run.state.q.copy()
    run.until(4.0 + RESUME_AFTER - 0.1)
    np.testing.assert_allclose(run.state.q, here, atol=1e-3)


def test_it_rejoins_the_schedule_smoothly():
    run = Run(LEFT).until(3.0).until(6.0, steady(0.4)).until(70.0)
    assert run.agent.mode is Mode.PROGRAM
    np.testing.assert_allclose(run.state.q, reference(LEFT, run.t)[0], atol=math.radians(0.5))
    assert run.worst_jump <= LIMITS.acceleration.max() * DT + 1e-9


def test_after_a_stop_it_stands_until_it_was_leased_again():
    run = Run(LEFT).until(3.0).until(4.0, steady(0.4))
    gate, answer = negotiate(run.agent.gate, Request(Kind.STOP, "vic", "viewer"), run.t)
    assert answer.granted
    run.agent = replace(run.agent, gate=gate)
    run.until(4.5)
    here = run.state.q.copy()
    run.until(30.0)
    assert run.agent.mode is Mode.STOPPED
    np.testing.assert_allclose(run.state.q, here, atol=5e-3)
    run.until(31.0, steady(0.4)).until(100.0)
    assert run.agent.mode is Mode.PROGRAM


def test_it_rejoins_after_whole_turns():
    """Swung around twice, the machine does not unwind: it finds the nearest turn."""
    run = Run(LEFT).until(1.0).until(16.0, steady(0.9))
    assert run.state.q[0] > LEFT.home[0] + 2 * math.pi
    way = 0.0
    while run.t < 100.0:
        before = run.state.q[0]
        run.until(run.t + DT)
        moved = run.state.q[0] - before
        way += abs(math.remainder(moved, 2 * math.pi)) if run.t < 60.0 else 0.0
    assert way < 1.5 * math.pi
    assert run.agent.mode is Mode.PROGRAM


def test_a_machine_without_a_program_stays_where_it_was_left():
    run = Run(HOLD).until(1.0)
    np.testing.assert_array_equal(run.state.q, HOLD.start)
    run.until(3.0, steady(0.3)).until(30.0)
    assert run.agent.mode is Mode.HOLD
    assert run.state.q[0] - HOLD.start[0] > 0.4
    np.testing.assert_allclose(run.state.qd, 0.0, atol=1e-9)


def test_a_long_time_to_live_is_cut_to_the_machines_own():
    agent = commanded(leased(fresh(LEFT)), command(ttl=60.0), 0.0)
    state = on_schedule(LEFT, 0.0, np.zeros(3), 0.0, 0.0, 0.0)
    agent = act(agent, LEFT, LAGS, state, 0.19, DT)[0]
    assert agent.mode is Mode.REMOTE
    agent, _, demand = act(agent, LEFT, LAGS, state, 0.21, DT)
    assert agent.mode is Mode.STOPPED
    np.testing.assert_array_equal(demand.joints, 0.0)
    np.testing.assert_array_equal(demand.travel, 0.0)


def test_urdf_names_and_travel_are_obeyed():
    names = tuple(joint.name for joint in MACHINE.joints)
    said = command(velocity=(0.1, 0.2, -0.3, 0.4), names=names, travel=(0.2, -0.2))
    agent = commanded(leased(fresh(LEFT)), said, 0.0)
    state = on_schedule(LEFT, 0.0, np.zeros(3), 0.0, 0.0, 0.0)
    _, _, demand = act(agent, LEFT, LAGS, state, 0.1, 10.0)
    np.testing.assert_array_equal(demand.joints, [0.1, 0.2, -0.3, 0.4])
    np.testing.assert_array_equal(demand.travel, [0.2, -0.2])


def test_without_a_lease_the_program_goes_on():
    """Strangers' commands do not even interrupt it."""
    run = Run(LEFT).until(2.0)
    before = run.agent
    run.agent = commanded(run.agent, command(token=0), run.t)
    run.until(3.0)
    assert run.agent.mode is Mode.PROGRAM
    assert run.agent.gate.refused == before.gate.refused + 2  # the command and its limits
