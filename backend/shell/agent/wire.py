"""The agent's ends on the wire: commands, motion limits, and the queryable that grants leases."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from backend.control.lease import Lease
from backend.machine.model import Machine
from backend.shell.agent.gate import Gate, hear, hear_limits, negotiate
from backend.shell.link.codec import DecodeError, decode, decode_limits
from backend.shell.link.lease_codec import decode_request, encode_answer
from backend.shell.link.messages import Command
from backend.shell.link.topics import key, topic

QUEUE = 64


class Ear:
    """Listens for one machine. Callbacks only enqueue, but leases are answered at once.

    clock: what arrivals, leases and times-to-live are told by [s]; cut: whether the radio is down,
    for simulations: then nothing is heard and nothing answered.
    """

    def __init__(
        self,
        session: Any,
        prefix: str,
        lease: Lease,
        clock: Callable[[], float],
        cut: Callable[[], bool] = lambda: False,
    ) -> None:
        self._lease = lease
        self._lock = threading.Lock()
        self._clock = clock
        self._cut = cut
        self._key = key("lease", prefix)
        self._inbox: deque[tuple[str, bytes, float]] = deque(maxlen=QUEUE)
        self.malformed = 0
        self._declared = [
            session.declare_queryable(self._key, self._on_query),
            session.declare_subscriber(key("cmd", prefix), self._listener("cmd")),
            session.declare_subscriber(key("limits", prefix), self._listener("limits")),
        ]

    def close(self) -> None:
        for declared in self._declared:
            declared.undeclare()

    def hear(self, gate: Gate, name: str, machine: Machine) -> Gate:
        """The gate after everything that arrived, with the lease as it is now."""
        with self._lock:
            gate = replace(gate, lease=self._lease)
        while self._inbox:
            what, payload, arrival = self._inbox.popleft()
            try:
                if what == "limits":
                    limits = decode_limits(name, payload, arrival)
                    gate = hear_limits(gate, limits, machine, arrival)
                    continue
                command = decode(name, "cmd", payload, arrival)
            except DecodeError:
                self.malformed += 1
                continue
            if isinstance(command, Command):
                gate = hear(gate, command, machine, arrival)
        return gate

    def _listener(self, what: str) -> Callable[[Any], None]:
        most = topic(what).max_bytes

        def on_sample(sample: Any) -> None:
            if len(sample.payload) <= most and not self._cut():
                self._inbox.append((what, sample.payload.to_bytes(), self._clock()))

        return on_sample

    def _on_query(self, query: Any) -> None:
        with query:
            if self._cut():
                return
            try:
                request = decode_request(query.payload.to_bytes() if query.payload else b"")
            except DecodeError:
                self.malformed += 1
                return
            with self._lock:
                gate, answer = negotiate(Gate(self._lease), request, self._clock())
                self._lease = gate.lease
            query.reply(self._key, encode_answer(answer), express=topic("lease").express)
