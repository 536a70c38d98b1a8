"""The live system, measured from outside: real processes over Zenoh, a real websocket."""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from backend.documents.bench import BenchRow
from backend.shell.app.wire import decode
from backend.shell.link.session import open_session, with_port
from backend.site.site import load_site
from cockpit.bench_rows import percentile_rows
from cockpit.memory import memory_of

SITE = "demo"
MACHINES = ("left", "right")
CROWD = 1000  # boxes of the crowded site


def crowded_rows(seconds: float) -> list[BenchRow]:
    """`live_rows` on the demo's site with a thousand boxes on it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "crowded.toml"
        path.write_text(crowded_site(), encoding="utf-8")
        return live_rows(seconds, str(path), f"live, {CROWD} boxes,")


def crowded_site() -> str:
    """The demo's site file with boxes all around both machines, outside of where they work."""
    site = load_site(SITE)
    rng = np.random.default_rng(4)
    bases = np.array([m.start.position for m in site.machines if m.start is not None])
    lines = [site.path.read_text(encoding="utf-8")]
    count = 0
    while count < CROWD:
        center = bases.mean(axis=0) + rng.uniform(-25.0, 25.0, 3) * [1.0, 1.0, 0.0]
        half = rng.uniform(0.05, 0.4, 3)
        # Both machines work between them: what lies there would be hit again and again.
        if np.linalg.norm(bases[:, :2] - center[:2], axis=1).sum() < 11.0:
            continue
        center[2] += half[2]
        lines.append(
            f'[[obstacle]]\nname = "box{count}"\ncenter = {center.tolist()}\n'
            f"half_extents = {half.tolist()}\nyaw_deg = {rng.uniform(-180.0, 180.0)}\n"
        )
        count += 1
    return "\n".join(lines)


def live_rows(seconds: float, site: str = SITE, name: str = "live") -> list[BenchRow]:
    """Cycle times of a running backend, its memory, and from a pose's arrival to the websocket."""
    endpoint = with_port("tcp/127.0.0.1:0")
    with _backend(endpoint, site) as (process, url), contextlib.ExitStack() as closing:
        session = closing.enter_context(_session(endpoint))
        arrivals: dict[str, list[float]] = {machine: [] for machine in MACHINES}
        for machine in MACHINES:
            subscriber = session.declare_subscriber(
                f"{machine}/joint_states",
                lambda _, times=arrivals[machine]: times.append(time.monotonic()),
            )
            closing.callback(subscriber.undeclare)
        time.sleep(1.0)  # both subscriptions stand before the first message
        with _machines(endpoint, site):
            frames = _listen(url, seconds)
        memory = memory_of(process.pid)
    latencies = _latencies(arrivals, frames)
    last = frames[-1][1]["backend"]
    rows = percentile_rows(f"{name} pose arrival on Zenoh to websocket", latencies, 60.0)
    for key, target_of, target in (
        ("step", "p99", 10.0),
        ("images", "p95", 100.0),
        ("zones", "p95", None),
    ):
        timing = last[key]
        rows += [
            BenchRow(
                name=f"{name} {key} {p}",
                value=timing[p],
                unit="ms",
                spread=(timing["p50"], timing["p99"]),
                target=target if p == target_of else None,
            )
            for p in ("p50", "p95", "p99")
        ]
        rows.append(
            BenchRow(
                name=f"{name} {key} rate",
                value=timing["rate"],
                unit="Hz",
                spread=(timing["rate"], timing["rate"]),
            )
        )
    rows.append(
        BenchRow(
            name=f"{name} backend memory, all processes",
            value=memory,
            unit="MiB",
            spread=(memory, memory),
            target=1024,
        )
    )
    return rows


def _latencies(arrivals: dict[str, list[float]], frames: list[tuple[float, dict]]) -> list[float]:
    """For every joint message: arrival here until the first frame that counts it [s]."""
    found: list[float] = []
    for name, times in arrivals.items():
        counted = [(t, frame["machines"][name]["received"]["joints"]) for t, frame in frames]
        if not counted:
            continue
        k = counted[0][1]  # messages before the first frame have no first frame after them
        for t, received in counted[1:]:
            found += [t - times[i] for i in range(k, min(received, len(times)))]
            k = max(k, received)
    if not found:
        raise RuntimeError("no pose reached the websocket: the live measurement failed")
    return found


def _listen(url: str, seconds: float) -> list[tuple[float, dict]]:
    """Snapshot frames with their times of receipt, once both machines are valid."""
    frames: list[tuple[float, dict]] = []
    deadline = time.monotonic() + 30.0
    until = float("inf")
    with connect(url, max_size=None) as socket:
        while time.monotonic() < min(deadline, until):
            try:
                frame = socket.recv(timeout=5.0)
            except (TimeoutError, ConnectionClosed) as error:
                raise RuntimeError(f"the websocket fell silent: {error!r}") from error
            now = time.monotonic()
            header, _ = decode(frame) if isinstance(frame, bytes) else ({}, {})
            if header.get("type") != "snapshot":
                continue
            valid = all(m["validity"] == "VALID" for m in header["machines"].values())
            if valid and until == float("inf"):
                until = now + seconds
                deadline = until
            if until < float("inf"):
                frames.append((now, header))
    if not frames:
        raise RuntimeError("the simulated machines did not become valid within 30 s")
    return frames


@contextlib.contextmanager
def _backend(endpoint: str, site: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`cockpit serve` on a free port; yields the process and its websocket's address."""
    recordings = tempfile.mkdtemp()
    command = [
        *(sys.executable, "-m", "cockpit.cli", "serve", "--site", site, "--port", "0"),
        *("--no-browser", "--no-login", "--listen", endpoint, "--record", recordings),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"http://([\d.]+:\d+)", line)
        if found is None:
            raise RuntimeError(f"the backend did not start: {line!r}")
        threading.Thread(target=process.stdout.read, daemon=True).start()
        yield process, f"ws://{found[1]}/ws"
    finally:
        _end(process)
        shutil.rmtree(recordings, ignore_errors=True)


@contextlib.contextmanager
def _session(endpoint: str) -> Iterator[Any]:
    """Closed whatever happens: a program cannot end while one is open."""
    session = open_session(connect=[endpoint], mode="router")
    try:
        yield session
    finally:
        session.close()


@contextlib.contextmanager
def _machines(endpoint: str, site: str) -> Iterator[None]:
    processes = [
        subprocess.Popen(
            [
                *(sys.executable, "-m", "cockpit.cli", "sim", "--site", site),
                *("--machine", name, "--connect", endpoint),
            ]
        )
        for name in MACHINES
    ]
    try:
        yield
    finally:
        for process in processes:
            _end(process)


def _end(process: subprocess.Popen) -> None:
    process.terminate()
    try:
        process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        process.kill()
