"""The real program in real processes, for tests that talk to it from outside."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from backend.shell.app.wire import decode
from backend.shell.link.session import with_port

LOCAL = ("--no-login",)  # signing in has tests of its own
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def start(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "cockpit.cli", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=ENVIRONMENT,
    )


def end(process: subprocess.Popen[str]) -> None:
    process.terminate()
    try:
        process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@dataclass
class Backend:
    """A running `cockpit serve` or `cockpit demo`. url: of its page; endpoint: of its Zenoh."""

    process: subprocess.Popen[str]
    url: str
    endpoint: str
    output: list[str] = field(default_factory=list)

    def get(self, path: str) -> Any:
        with urllib.request.urlopen(self.url + path, timeout=10) as answer:
            return json.loads(answer.read())

    def socket(self) -> contextlib.AbstractContextManager[ClientConnection]:
        return connect(self.url.replace("http", "ws") + "/ws", max_size=None)

    def wait_for(self, condition: Callable[[dict[str, Any]], bool], timeout: float = 40.0) -> Any:
        """The first snapshot of which the condition holds."""
        deadline = time.monotonic() + timeout
        snapshot: dict[str, Any] = {}
        while time.monotonic() < deadline:
            with contextlib.suppress(OSError):
                snapshot = self.get("/api/snapshot")
                if condition(snapshot):
                    return snapshot
            time.sleep(0.1)
        states = {n: (m["validity"], m["reasons"]) for n, m in snapshot.get("machines", {}).items()}
        raise AssertionError(f"not within {timeout} s: {states}; said: {self.output[-5:]}")


def all_valid(snapshot: dict[str, Any]) -> bool:
    return all(m["validity"] == "VALID" for m in snapshot["machines"].values())


def listen(process: subprocess.Popen[str], word: str) -> tuple[list[str], threading.Event]:
    """The lines that a program prints, and an event: it printed `word`, or it ended."""
    output: list[str] = []
    ready = threading.Event()

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            output.append(line.rstrip())
            if word in line:
                ready.set()
        ready.set()

    threading.Thread(target=read, daemon=True).start()
    return output, ready


@contextlib.contextmanager
def backend(
    command: str,
    *arguments: str,
    endpoint: str | None = None,
    login: tuple[str, ...] = LOCAL,
) -> Iterator[Backend]:
    """`cockpit COMMAND ...` on a free port, once it says where its page is.

    login: the options that say how one gets in.
    """
    process = start(command, "--port", "0", "--no-browser", *login, *arguments)
    output, ready = listen(process, "tcp/")
    try:
        assert ready.wait(60.0), f"no start within 60 s: {output}"
        text = "\n".join(output)
        page, zenoh = re.search(r"https?://\S+:\d+", text), re.search(r"tcp/[\d.]+:\d+", text)
        assert page, f"did not start: {text}"
        yield Backend(process, page[0], endpoint or (zenoh[0] if zenoh else ""), output)
    finally:
        end(process)


@contextlib.contextmanager
def serve(site: str, *arguments: str, endpoint: str | None = None) -> Iterator[Backend]:
    endpoint = endpoint or with_port("tcp/127.0.0.1:0")
    with backend("serve", "--site", site, "--listen", endpoint, *arguments) as running:
        running.endpoint = endpoint
        yield running


def simulate(site: str, machine: str, endpoint: str) -> subprocess.Popen[str]:
    return start("sim", "--site", site, "--machine", machine, "--connect", endpoint)


@contextlib.contextmanager
def simulated(site: str, endpoint: str, *machines: str) -> Iterator[dict[str, Any]]:
    """Simulated machines by name; the dict may be changed, what is in it at the end is ended."""
    processes = {name: simulate(site, name, endpoint) for name in machines}
    try:
        yield processes
    finally:
        for process in processes.values():
            end(process)


def frames(socket: ClientConnection, seconds: float) -> Iterator[tuple[float, dict[str, Any]]]:
    """(time of receipt, snapshot) of every snapshot frame for a while."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        try:
            message = socket.recv(timeout=left)
        except TimeoutError:
            return
        assert isinstance(message, bytes)
        header, _ = decode(message)
        if header["type"] == "snapshot":
            yield time.monotonic(), header


@contextlib.contextmanager
def playback(path: Path, *options: str, login: tuple[str, ...] = LOCAL) -> Iterator[Backend]:
    """`cockpit play PATH`, once its page is up."""
    process = start("play", str(path), "--port", "0", "--no-browser", *login, *options)
    output, ready = listen(process, "PLAYBACK")
    try:
        assert ready.wait(90.0), output
        found = re.search(r"http://\S+:\d+", "\n".join(output))
        assert found, output
        yield Backend(process, found[0], "", output)
    finally:
        end(process)
