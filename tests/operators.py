"""An operator's page without a browser: the websocket of a running cockpit, sticks and all."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from typing import Any

from live import Backend
from websockets.exceptions import ConnectionClosed

from backend.shell.app.wire import decode

PERIOD = 0.025  # between two inputs [s]
NOTHING = {
    **dict.fromkeys(("left_x", "left_y", "right_x", "right_y", "track_left", "track_right"), 0.0),
    "enable": False,
    "focus": True,
    "gamepad": True,
    "override": False,
    "source": "gamepad",
}


class Operator:
    """Sends its levers every `PERIOD` as a page does, and keeps the newest snapshot."""

    def __init__(self, backend: Backend) -> None:
        self._connection = backend.socket()
        self._socket = self._connection.__enter__()
        self.levers: dict[str, Any] = dict(NOTHING)
        self.sending = True
        self.you: dict[str, Any] = {}
        self.snapshot: dict[str, Any] = {}
        self._sequence = 0
        self._lock = threading.Lock()
        self._gone = threading.Event()
        self._threads = [
            threading.Thread(target=run, daemon=True) for run in (self._listen, self._repeat)
        ]
        for thread in self._threads:
            thread.start()
        self.wait(lambda: bool(self.you and self.snapshot))

    def close(self) -> None:
        self._gone.set()
        self._connection.__exit__(None, None, None)
        for thread in self._threads:
            thread.join(timeout=2.0)

    def say(self, kind: str, **more: Any) -> None:
        with self._lock:
            self._socket.send(json.dumps({"type": kind, **more}))

    def move(self, **levers: Any) -> None:
        """New positions of some levers, told at once."""
        self.levers = {**self.levers, **levers}
        self._tell()

    def ask(self, do: str, machine: str, **more: str) -> None:
        self.say("lease", do=do, machine=machine, **more)

    def take(self, machine: str) -> None:
        """Requests a machine, and waits until it is held and answers."""
        self.ask("request", machine)
        self.wait(lambda: self.console(machine).get("held") is True)
        self.wait(lambda: self.machine(machine)["round_trip"] is not None)

    def enable(self, machine: str) -> None:
        """Presses the dead-man anew, sticks in neutral; again when it was paused on the way."""
        end = time.monotonic() + 60.0
        while self.state(machine) not in ("Enabled", "Active"):
            assert time.monotonic() < end, self.snapshot.get("driving")
            self.levers = dict(NOTHING)
            self._tell()
            time.sleep(6 * PERIOD)
            self.move(enable=True)
            pressed = time.monotonic()
            while time.monotonic() - pressed < 1.0:
                if self.state(machine) in ("Enabled", "Active"):
                    return
                time.sleep(0.005)

    def drive(self, machine: str, going: Callable[[], bool], **levers: float) -> None:
        """Takes a machine and moves levers until `going`.

        A busy computer may pause it on the way, let the lease end, or stop a direction for want of
        fresh data until its stick was in neutral: then once more.
        """
        end = time.monotonic() + 60.0
        while not going():
            assert time.monotonic() < end, self.snapshot.get("driving")
            if not self.console(machine).get("held"):
                self.take(machine)
            if self.state(machine) not in ("Enabled", "Active"):
                self.enable(machine)
            if self.shut(machine):
                self.move(**dict.fromkeys(levers, 0.0))
                time.sleep(6 * PERIOD)
            self.move(**levers)
            time.sleep(PERIOD)

    @property
    def seat(self) -> dict[str, Any]:
        found: dict[str, Any] = self.snapshot["driving"]["seats"].get(self.you["seat"], {})
        return found

    def machine(self, name: str) -> dict[str, Any]:
        found: dict[str, Any] = self.snapshot["driving"]["machines"][name]
        return found

    def console(self, machine: str) -> dict[str, Any]:
        found: dict[str, Any] = self.seat.get("consoles", {}).get(machine, {})
        return found

    def state(self, machine: str) -> str:
        return str(self.console(machine).get("state", ""))

    def shut(self, machine: str) -> bool:
        """Whether a direction waits for its stick's neutral."""
        causes = self.seat.get("decision", {}).get(machine, {}).get("causes", {})
        return any(side["concern"] == "neutral" for both in causes.values() for side in both)

    def joints(self, machine: str) -> dict[str, float]:
        found: dict[str, float] = self.snapshot["machines"][machine]["joints"]
        return found

    def wait(self, condition: Callable[[], bool], timeout: float = 20.0) -> float:
        """Until the condition holds; how long that took [s]."""
        begun = time.monotonic()
        while not condition():
            if time.monotonic() - begun > timeout:
                raise AssertionError(f"not within {timeout} s: {self.snapshot.get('driving')}")
            time.sleep(0.005)
        return time.monotonic() - begun

    def _tell(self) -> None:
        with self._lock:
            self._sequence += 1
            said = {"type": "sticks", "seq": self._sequence, **self.levers}
            self._socket.send(json.dumps(said))

    def _repeat(self) -> None:
        while not self._gone.wait(PERIOD):
            if not self.sending:
                continue
            try:
                self._tell()
            except ConnectionClosed:
                return

    def _listen(self) -> None:
        try:
            for frame in self._socket:
                assert isinstance(frame, bytes)
                header = decode(frame)[0]
                if header["type"] == "you":
                    self.you = header
                elif header["type"] == "snapshot":
                    self.snapshot = header
                    with self._lock:
                        self._socket.send(json.dumps({"type": "ack", "cycle": header["cycle"]}))
        except ConnectionClosed:
            self._gone.set()
