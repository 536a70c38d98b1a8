"""One simulated machine as a process on the wire, in real time."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from backend.control.lease import fresh as no_lease
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.shell.agent.status import status_of
from backend.shell.agent.wire import Ear
from backend.shell.link.encode import encode_clock, encode_status, encode_truth
from backend.shell.link.messages import TrueState
from backend.shell.link.session import open_session, publisher
from backend.shell.link.topics import key, topic
from backend.shell.sim.agent import act, fresh
from backend.shell.sim.camera import CabCamera
from backend.shell.sim.dynamics import Hydraulics, SimState, limits_of, step
from backend.shell.sim.program import Program, is_cut
from backend.shell.sim.program_file import load_program
from backend.shell.sim.radio import OnAir, Radio, receive, send
from backend.shell.sim.sensors import Sensor, sensors
from backend.shell.sim.simulate import on_schedule
from backend.shell.sim.tipping import TIPPING, TOLD, UPRIGHT, leaned, stance_of, tip
from backend.shell.sim.turning import TurningLidars
from backend.site.site import Site

LONGEST_STEP = 0.005  # [s]
CATCH_UP = 2.0  # [s] of a stalled host that are made up for; the rest is left out
STATUS_PERIOD = 0.1  # [s]
TRUTH_PERIOD = 0.02  # [s]
TIP_PERIOD = 0.02  # [s]


def run(
    site: Site,
    name: str,
    connect: tuple[str, ...],
    start_at: float | None,
    until: threading.Event,
    skew: float = 0.0,
    link_config: Path | None = None,
) -> None:
    """Simulates the machine `name` of the site until `until` is set.

    connect: Zenoh endpoints, which may come and go. start_at: epoch [s] of the schedule's time 0,
    the same for all machines; now when None. skew: of the machine's clock against this computer's
    [s]. link_config: a Zenoh configuration file. Raises InputError for a bad site, machine or
    endpoint.
    """
    entry = site.machine(name)
    sidecar = None if entry.sidecar is None else site.folder / entry.sidecar
    machine = load_machine(entry.model, sidecar, site.folder)
    program = load_program(machine, site, name)
    session = open_session(connect=connect, config_file=link_config)
    try:
        began = time.time() if start_at is None else start_at

        def beside() -> Any:
            return open_session(connect=connect, mode="client", config_file=link_config)

        run_machine(site, name, machine, program, session, began, until, skew, beside)
    finally:
        session.close()


@dataclass
class _Wire:
    """Publishers by topic name, and the radio's messages; now: the newest state and its stamp."""

    outlets: dict[str, Any]
    radio: Radio
    on_air: tuple[OnAir[tuple[str, bytes]], ...] = ()
    cut: bool = False
    now: tuple[SimState, float] | None = None


def run_machine(
    site: Site,
    name: str,
    machine: Machine,
    program: Program,
    session: Any,
    start_at: float,
    until: threading.Event,
    skew: float = 0.0,
    beside: Callable[[], Any] | None = None,
) -> None:
    """The real-time loop on an open session; returns when `until` is set. beside: opens another
    session, for the machine's camera and for its LiDARs, on which they hear of other machines."""
    # The computer's clock is read once: later corrections of it must not make time jump here.
    epoch = time.time() - time.monotonic()
    prefix = site.machine(name).prefix
    rig = sensors(machine, site, site.machine(name).sim.joints)
    wire = _Wire(
        {
            **{s.topic: publisher(session, s.topic, prefix, **s.fields) for s in rig},
            "status": publisher(session, "status", prefix),
            "truth": publisher(session, "truth", prefix),
        },
        Radio(site.sim.radio_period, site.sim.latency),
    )
    clock_key = key("clock", prefix)

    def on_clock(query: Any) -> None:
        with query:
            if not wire.cut:
                now = time.monotonic() + epoch + skew
                query.reply(clock_key, encode_clock(now), express=topic("clock").express)

    def on_schedule_time() -> float:
        return time.monotonic() + epoch - start_at

    def schedule(stamp: float) -> float:
        return stamp - skew - start_at

    answering = session.declare_queryable(clock_key, on_clock)
    # Milliseconds since the epoch: a machine that is started again never issues a token twice.
    first = no_lease(int(1e3 * time.time()))
    ear = Ear(session, prefix, first, on_schedule_time, lambda: wire.cut)
    mine = session, site, name, machine
    camera = CabCamera(*mine, lambda: wire.now, lambda: wire.cut, beside, schedule)
    lidars = TurningLidars(*mine, lambda: wire.now, lambda: wire.cut, schedule, beside)
    try:
        _loop(site, name, machine, program, rig, wire, ear, epoch, start_at, until, skew)
    finally:
        lidars.close()
        camera.close()
        ear.close()
        for declared in (answering, *wire.outlets.values()):
            declared.undeclare()


