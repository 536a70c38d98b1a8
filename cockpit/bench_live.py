"""The live system, measured from outside: real processes over Zenoh, a real websocket."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from backend.documents.bench import BenchRow
from backend.shell.app.wire import decode
from backend.shell.link.session import open_session, with_port
from cockpit.bench_rows import percentile_rows

SITE = "demo"
MACHINES = ("left", "right")


def live_rows(seconds: float) -> list[BenchRow]:
    """Cycle times of a running backend, its memory, and from a pose's arrival to the websocket."""
    endpoint = with_port("tcp/127.0.0.1:0")
    with _backend(endpoint) as (process, url):
        session = open_session(connect=[endpoint], mode="router")
        arrivals: dict[str, list[float]] = {name: [] for name in MACHINES}
        subscribers = [
            session.declare_subscriber(
                f"{name}/joint_states",
                lambda _, times=arrivals[name]: times.append(time.monotonic()),
            )
            for name in MACHINES
        ]
        time.sleep(1.0)  # both subscriptions stand before the first message
        with _machines(endpoint):
            frames = _listen(url, seconds)
        for subscriber in subscribers:
            subscriber.undeclare()
        session.close()
        memory = _resident(process.pid)
    latencies = _latencies(arrivals, frames)
    last = frames[-1][1]["backend"]
    rows = percentile_rows("pose arrival on Zenoh to websocket", latencies, 60.0)
    for name, key, target in (("step", "step", 10.0), ("images", "images", 50.0)):
        timing = last[key]
        rows += [
            BenchRow(
                name=f"live {name} {p}",
                value=timing[p],
                unit="ms",
                spread=(timing["p50"], timing["p99"]),
                target=target if p == "p95" else None,
            )
            for p in ("p50", "p95", "p99")
        ]
        rows.append(
            BenchRow(
                name=f"live {name} rate",
                value=timing["rate"],
                unit="Hz",
                spread=(timing["rate"], timing["rate"]),
            )
        )
    rows.append(
        BenchRow(
            name="backend memory", value=memory, unit="MiB", spread=(memory, memory), target=1024
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
def _backend(endpoint: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`cockpit serve` on a free port; yields the process and its websocket's address."""
    command = [
        *(sys.executable, "-m", "cockpit.cli", "serve", "--site", SITE, "--port", "0"),
        *("--no-browser", "--listen", endpoint),
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


@contextlib.contextmanager
def _machines(endpoint: str) -> Iterator[None]:
    processes = [
        subprocess.Popen(
            [
                *(sys.executable, "-m", "cockpit.cli", "sim", "--site", SITE),
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


def _resident(pid: int) -> float:
    """Resident memory of a process [MiB]; NaN where the system does not tell."""
    status = Path(f"/proc/{pid}/status")
    if not status.is_file():
        return float(np.nan)
    for line in status.read_text().splitlines():
        if line.startswith("VmRSS"):
            return float(line.split()[1]) / 1024.0
    return float(np.nan)
