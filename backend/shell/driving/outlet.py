"""Commands and motion limits to one machine, and how long they take there and back."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

from backend.control.latency import Condition, Link, Trip, condition, measured
from backend.machine.model import Machine
from backend.safety.limiter import Decision
from backend.shell.link.encode import encode_command, encode_limits
from backend.shell.link.messages import AgentStatus, Command, MotionLimits
from backend.shell.link.session import publisher

TIME_TO_LIVE = 0.2  # of a command [s]
LIMITS_TIME_TO_LIVE = 0.3  # of motion limits [s]
REMEMBERED = 256  # commands: 5 s of them
TRACKS = ("track_left", "track_right")


class Outlet:
    """Of the machine `name`, which has the key prefix `prefix` on an open Zenoh session.

    clock: what sending and arrivals are told by [s].
    """

    def __init__(
        self, session: Any, name: str, prefix: str, machine: Machine, clock: Callable[[], float]
    ) -> None:
        self._name = name
        self._clock = clock
        self._joints = tuple(joint.name for joint in machine.joints)
        self._outlets = {row: publisher(session, row, prefix) for row in ("cmd", "limits")}
        self._sequence = 0
        self._sent: deque[tuple[int, int, float]] = deque(maxlen=REMEMBERED)
        self._link = Link()
        self._heard = -1.0

    def send(self, decision: Decision, holder: str, token: int) -> None:
        """The command and the limits that a decision allows, under the holder's token."""
        self._sequence += 1
        stamp = self._name, time.time(), 0.0, self._sequence
        left, right = (float(v) for v in decision.tracks)
        command = Command(
            *stamp, TIME_TO_LIVE, holder, token, self._joints, decision.joints, left, right
        )
        names, fraction = (*self._joints, *TRACKS), decision.fraction
        limits = MotionLimits(
            *stamp, LIMITS_TIME_TO_LIVE, token, names, fraction[:, 0], fraction[:, 1]
        )
        self._sent.append((token, self._sequence, self._clock()))
        # The limits first: a command is never obeyed within older ones.
        self._outlets["limits"].put(encode_limits(limits))
        self._outlets["cmd"].put(encode_command(command))

    def hear(self, status: AgentStatus) -> None:
        """An agent's report: it tells which command it heard, and how long ago."""
        if status.arrival <= self._heard:
            return
        self._heard = status.arrival
        for token, sequence, sent in reversed(self._sent):
            if (token, sequence) == (status.token, status.sequence):
                taken = status.arrival - sent - max(status.command_age, 0.0)
                self._link = measured(self._link, Trip(status.arrival, taken))
                return

    def condition(self, now: float) -> Condition:
        """What the way to the machine and back is like at `now` [s]."""
        return condition(self._link, now)

    def close(self) -> None:
        for outlet in self._outlets.values():
            outlet.undeclare()
