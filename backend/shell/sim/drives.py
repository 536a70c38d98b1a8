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

import numpy as np

from backend.collision.verdict import contact
from backend.control.lease import Kind, Request
from backend.control.patterns import Setting, Sticks, velocities
from backend.fusion.pose import Validity
from backend.fusion.samples import ClockSample, Sample
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
from backend.shell.sim.careless import SETTLE, Careless, Hands, bodies_of, fastest, placed
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState
from backend.shell.sim.radio import OnAir, Radio, receive, send
from backend.shell.sim.sensors import Sensor, sensors
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.site.site import Site, load_site

DT = 0.01  # of the simulated machines [s]
CYCLE = 0.02  # of the backend [s]
NAMES = ("a", "b")


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
class Simulated:
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


def drive(
    plan: Drive,
    hands: Sequence[Hands] | None = None,
    bodies: SiteBodies = NO_SITE_BODIES,
    start: Sequence[SimState] | None = None,
) -> Outcome:
    """Runs one drive until its end or the first contact, of the machines or with the site.

    hands: of both operators, careless ones when None; bodies: what stands on the site; start: of
    both machines, somewhere within each other's reach when None.
    """
    site = load_site("demo")
    site = replace(site, sim=site.sim.model_copy(update={"joint_period": DT}))
    rng = np.random.default_rng((plan.seed, 7))
    machines = [machine_of(model) for model in plan.models]
    states = start or placed(machines, rng)
    fleet = [
        simulated(name, machine, state, site, plan.seed)
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
        site=bodies,
        margins=False,
    )
    radios = Radio(site.sim.radio_period, plan.down), Radio(site.sim.radio_period, plan.up)
    sticks = hands or [Careless(np.random.default_rng((plan.seed, k))) for k in range(2)]
    outcome, pipeline = Outcome(), initial(config)
    top_speed = sum(fastest(m) for m in machines)
    safe_until = clock_due = shown_due = cycle_due = 0.0
    samples: list[Sample] = []
    for tick in range(1, round(plan.seconds / DT) + 1):
        t = tick * DT
        for one in fleet:
            obey(one, t)
            if plan.limited:
                samples += report(one, t, radios[0], plan, rng)
        if plan.limited and t >= clock_due - 1e-9:
            clock_due += 0.5
            # As in the live simulation, the clock is asked past the radio.
            samples += [ClockSample(n, t - 0.002, t - 0.001, t) for n in NAMES]
        if t >= cycle_due - 1e-9:
            cycle_due += CYCLE
            snapshot = None
            if plan.limited:
                inputs = Inputs(tuple(samples), driven=NAMES)
                pipeline, snapshot = step(pipeline, inputs, t, config)
                samples = []
            for one, stick in zip(fleet, sticks, strict=True):
                command(one, stick.at(t), snapshot, t, radios[1], plan, rng, outcome)
        if t >= shown_due - 1e-9:
            shown_due += plan.shown
            outcome.path.append((fleet[0].path, fleet[1].path))
            outcome.driven.append((fleet[0].driven, fleet[1].driven))
        if t >= safe_until:
            first, second = (bodies_of(m.machine, m.state) for m in fleet)
            found = [
                contact(first, second),
                *(contact(one, bodies.boxes) for one in (first, second)),
            ]
            touches, apart = any(hit for hit, _ in found), min(gap for _, gap in found)
            outcome.nearest = min(outcome.nearest, apart)
            if touches:
                outcome.contact = t
                break
            # Nothing touches before the machines could have come together at their fastest.
            safe_until = t + apart / top_speed
    return outcome


def simulated(name: str, machine: Machine, state: SimState, site: Site, seed: int) -> Simulated:
    n = len(machine.joints)
    rig = sensors(machine, site)
    rng = np.random.default_rng((seed, 11, NAMES.index(name)))
    still = Demand(np.zeros(n), np.zeros(2))
    return Simulated(
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


def obey(one: Simulated, t: float) -> None:
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


def report(
    one: Simulated, t: float, radio: Radio, plan: Drive, rng: np.random.Generator
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


def command(
    one: Simulated,
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


def twin(plan: Drive) -> Drive:
    """The same drive without the limiter."""
    return replace(plan, limited=False)
