"""Decoded CAN signals of one machine to its messages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from backend.errors import InputError
from backend.fusion.plausible import MAX_JOINT_RATE
from backend.machine.sun_map import from_sun_angles
from backend.shell.session.can_map import CYLINDERS, Machine, Signal, to_si
from backend.shell.session.format import Message
from backend.shell.session.pose_messages import PoseMessages
from backend.site.site import Site

MAX_ROD_RATE = 2.0  # of a cylinder [m/s]
_SHORTEST = 0.005  # [s] between two values of a signal, for rates
_ANGLES = ("pitch", "roll", "heading")


class Gate:
    """Keeps single values out that would need a speed no machine has.

    A value that is far from the last one is kept out; the next one that agrees with it is taken,
    so that a real step costs one value.
    """

    def __init__(self, max_rate: float) -> None:
        self._max_rate = max_rate
        self._last: tuple[float, float] | None = None
        self._doubted: tuple[float, float] | None = None

    def passes(self, time: float, value: float) -> bool:
        """time [s]; value [rad, or m below half a turn]."""
        near = any(
            self._near(known, time, value)
            for known in (self._last, self._doubted)
            if known is not None
        )
        if self._last is None or near:
            self._last, self._doubted = (time, value), None
            return True
        self._doubted = (time, value)
        return False

    def _near(self, known: tuple[float, float], time: float, value: float) -> bool:
        allowed = self._max_rate * max(time - known[0], _SHORTEST)
        return abs(math.remainder(value - known[1], math.tau)) <= allowed


class MachineStreams:
    """Gathers what arrives frame by frame: a message goes out when all its signals are there.

    Joints that come in frames of their own are told together, at the time of the last of them.
    Raises InputError for the stroke of a cylinder that the machine's sidecar does not describe.
    """

    def __init__(self, machine: Machine, site: Site) -> None:
        self._machine = machine
        self._encode = PoseMessages(site, machine.name)
        known = [name for stroke in self._encode.machine.strokes for name in stroke.names]
        for name in machine.joints:
            if name in CYLINDERS and name not in known:
                allowed = ", ".join(known) or "angles only"
                raise InputError(
                    f'machine "{machine.name}": joints.{name} is no cylinder of its sidecar; '
                    f"allowed: {allowed}."
                )
        self.signals = {name: s for name, s in machine.signals.items() if s.signal is not None}
        self._values = {
            name: to_si(name, signal, signal.constant)
            for name, signal in machine.signals.items()
            if signal.constant is not None
        }
        position = ("latitude", "longitude", "altitude")
        groups = (tuple(machine.joints), ("pitch", "roll"), position, ("heading",))
        self._groups = [
            (tuple(name for name in group if name in self.signals), set[str]()) for group in groups
        ]
        self._gates = {
            name: Gate(_rate(name, signal))
            for name, signal in self.signals.items()
            if name in machine.joints or name in _ANGLES
        }

    def update(self, time: int, name: str, raw: float) -> tuple[bool, Iterator[Message]]:
        """Whether the value is taken, and the messages that are complete with it.

        time: [ns since 1970]; raw: as the DBC decodes it. A value that is not finite, or an
        outlier, is not taken.
        """
        value = to_si(name, self.signals[name], raw)
        gate = self._gates.get(name)
        if not math.isfinite(value) or (gate and not gate.passes(time / 1e9, value)):
            return False, iter(())
        self._values[name] = value
        return True, self._completed(time, name)

    def _completed(self, time: int, name: str) -> Iterator[Message]:
        for needed, seen in self._groups:
            if name not in needed:
                continue
            seen.add(name)
            if len(seen) == len(needed):
                seen.clear()
                yield self._message(time, name)

    def _message(self, time: int, name: str) -> Message:
        values, encode, machine = self._values, self._encode, self._machine
        if name in machine.joints:
            return encode.joints(time, self._joints())
        if name in ("pitch", "roll"):
            return encode.tilt(time, values.get("pitch", 0.0), values.get("roll", 0.0))
        if name == "heading":
            sigma = math.radians(machine.sigma_heading_deg)
            return encode.heading_sensor(time, values["heading"], sigma)
        altitude = values.get("altitude", encode.ground_altitude())
        return encode.antenna(
            time, values["latitude"], values["longitude"], altitude, machine.sigma_position
        )

    def _joints(self) -> Mapping[str, float]:
        joints = {role: self._values[role] for role in self._machine.joints}
        if self._machine.angles == "sun":
            arm = ("boom", "stick", "bucket")
            theta = np.array([joints[role] for role in arm])
            own = from_sun_angles(self._encode.machine, theta).tolist()
            joints |= dict(zip(arm, own, strict=True))
        return joints


def _rate(name: str, signal: Signal) -> float:
    """The fastest believable change [rad/s, m/s]; a factor and an offset are no part of it."""
    if signal.max_rate is None:
        return MAX_ROD_RATE if name in CYLINDERS else MAX_JOINT_RATE
    return abs(
        to_si(name, signal.model_copy(update={"offset": 0.0, "factor": 1.0}), signal.max_rate)
    )
