"""What recording costs, at the rates of two machines with the paper's hardware."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from backend.documents.bench import BenchRow
from backend.documents.snapshot import snapshot_document
from backend.fusion.samples import Fix
from backend.pipeline.config import Config
from backend.pipeline.records import ImageStamp, Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.shell.app.wire import dumps
from backend.shell.link.encode import encode_fix, encode_heading, encode_joint_states
from backend.shell.link.receiver import Heard
from backend.shell.link.topics import match
from backend.shell.session.recorder import NoRecorder, Recorder
from backend.site.site import Site
from cockpit.bench_input import cycles
from cockpit.entry import Entry
from cockpit.options import Options
from cockpit.recording import make_recorder

CYCLE = 0.02  # [s]
TARGET = 10.0  # of one core, both processes together [%]
TICKS = float(os.sysconf("SC_CLK_TCK"))


def recording_rows(site: Site, config: Config, seconds: float) -> list[BenchRow]:
    """Shares of one core's time: the cockpit's part, the writing process's, and both; and what a
    cycle of the fast loop spends on it.
    """
    snapshot = _snapshot(site, config)
    with tempfile.TemporaryDirectory() as folder:
        options = Options(Entry("127.0.0.1"), 0, (), (), (), "DEMO", Path(folder))
        recorder = make_recorder(site, config, options)
        assert isinstance(recorder, Recorder)
        without, _ = _run(NoRecorder("for comparison"), config, snapshot, seconds)
        recorder.start()
        while not recorder.ready:
            time.sleep(0.05)
        pid = recorder.pid
        before = _spent(pid)
        spent, taken = _run(recorder, config, snapshot, seconds)
        child = _spent(pid) - before
        recorder.close()
        size = sum(path.stat().st_size for path in Path(folder).rglob("*.mcap"))
    own, other = 100.0 * (spent - without) / seconds, 100.0 * child / seconds
    micro = 1e6 * np.asarray(taken)
    low, high = (float(v) for v in np.percentile(micro, [5, 95]))
    return [
        _share("recording, the cockpit's share of one core", own, None),
        _share("recording, the writing process's share of one core", other, None),
        _share("recording, both together", own + other, TARGET),
        BenchRow(
            name="recording, in each cycle of the fast loop",
            value=float(np.median(micro)),
            unit="µs",
            spread=(low, high),
            target=200.0,
        ),
        BenchRow(
            name="recording, on disk",
            value=size / 2**20 / seconds * 3600.0,
            unit="MiB/h",
            spread=(0.0, 0.0),
        ),
    ]


def _share(name: str, value: float, target: float | None) -> BenchRow:
    return BenchRow(name=name, value=value, unit="%", spread=(value, value), target=target)


def _snapshot(site: Site, config: Config) -> Snapshot:
    """Of two machines that are valid."""
    state, snapshot = initial(config), None
    for now, inputs in cycles(site, config, 50):
        state, snapshot = step(state, inputs, now, config)
    assert snapshot is not None
    return snapshot


def _run(
    recorder: Recorder | NoRecorder, config: Config, snapshot: Snapshot, seconds: float
) -> tuple[float, list[float]]:
    """This process's CPU time [s] in so many seconds at 50 Hz; and the recorder's in each cycle."""
    messages = _messages(config)
    document = snapshot_document(snapshot, config)
    taken = []
    begun, start = time.process_time(), time.monotonic()
    for cycle in range(round(seconds / CYCLE)):
        now = time.monotonic()
        items = tuple(
            Heard(machine, f"{machine}/{suffix}", suffix, row, payload, now)
            for machine, suffix, row, payload, every in messages
            if cycle % every == 0
        )
        images: tuple[ImageStamp, ...] = ()
        if cycle % 5 == 0:  # as the relay does, whether something is recorded or not
            kinds = ("sun", "exact")
            images = tuple(ImageStamp("left<-right", kind, now, now, 0.01) for kind in kinds)
            document["time"] = now
            text = dumps(document)
            recorder.snapshot(text, now)
        at = time.thread_time()
        recorder.notices()
        recorder.hear(items)
        recorder.after_cycle(Inputs(images=images), snapshot)
        taken.append(time.thread_time() - at)
        time.sleep(max(0.0, start + (cycle + 1) * CYCLE - time.monotonic()))
    return time.process_time() - begun, taken


def _messages(config: Config) -> list[tuple[str, str, object, bytes, int]]:
    """Machine, key, row, payload, and in every how many cycles: joints 200 Hz, the rest 17 Hz."""
    rng = np.random.default_rng(0)
    found = []
    for name, machine in config.machines.items():
        roles = [joint.role for joint in machine.joints]
        n = len(roles)
        payloads = [
            ("joint_states", encode_joint_states(1.0, roles, rng.normal(size=n), np.zeros(n)), 1)
            for _ in range(4)
        ]
        payloads.append(("gnss/fix", encode_fix(1.0, 37.3, 126.8, 31.0, np.eye(3), Fix.SBAS), 3))
        payloads.append(("gnss/heading", encode_heading(1.0, 0.3, 1e-6), 3))
        for suffix, payload, every in payloads:
            row = match(suffix)
            assert row is not None
            found.append((name, suffix, row[0], payload, every))
    return found


def _spent(pid: int | None) -> float:
    """CPU time of a process since it began [s]; 0 where it is not told."""
    path = Path(f"/proc/{pid}/stat")
    if not path.is_file():
        return 0.0
    fields = path.read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS
