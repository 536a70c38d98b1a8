"""Careless drives in simulated time: random sticks at full speed, two machines within reach.

Everything between the sticks and the machine is what the live cockpit runs: sensors with noise, the
radio, the codec, `pipeline.step`, the limiter, the agent's gate. Only the clock is simulated, and
python-fcl judges the true poses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from backend.collision.verdict import contact
from backend.control.lease import Kind, Request
from backend.control.patterns import Setting, Sticks, velocities
from backend.fusion.pose import Validity
from backend.fusion.samples import ClockSample, Sample
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.safety.limiter import Decision, Latch, Wish, limit, open_latch
from backend.safety.limits import Delay
from backend.safety.partner import Limits as Band
from backend.shell.agent.gate import Gate, demand, hear, hear_limits, names_of, negotiate
from backend.shell.link.codec import decode
from backend.shell.link.messages import AgentStatus, Command, MotionLimits, TrueState
from backend.shell.link.topics import key
from backend.shell.sim import dynamics
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState
from backend.shell.sim.radio import OnAir, Radio, receive, send
from backend.shell.sim.sensors import Sensor, sensors
from backend.site.site import Site, load_site
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

DT = 0.01  # of the simulated machines [s]
CYCLE = 0.02  # of the backend [s]
NAMES = ("a", "b")
SETTLE = 1.0  # before the sticks move [s]
CLEAR_AT_START = 0.6  # [m]


@dataclass(frozen=True)
class Drive:
    """One drive. models: of both machines; limited: whether the limiter is in between; up, down:
    one-way delays, batching included [s]; loss: share of messages lost; seconds: at most.
    """

    seed: int
    models: tuple[str, str] = ("mini", "mini")
    limited: bool = True
    up: float = 0.1
    down: float = 0.1
    loss: float = 0.0
    seconds: float = 60.0
    shown: float = 0.1  # period of the trace [s]


@dataclass
class Outcome:
    """contact: when the machines touched [s], None for never; nearest: least lower bound of their
    distance [m]; path: (k, 2) joint travel of each machine up to each `Drive.shown` [rad]; driven:
    the same of the tracks [m]; reasons: why nothing moved, by number of cycles.
    """

    contact: float | None = None
    nearest: float = math.inf
    path: list[tuple[float, float]] = field(default_factory=list)
    driven: list[tuple[float, float]] = field(default_factory=list)
    reasons: dict[str, int] = field(default_factory=dict)


@lru_cache(maxsize=8)
def machine_of(model: str) -> Machine:
    return load_machine(model)


@dataclass
class _Machine:
    """One simulated machine with its agent and its two radios."""

    name: str
    machine: Machine
    state: SimState
    limits: dynamics.Limits
    rig: tuple[Sensor, ...]
    rng: np.random.Generator
    due: list[float]
    gate: Gate
    asked: Demand
    latch: Latch
    heard: tuple[OnAir[Command | MotionLimits], ...] = ()
    sent: tuple[OnAir[tuple[str, bytes]], ...] = ()
    sequence: int = 0
    token: int = 0
    path: float = 0.0
    driven: float = 0.0


def drive(plan: Drive, hands: Sequence[Hands] | None = None) -> Outcome:
    """Runs one drive until its end or the first contact.

    hands: of both operators, careless ones when None.
    """
    site = load_site("demo")
    site = replace(site, sim=site.sim.model_copy(update={"joint_period": DT}))
    rng = np.random.default_rng((plan.seed, 7))
    machines = [machine_of(model) for model in plan.models]
    states = _placed(machines, rng)
    fleet = [
        _machine(name, machine, state, site, plan.seed)
        for name, machine, state in zip(NAMES, machines, states, strict=True)
    ]
    config = Config(
        frame=site.frame,
        machines=dict(zip(NAMES, machines, strict=True)),
        labels={"a": "A", "b": "B"},
        own=NAMES,
        limits=Band(site.safety.slow_below, site.safety.stop_below),
        eta=site.safety.eta,
        mode="DEMO",
        margins=False,
        drive=plan.limited,
    )
    radios = Radio(site.sim.radio_period, plan.down), Radio(site.sim.radio_period, plan.up)
    sticks = hands or [Careless(np.random.default_rng((plan.seed, k))) for k in range(2)]
    outcome, pipeline = Outcome(), initial(config)
    fastest = sum(_fastest(m) for m in machines)
    safe_until = clock_due = shown_due = cycle_due = 0.0
    samples: list[Sample] = []
    for tick in range(1, round(plan.seconds / DT) + 1):
        t = tick * DT
        for one in fleet:
            _obey(one, t)
            if plan.limited:
                samples += _report(one, t, radios[0], plan, rng)
        if plan.limited and t >= clock_due - 1e-9:
            clock_due += 0.5
            # As in the live simulation, the clock is asked past the radio.
            samples += [ClockSample(n, t - 0.002, t - 0.001, t) for n in NAMES]
        if t >= cycle_due - 1e-9:
            cycle_due += CYCLE
            snapshot = None
            if plan.limited:
                pipeline, snapshot = step(pipeline, Inputs(tuple(samples)), t, config)
                samples = []
            for one, stick in zip(fleet, sticks, strict=True):
                _command(one, stick.at(t), snapshot, t, radios[1], plan, rng, outcome)
        if t >= shown_due - 1e-9:
            shown_due += plan.shown
            outcome.path.append((fleet[0].path, fleet[1].path))
            outcome.driven.append((fleet[0].driven, fleet[1].driven))
        if t >= safe_until:
            first, second = (_bodies(m.machine, m.state) for m in fleet)
            touches, apart = contact(first, second)
            outcome.nearest = min(outcome.nearest, apart)
            if touches:
                outcome.contact = t
                break
            # Nothing touches before the machines could have come together at their fastest.
            safe_until = t + apart / fastest
    return outcome


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


def _machine(name: str, machine: Machine, state: SimState, site: Site, seed: int) -> _Machine:
    n = len(machine.joints)
    rig = sensors(machine, site)
    rng = np.random.default_rng((seed, 11, NAMES.index(name)))
    still = Demand(np.zeros(n), np.zeros(2))
    return _Machine(
        name,
        machine,
        state,
        dynamics.limits_of(machine),
        rig,
        rng,
        [0.0] * len(rig),
        Gate(),
        still,
        open_latch(machine),
    )


def _obey(one: _Machine, t: float) -> None:
    """The agent and the machine, one step of simulated time."""
    if t % 0.25 < DT:  # the lease is held throughout: what is tested here is another thing
        kind = Kind.REFRESH if one.gate.lease.held(t) else Kind.REQUEST
        one.gate, answer = negotiate(one.gate, Request(kind, one.name, token=one.token), t)
        one.token = answer.token
    arrived, one.heard = receive(one.heard, t)
    for said in arrived:
        if isinstance(said, Command):
            one.gate = hear(one.gate, said, one.machine, t)
        else:
            one.gate = hear_limits(one.gate, said, one.machine, t)
    before = one.asked.joints, one.asked.travel
    one.asked = Demand(*demand(one.gate, one.machine, before, t, DT))
    state = dynamics.step(one.state, one.asked, one.limits, HYDRAULICS, DT)
    one.path += float(np.abs(state.q - one.state.q).sum())
    one.driven += float(np.abs(0.5 * (state.travel + one.state.travel)).sum()) * DT
    one.state = state


HYDRAULICS = Hydraulics()


def _report(
    one: _Machine, t: float, radio: Radio, plan: Drive, rng: np.random.Generator
) -> list[Sample]:
    """What arrives at the cockpit at t from this machine, after what it measures was sent."""
    for k, sensor in enumerate(one.rig):
        if t >= one.due[k] - 1e-9:
            one.due[k] += sensor.period
            payload = sensor.measure(one.state, t, one.rng)
            if rng.random() >= plan.loss:
                suffix = key(sensor.topic, "", **sensor.fields).removeprefix("/")
                one.sent = send(one.sent, t, (suffix, payload), radio)
    arrived, one.sent = receive(one.sent, t)
    samples: list[Sample] = []
    for suffix, payload in arrived:
        message = decode(one.name, suffix, payload, t)
        assert not isinstance(message, Command | AgentStatus | TrueState)
        samples.append(message)
    return samples


def _command(
    one: _Machine,
    sticks: Sticks,
    snapshot: Snapshot | None,
    t: float,
    radio: Radio,
    plan: Drive,
    rng: np.random.Generator,
    outcome: Outcome,
) -> None:
    """One cycle of the operator's side: sticks to a command and motion limits, on the air.

    snapshot: None where nothing is limited.
    """
    wish = Wish(*velocities(one.machine, sticks, Setting()))
    joints, tracks, fraction = wish.joints, wish.tracks, np.ones((len(wish.joints) + 2, 2))
    if snapshot is not None:
        pose = snapshot.machines[one.name].pose
        delay = Delay(plan.up, plan.up + plan.down)
        decision = limit(
            one.name, one.machine, pose.joints, wish, snapshot.concerns, delay, one.latch, t
        )
        one.latch = decision.latch
        joints, tracks, fraction = decision.joints, decision.tracks, decision.fraction
        _count(outcome, decision, snapshot, one.name)
    one.sequence += 1
    names = tuple(joint.name for joint in one.machine.joints)
    left, right = (float(v) for v in tracks)
    stamp = one.name, t, t, one.sequence
    command = Command(*stamp, 0.2, one.name, one.token, names, joints, left, right)
    limits = MotionLimits(
        *stamp, 0.3, one.token, names_of(one.machine), fraction[:, 0], fraction[:, 1]
    )
    for said in (command, limits):
        if rng.random() >= plan.loss:
            one.heard = send(one.heard, t, said, radio)


def _count(outcome: Outcome, decision: Decision, snapshot: Snapshot, name: str) -> None:
    pose = snapshot.machines[name].pose
    reason = decision.locked
    if not reason and pose.validity is not Validity.VALID and snapshot.time > SETTLE:
        reason = "data: " + "; ".join(pose.reasons).split(" are ")[0].split(" is ")[0]
    if reason:
        outcome.reasons[reason] = outcome.reasons.get(reason, 0) + 1


def _bodies(machine: Machine, state: SimState) -> Boxes:
    return kinematics.body_boxes(
        machine, kinematics.link_poses(machine, state.q, state.T_site_root)
    )


def _fastest(machine: Machine) -> float:
    """No point of the machine is ever faster [m/s]."""
    levers = machine.stretched_levers.max(axis=0)
    tracks = machine.tracks
    turning = 2.0 * tracks.max_speed / tracks.gauge * (machine.bounding_radius + tracks.length)
    return float(levers @ machine.max_velocity) + tracks.max_speed + turning


def _placed(machines: Sequence[Machine], rng: np.random.Generator) -> list[SimState]:
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
        bodies = [_bodies(m, s) for m, s in zip(machines, states, strict=True)]
        touches, gap = contact(bodies[0], bodies[1])
        if not touches and gap >= CLEAR_AT_START:
            return states


def _somewhere(machine: Machine, position: Array, rng: np.random.Generator) -> SimState:
    low = np.where(np.isfinite(machine.lower), machine.lower, -math.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, math.pi)
    q = rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
    yaw = float(rng.uniform(-math.pi, math.pi))
    return SimState(q, np.zeros_like(q), position, yaw, 0.0, 0.0, np.zeros(2))


def twin(plan: Drive) -> Drive:
    """The same drive without the limiter."""
    return replace(plan, limited=False)