def _loop(
    site: Site,
    name: str,
    machine: Machine,
    program: Program,
    rig: tuple[Sensor, ...],
    wire: _Wire,
    ear: Ear,
    epoch: float,
    start_at: float,
    until: threading.Event,
    skew: float,
) -> None:
    start = site.machine(name).start
    position = site.frame.from_projected(
        np.array(start.position if start else site.frame.to_projected(np.zeros(3)))
    )
    agent = fresh(program)
    limits, hydraulics = limits_of(machine), Hydraulics()
    rng = np.random.default_rng((program.seed, 1))
    dt = min(LONGEST_STEP, site.sim.joint_period)
    t = time.monotonic() + epoch  # machine's time without skew; advances by whole steps
    due = [t] * len(rig)
    status_due = truth_due = t
    attitude = start.attitude if start else (0.0, 0.0, 0.0)
    state = on_schedule(program, t - start_at, position, *attitude)
    carried = site.machine(name).payload or 0.0
    grounded = None
    if site.machine(name).sim.ground == "contact":
        # MuJoCo is loaded only where something stands on real ground.
        from backend.shell.sim.grounded import Grounded

        grounded = Grounded(machine, carried, site.obstacle_boxes(), state, dt)
    stance, lean = stance_of(machine, carried) if grounded is None else None, UPRIGHT
    shown, judged, judged_at = state, state, t
    while not until.is_set():
        now = time.monotonic() + epoch
        if now - t > CATCH_UP:
            t = now - CATCH_UP
            due = [max(d, t) for d in due]
            status_due, truth_due = max(status_due, t), max(truth_due, t)
        wire.cut = is_cut(program, now - start_at)
        agent = replace(agent, gate=ear.hear(agent.gate, name, machine))
        while t + dt <= now:
            t += dt
            agent, before, demand = act(agent, program, hydraulics, state, t - start_at, dt)
            state = shown = step(before, demand, limits, hydraulics, dt)
            if grounded is not None:
                state = grounded.relieved(state)
                shown = grounded.step(state)
            if stance is not None:
                if t >= judged_at + TIP_PERIOD - 1e-6:
                    lean = tip(lean, judged, state, stance, t - judged_at)
                    judged, judged_at = state, t
                shown = leaned(state, lean, stance)
            if t >= truth_due - 1e-6:  # no radio: partners' cameras go on seeing the machine
                truth = _truth(machine, site, name, shown, t + skew)
                wire.outlets["truth"].put(encode_truth(truth))
                truth_due += TRUTH_PERIOD
            if is_cut(program, t - start_at):
                wire.on_air = ()
                due = [max(d, t) for d in due]
                continue
            for i, sensor in enumerate(rig):
                if t >= due[i] - 1e-6:
                    message = sensor.topic, sensor.measure(shown, t + skew, rng)
                    wire.on_air = send(wire.on_air, t, message, wire.radio)
                    due[i] = max(due[i] + sensor.period, t - sensor.period)
            if t >= status_due - 1e-6:
                tips = lean.angle > TOLD or (grounded is not None and grounded.over)
                mode = TIPPING if tips else agent.mode.value
                report = status_of(agent.gate, name, mode, t + skew, t - start_at)
                status = encode_status(report)
                wire.on_air = send(wire.on_air, t, ("status", status), wire.radio)
                status_due += STATUS_PERIOD
        wire.now = shown, t + skew
        arrived, wire.on_air = receive(wire.on_air, now)
        for outlet, payload in arrived:
            wire.outlets[outlet].put(payload)
        until.wait(max(0.0005, t + dt - (time.monotonic() + epoch)))


def _truth(machine: Machine, site: Site, name: str, state: SimState, stamp: float) -> TrueState:
    return TrueState(
        machine=name,
        stamp=stamp,
        arrival=stamp,
        names=tuple(joint.name for joint in machine.joints),
        position=state.q,
        velocity=state.qd,
        base=site.frame.to_projected(state.position),
        yaw=math.remainder(state.yaw, 2.0 * math.pi),
        pitch=state.pitch,
        roll=state.roll,
        travel_left=float(state.travel[0]),
        travel_right=float(state.travel[1]),
    )
