"""What is said to and by machines, overheard on the wire."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from typing import Any

from backend.shell.link.codec import decode
from backend.shell.link.messages import AgentStatus, Command, TrueState
from backend.shell.link.session import open_session


@dataclass
class Wiretap:
    """Commands to one machine, its true states and its agent's reports as they came."""

    endpoint: str
    machine: str
    listens: bool = False  # machines connect to it, past any backend
    commands: list[Command] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)
    truths: list[TrueState] = field(default_factory=list)
    statuses: list[AgentStatus] = field(default_factory=list)

    def __enter__(self) -> Wiretap:
        self._lock = threading.Lock()
        ends = {"listen" if self.listens else "connect": [self.endpoint]}
        self.session = open_session(**ends, mode="router")
        self._declared = [
            self.session.declare_subscriber(f"{self.machine}/{row}", self._listener(row))
            for row in ("cmd", "truth", "status")
        ]
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    def _listener(self, row: str) -> Any:
        def on_sample(sample: Any) -> None:
            payload = sample.payload.to_bytes()
            message = decode(self.machine, row, payload, time.monotonic())
            with self._lock:
                if isinstance(message, Command):
                    self.commands.append(message)
                    self.payloads.append(payload)
                elif isinstance(message, TrueState):
                    self.truths.append(message)
                elif isinstance(message, AgentStatus):
                    self.statuses.append(message)

        return on_sample

    def speed(self) -> float:
        """Of the fastest joint now [rad/s]."""
        return float(abs(self.truths[-1].velocity).max())

    def first_zero(self, since: float) -> float | None:
        """When the first command of zero arrived after `since` that no other followed [s]."""
        with self._lock:
            found = None
            for command in reversed(self.commands):
                if command.arrival < since:
                    break
                if abs(command.velocity).any():
                    break
                found = command.arrival
        return found

    def stood(self, since: float, below: float = 0.02) -> float | None:
        """When the machine had come to a stand after `since` [s]; None while it moves."""
        with self._lock:
            found = None
            for truth in reversed(self.truths):
                if truth.arrival < since or abs(truth.velocity).max() > below:
                    break
                found = truth.arrival
        return found
