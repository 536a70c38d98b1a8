"""A recorded session of an hour: opening it, seeking in it, playing it ten times as fast."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

import numpy as np
from websockets.sync.client import connect

from backend.documents.bench import BenchRow
from backend.pipeline.config import Config
from backend.shell.app.wire import decode
from backend.shell.hub import Hub
from backend.shell.session.cycles import Topics
from backend.shell.session.player import Player
from backend.shell.session.reader import Session, open_session
from backend.shell.session.synthetic import Script, synthesize
from backend.site.site import Site
from cockpit.bench_rows import percentile_rows

HOUR = Script(duration=3600.0, begin=60.0, lap=40.0, every=5)
OPENINGS, SEEKS = 5, 60
SPEED = 10.0
SETTLE = 5.0  # from the first snapshot to the measurement of playback [s]


def session_rows(site: Site, config: Config, seconds: float) -> list[BenchRow]:
    """Makes the session, which takes a minute, and measures."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hour.mcap"
        synthesize(path, site, config, HOUR)
        return rows_of(path, site, config, seconds)


def rows_of(path: Path, site: Site, config: Config, seconds: float) -> list[BenchRow]:
    """Of one session file."""
    openings = []
    for _ in range(OPENINGS):
        start = time.perf_counter()
        session = open_session(path)
        openings.append(time.perf_counter() - start)
    size = path.stat().st_size / 2**20
    rows = percentile_rows(f"open a session of an hour, {size:.0f} MiB,", openings, 2000.0)
    for source, words in (("evaluated", "judged anew"), ("recorded", "as it was")):
        durations = seek_durations(session, Topics.of(site), config, source)
        rows += percentile_rows(f"seek in it, {words},", durations, 300.0)
    return [*rows, *playback_rows(path, seconds)]


def seek_durations(session: Session, topics: Topics, config: Config, source: str) -> list[float]:
    """From an order to the published snapshot, at random places [s]."""
    hub, shown = Hub(), threading.Event()
    player = Player(session, topics, config, hub, source)
    player.start()
    while hub.latest() is None:
        time.sleep(0.01)
    rng = np.random.default_rng(0)
    found = []
    for target in rng.uniform(10.0, (session.end - session.begin) / 1e9 - 1.0, SEEKS):
        before = player.status()["time"]
        shown.clear()

        def notify(before: float = before) -> None:
            if player.status()["time"] != before:
                shown.set()

        undo = hub.listen(notify)
        start = time.perf_counter()
        player.do("seek", float(target))
        if not shown.wait(30.0):
            raise RuntimeError("a seek was not obeyed within 30 s")
        found.append(time.perf_counter() - start)
        undo()
    player.stop()
    return found


def playback_rows(path: Path, seconds: float) -> list[BenchRow]:
    """The real program playing at ten times the speed, all images included, and its start."""
    command = [
        *(sys.executable, "-m", "cockpit.cli", "play", str(path), "--port", "0", "--no-browser"),
        *("--no-login", "--source", "evaluated", "--speed", str(SPEED), "--from", "60"),
    ]
    began = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = next((text for text in process.stdout if "http://" in text), "")
        found = re.search(r"http://([\d.]+:\d+)", line)
        if found is None:
            raise RuntimeError(f"playback did not start: {line!r}")
        threading.Thread(target=process.stdout.read, daemon=True).start()
        with urllib.request.urlopen(f"http://{found[1]}/", timeout=30) as answer:
            answer.read()
        page = time.perf_counter() - began
        speed, processors = _speed(f"ws://{found[1]}/ws", process.pid, seconds)
    finally:
        process.terminate()
        try:
            process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            process.kill()
    values = (
        ("from the command to the page of an hour's session", 1e3 * page, "ms", 2000.0),
        (f"playback at {SPEED:g} x, judged anew: a session's second takes", 1e3 / speed, "ms", 105),
        (f"playback at {SPEED:g} x, processors of the player", processors[0], "cores", None),
        (f"playback at {SPEED:g} x, with the images' processes", processors[1], "cores", None),
    )
    return [
        BenchRow(name=name, value=value, unit=unit, spread=(value, value), target=target)
        for name, value, unit, target in values
    ]


def _speed(url: str, pid: int, seconds: float) -> tuple[float, tuple[float, float]]:
    """Session seconds per second, and processors used: by the process, and by all of them."""
    with connect(url, max_size=None) as socket:
        first: tuple[float, float, float, float] | None = None
        ready = time.monotonic() + SETTLE
        while True:
            frame = socket.recv(timeout=20.0)
            header, _ = decode(frame) if isinstance(frame, bytes) else ({}, {})
            now = time.monotonic()
            if header.get("type") != "snapshot" or now < ready:
                continue
            at = header["playback"]["time"], now, *_processor_time(pid)
            if first is None:
                first = at
            elif now - first[1] >= seconds:
                wall = now - first[1]
                used = ((at[2] - first[2]) / wall, (at[3] - first[3]) / wall)
                return (at[0] - first[0]) / wall, used


def _processor_time(pid: int) -> tuple[float, float]:
    """Of a process, and of it with those that it started [s]; NaN where it is not told."""
    stat = Path(f"/proc/{pid}/stat")
    if not stat.is_file():
        return float("nan"), float("nan")
    fields = stat.read_text().rpartition(")")[2].split()
    own = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    total = own
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        total += sum(_processor_time(int(child))[1] for child in children.read_text().split())
    return own, total
