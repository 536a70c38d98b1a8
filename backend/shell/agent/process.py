"""The agent of one machine as a process on the wire, in real time.

It trusts nobody: it grants the lease, keeps to its own limits, and stands when anything that it
needs is missing: commands, motion limits, or the machine's own joint state.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from backend.control.lease import fresh
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.safety.limits import ends
from backend.shell.agent.drivers.driver import Driver, Reading
from backend.shell.agent.gate import Gate, demand
from backend.shell.agent.status import status_of
from backend.shell.agent.wire import Ear
from backend.shell.link.encode import encode_clock, encode_joint_states, encode_status
from backend.shell.link.session import open_session, publisher
from backend.shell.link.topics import key, topic
from backend.site.site import Site
from backend.spatial.types import Array

PERIOD = 0.01  # [s]
STATUS_PERIOD = 0.1  # [s]
BLIND = 0.2
"""A joint state older than this stops the machine [s]."""
LAG = 0.15
"""From asking to braking on the machine itself, for the ends of the joints' travel [s]."""


@dataclass(frozen=True)
class Stood:
    """What was asked of the machine last, and in which mode."""

    joints: Array
    tracks: Array
    mode: str  # "remote", "stopped" or "hold"


def at_rest(machine: Machine) -> Stood:
    return Stood(np.zeros(len(machine.joints)), np.zeros(2), "hold")


def decide(
    gate: Gate, machine: Machine, reading: Reading | None, last: Stood, now: float, dt: float
) -> Stood:
    """What to ask of the machine at `now` [s], dt [s] after `last`."""
    nothing = at_rest(machine)
    if reading is None or not now - reading.time <= BLIND:
        return nothing
    if not gate.obeys(now):
        mode = "hold" if last.mode == "hold" else "stopped"
        return Stood(nothing.joints, nothing.tracks, mode)
    joints, tracks = demand(gate, machine, (last.joints, last.tracks), now, dt)
    most = ends(machine, reading.q, np.full(len(joints), LAG)) * machine.max_velocity[:, None]
    return Stood(np.clip(joints, -most[:, 0], most[:, 1]), tracks, "remote")


def run(
    site: Site,
    name: str,
    connect: tuple[str, ...],
    until: threading.Event,
    make_driver: Callable[[Machine, Callable[[], float]], Driver],
    link_config: Path | None = None,
) -> None:
    """The agent of the machine `name` of the site, until `until` is set.

    make_driver: from the machine and a clock [s]; link_config: a Zenoh configuration file. Raises
    InputError for a bad site or endpoint.
    """
    entry = site.machine(name)
    sidecar = None if entry.sidecar is None else site.folder / entry.sidecar
    machine = load_machine(entry.model, sidecar, site.folder)
    driver = make_driver(machine, time.monotonic)
    try:
        session = open_session(connect=connect, config_file=link_config)
        try:
            run_agent(machine, name, entry.prefix, driver, session, until)
        finally:
            session.close()
    finally:
        driver.close()


def run_agent(
    machine: Machine,
    name: str,
    prefix: str,
    driver: Driver,
    session: Any,
    until: threading.Event,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """The real-time loop on an open session; returns when `until` is set."""
    epoch = time.time() - clock()
    clock_key = key("clock", prefix)

    def on_clock(query: Any) -> None:
        with query:
            query.reply(clock_key, encode_clock(clock() + epoch), express=topic("clock").express)

    outlets = {row: publisher(session, row, prefix) for row in ("joint_states", "status")}
    answering = session.declare_queryable(clock_key, on_clock)
    # Milliseconds since the epoch: an agent that is started again never issues a token twice.
    ear = Ear(session, prefix, fresh(int(1e3 * time.time())), clock)
    names = [joint.name for joint in machine.joints]
    gate, last, sent, status_due = Gate(), at_rest(machine), -1.0, 0.0
    before = clock()
    try:
        while not until.is_set():
            gate = ear.hear(gate, name, machine)
            reading = driver.read()
            now = clock()
            last = decide(gate, machine, reading, last, now, min(now - before, 2.0 * PERIOD))
            if last.mode == "remote":
                driver.write(last.joints, last.tracks)
            else:
                driver.stop()
            if reading is not None and reading.time > sent:
                sent = reading.time
                message = encode_joint_states(sent + epoch, names, reading.q, reading.qd)
                outlets["joint_states"].put(message)
            if now >= status_due:
                report = status_of(gate, name, last.mode, now + epoch, now)
                outlets["status"].put(encode_status(report))
                status_due = now + STATUS_PERIOD
            before = now
            until.wait(max(0.001, now + PERIOD - clock()))
    finally:
        driver.stop()
        ear.close()
        for declared in (answering, *outlets.values()):
            declared.undeclare()
