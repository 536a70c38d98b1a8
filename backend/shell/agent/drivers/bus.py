"""A machine on a CAN bus, by the frames of scenes/can/agent.dbc or of a file like it."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import cantools.database
import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.shell.agent.drivers.driver import Reading
from backend.spatial.types import Array

DBC = Path(__file__).resolve().parents[4] / "scenes" / "can" / "agent.dbc"
COMMANDS = ("JointVelocities", "TrackSpeeds")
STATES = ("JointPositions", "JointRates")
MOST_FRAMES = 1000  # taken in one `read`: a babbling node must not hold up the agent


class CanDriver:
    """clock: what readings are told by [s]. The bus is python-can's; this closes it."""

    def __init__(
        self, machine: Machine, bus: Any, clock: Callable[[], float], dbc: Path = DBC
    ) -> None:
        self._roles = [joint.role for joint in machine.joints]
        self._swing = machine.joints[0].continuous
        self._bus, self._clock = bus, clock
        self._database = _database(dbc, self._roles)
        self._ids = {self._database.get_message_by_name(n).frame_id: n for n in STATES}
        self._counter = 0
        self._values: dict[str, Array] = {}
        self._reading: Reading | None = None
        self._turns = 0.0
        self.malformed = 0

    def read(self) -> Reading | None:
        for _ in range(MOST_FRAMES):
            frame = self._bus.recv(timeout=0.0)
            if frame is None:
                break
            name = self._ids.get(frame.arbitration_id)
            if name is not None and not frame.is_error_frame:
                self._take(name, frame)
        return self._reading

    def write(self, joints: Array, tracks: Array) -> None:
        self._send(joints, tracks, enable=True)

    def stop(self) -> None:
        self._send(np.zeros(len(self._roles)), np.zeros(2), enable=False)

    def close(self) -> None:
        try:
            self.stop()
        finally:
            self._bus.shutdown()

    def _take(self, name: str, frame: Any) -> None:
        """Positions and rates that belong together become a reading."""
        try:
            decoded = self._database.decode_message(name, bytes(frame.data))
            values = np.array([float(decoded[role]) for role in self._roles])
        except (KeyError, ValueError, cantools.database.DecodeError):
            self.malformed += 1
            return
        self._values[name] = values
        if set(self._values) == set(STATES):
            q = self._unwrapped(self._values["JointPositions"])
            self._reading = Reading(q, self._values["JointRates"], self._clock())
            self._values = {}

    def _unwrapped(self, q: Array) -> Array:
        """The swing counted on over whole turns, as the joint goes round for ever."""
        if self._swing:
            before = self._reading.q[0] if self._reading else q[0]
            q = q.copy()
            q[0] = before + math.remainder(q[0] - before, 2.0 * math.pi)
        return q

    def _send(self, joints: Array, tracks: Array, enable: bool) -> None:
        self._counter = (self._counter + 1) % 256
        velocities = {role: float(v) for role, v in zip(self._roles, joints, strict=True)}
        speeds = {
            "left": float(tracks[0]),
            "right": float(tracks[1]),
            "counter": self._counter,
            "enable": int(enable),
        }
        for name, signals in zip(COMMANDS, (velocities, speeds), strict=True):
            message = self._database.get_message_by_name(name)
            frame = can.Message(
                arbitration_id=message.frame_id,
                data=message.encode(signals),
                is_extended_id=message.is_extended_frame,
            )
            self._bus.send(frame, timeout=0.005)


def open_bus(interface: str, channel: str, bitrate: int) -> Any:
    """A python-can bus. Raises InputError when it cannot be opened."""
    try:
        return can.Bus(interface=interface, channel=channel, bitrate=bitrate)
    except (can.CanError, OSError, ValueError, ImportError) as error:
        raise InputError(f"CAN {interface} {channel}: cannot be opened: {error}") from None


def _database(path: Path, roles: list[str]) -> Any:
    """The frames of a DBC file. Raises InputError where they do not fit the machine."""
    try:
        database = cantools.database.load_file(str(path))
    except (OSError, cantools.database.UnsupportedDatabaseFormatError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a readable DBC file: {error}") from None
    wanted = {
        "JointVelocities": set(roles),
        "TrackSpeeds": {"left", "right", "counter", "enable"},
        "JointPositions": set(roles),
        "JointRates": set(roles),
    }
    for name, signals in wanted.items():
        try:
            message = database.get_message_by_name(name)
        except KeyError:
            raise InputError(f"{path}: there is no message {name}") from None
        if {signal.name for signal in message.signals} != signals:
            raise InputError(f"{path}: {name} must have the signals {', '.join(sorted(signals))}")
    return database
