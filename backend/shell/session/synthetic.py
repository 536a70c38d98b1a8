"""Sessions made without a clock: simulated machines recorded as a live cockpit would have.

One stretch is simulated and judged; longer sessions repeat its last lap with later stamps.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from heapq import merge
from pathlib import Path

import numpy as np

from backend.documents.snapshot import snapshot_document
from backend.fusion.samples import ClockSample, Sample
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.shell.link.codec import decode
from backend.shell.link.topics import key
from backend.shell.session.format import (
    ALARM,
    CLOCK,
    CYCLE,
    MARKER,
    SNAPSHOT,
    Header,
    Message,
    dumps,
    stamp,
)
from backend.shell.session.writer import SessionWriter
from backend.shell.sim.agent import act, fresh
from backend.shell.sim.dynamics import Hydraulics, limits_of
from backend.shell.sim.dynamics import step as move
from backend.shell.sim.program import Program, is_cut
from backend.shell.sim.program_file import load_program
from backend.shell.sim.radio import Radio, arrival_time
from backend.shell.sim.sensors import sensors
from backend.shell.sim.simulate import on_schedule
from backend.site.site import Site

DT = 0.005  # [s]
CYCLE_TIME = 0.02  # [s]
SNAPSHOT_EVERY = 5  # cycles
CLOCK_EVERY = 25  # cycles
LOCAL = 5000.0  # the local monotonic clock when a session begins [s]
LEAD = 5.0  # before what is repeated: time to become valid [s]
EPOCH = 1_790_000_000.0  # the machines' clocks then [s]
_STAMP = struct.Struct("<II")  # of a header, behind the four bytes that begin a CDR message

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Script:
    """begin: schedule time at which the recording begins; duration; lap: how much of the simulated
    stretch is repeated until the end, None for nothing [s]. cycles: whether they are recorded;
    snapshots: whether conclusions are; every: 1 judges each cycle, as live; n each n-th.
    """

    duration: float
    begin: float = 0.0
    lap: float | None = None
    cycles: bool = True
    snapshots: bool = True
    every: int = 1


@dataclass
class Lived:
    """What a live pipeline concluded of the simulated stretch, by cycle."""

    snapshots: list[Snapshot] = field(default_factory=list)


def synthesize(
    path: Path,
    site: Site,
    config: Config,
    script: Script,
    progress: Progress = lambda _: None,
) -> Lived:
    """Writes a session of all machines of a site. Raises InputError when it cannot be created."""
    header = Header(
        offset=round((EPOCH - LOCAL) * 1e9),
        recording=path.stem,
        part=0,
        site_file=str(site.path),
        site=site.path.read_text(encoding="utf-8"),
        own=",".join(config.own),
        origin="simulated",
        software="0",
        note="simulated without a clock",
    )
    writer = SessionWriter(path, header)
    lived = Lived()
    length = script.duration
    if script.lap is not None:
        length = min(length, script.lap + LEAD)
    heard = list(_heard(site, config.machines, script.begin, length, lambda s: progress(0.2 * s)))
    base = list(
        _judged(heard, site, config, script, length, lived, lambda s: progress(0.2 + s / 2))
    )
    for message in base:
        writer.write(message)
    if script.lap is not None:
        since = length - script.lap
        lap = [m for m in base if m.time > stamp(LOCAL + since, header.offset)]
        laps = math.ceil((script.duration - length) / script.lap)
        for k in range(laps):
            for message in lap:
                writer.write(_later(message, (k + 1) * script.lap))
            progress(0.7 + 0.3 * (k + 1) / laps)
    writer.close()
    return lived


def _heard(
    site: Site, machines: dict[str, Machine], begin: float, length: float, progress: Progress
) -> Iterator[tuple[float, str, str, str, bytes]]:
    """(arrival on the local clock, machine, key, suffix, data) of all sensors, by arrival."""
    radio = Radio(site.sim.radio_period, site.sim.latency)
    lists = []
    for k, (name, machine) in enumerate(machines.items()):
        lists.append(_machine(site, name, machine, begin, length, radio))
        progress((k + 1) / len(machines))
    return merge(*lists, key=lambda one: one[0])


def _machine(
    site: Site, name: str, machine: Machine, begin: float, length: float, radio: Radio
) -> list[tuple[float, str, str, str, bytes]]:
    program: Program = load_program(machine, site, name)
    entry = site.machine(name)
    start = entry.start
    assert start is not None
    position = site.frame.from_projected(np.array(start.position))
    agent, limits, lags = fresh(program), limits_of(machine), Hydraulics()
    rng = np.random.default_rng((program.seed, 1))
    state = on_schedule(program, begin, position, *start.attitude)
    rig = sensors(machine, site, entry.sim.joints)
    due, latest = [0.0] * len(rig), 0.0
    found = []
    for k in range(round(length / DT)):
        t = k * DT
        agent, state, demand = act(agent, program, lags, state, begin + t, DT)
        state = move(state, demand, limits, lags, DT)
        cut = is_cut(program, begin + t)
        for i, sensor in enumerate(rig):
            if t < due[i] - 1e-6:
                continue
            due[i] += sensor.period
            if cut:
                continue
            data = sensor.measure(state, EPOCH + t, rng)
            # The clock counts whole nanoseconds; messages arrive one after the other, as sent.
            latest = max(latest + rng.uniform(2e-5, 2e-4), arrival_time(t, radio))
            arrival = round((LOCAL + latest) * 1e9) / 1e9
            topic = key(sensor.topic, entry.prefix, **sensor.fields)
            found.append((arrival, name, topic, topic[len(entry.prefix) + 1 :], data))
    return found


def _judged(
    heard: list[tuple[float, str, str, str, bytes]],
    site: Site,
    config: Config,
    script: Script,
    length: float,
    lived: Lived,
    progress: Progress,
) -> Iterator[Message]:
    """Messages in the order of recording, judged cycle by cycle."""
    offset = round((EPOCH - LOCAL) * 1e9)
    rng = np.random.default_rng(7)
    state, position, said = initial(config), 0, ""
    samples: list[Sample] = []
    cycles = round(length / CYCLE_TIME)
    for cycle in range(cycles):
        now = round((LOCAL + (cycle + 1) * CYCLE_TIME + rng.uniform(0.0, 1e-3)) * 1e9) / 1e9
        while position < len(heard) and heard[position][0] <= now:
            arrival, name, topic, suffix, data = heard[position]
            position += 1
            samples.append(decode(name, suffix, data, arrival))  # type: ignore[arg-type]
            yield Message(f"/{topic}", stamp(arrival, offset), data)
        if cycle % CLOCK_EVERY == 0:
            for name in config.machines:
                trip = ClockSample(name, now - 0.004, now - LOCAL - 0.002 + EPOCH, now - 0.001)
                samples.append(trip)
                yield Message(CLOCK, stamp(trip.received, offset), dumps(vars(trip)))
        if script.cycles:
            yield Message(CYCLE, stamp(now, offset), dumps({"cycle": cycle, "time": now}))
        if not script.snapshots or cycle % script.every:
            continue
        state, snapshot = step(replace(state, cycle=cycle), Inputs(tuple(samples)), now, config)
        samples.clear()
        lived.snapshots.append(snapshot)
        document = snapshot_document(snapshot, config)
        alarms = dumps({"alarms": document["alarms"]})
        shown = str([(a["machine"], a["name"], a["level"]) for a in document["alarms"]])
        if shown != said:
            said = shown
            yield Message(ALARM, stamp(now, offset), alarms)
        if cycle % SNAPSHOT_EVERY == 0:
            yield Message(SNAPSHOT, stamp(now, offset), dumps(document))
        if cycle == cycles // 2:
            yield Message(MARKER, stamp(now, offset), dumps({"kind": "note", "text": "half way"}))
        if cycle % 50 == 0:
            progress(cycle / cycles)


def _later(message: Message, shift: float) -> Message:
    """The same message `shift` seconds later, in its stamps, too."""
    data = message.data
    time = message.time + round(shift * 1e9)
    if message.topic in _TIMES:
        return Message(message.topic, time, _moved(data, shift, _TIMES[message.topic]))
    if not message.topic.startswith("/cockpit/"):
        seconds, nanoseconds = _STAMP.unpack_from(data, 4)
        total = seconds * 10**9 + nanoseconds + round(shift * 1e9)
        data = data[:4] + _STAMP.pack(*divmod(total, 10**9)) + data[12:]
    return Message(message.topic, time, data)


_TIMES = {
    CYCLE: ("time",),
    CLOCK: ("sent", "remote", "received"),
    SNAPSHOT: ("time", "state_time"),
}


def _moved(data: bytes, shift: float, names: tuple[str, ...]) -> bytes:
    document = json.loads(data)
    for name in names:
        document[name] += shift
    if "cycle" in document:
        document["cycle"] += round(shift / CYCLE_TIME)
    return dumps(document)
