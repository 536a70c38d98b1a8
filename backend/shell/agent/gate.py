"""What a machine obeys: the lease holder's newest command, within the newest motion limits.

A command counts while it is younger than its time-to-live, from its arrival on the machine's own
clock, and at most `TIME_TO_LIVE`. A sequence is never obeyed twice, and only the token of the lease
that is held now. Motion limits are fractions of full speed per direction with a time-to-live of
their own; without fresh ones nothing is known to be free, and everything stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from backend.control.lease import Answer, Lease, Request, ask, fresh
from backend.machine.model import Machine
from backend.shell.link.messages import Command, MotionLimits
from backend.spatial.types import Array

TIME_TO_LIVE = 0.2
"""The longest that one command is obeyed, whatever it says [s]."""
LIMITS_TIME_TO_LIVE = 0.3
"""The longest that motion limits hold, whatever they say [s]."""
TRACKS = ("track_left", "track_right")


@dataclass(frozen=True)
class Gate:
    """command, limits: the newest accepted; heard_at, limits_at: when they arrived [s]; fraction:
    (m, 2) of the limits in the machine's order, (negative, positive); refusals: by reason.
    """

    lease: Lease = field(default_factory=fresh)
    command: Command | None = None
    heard_at: float = -math.inf
    limits: MotionLimits | None = None
    fraction: Array | None = None
    limits_at: float = -math.inf
    accepted: int = 0
    refusals: tuple[tuple[str, int], ...] = ()

    @property
    def refused(self) -> int:
        return sum(count for _, count in self.refusals)

    def obeys(self, now: float) -> bool:
        """Whether there is a command to obey at `now` [s]."""
        said = self.command
        return (
            said is not None
            and now - self.heard_at < min(said.time_to_live, TIME_TO_LIVE)
            and self.lease.admits(said.token, now)
        )

    def limited(self, now: float) -> bool:
        """Whether fresh motion limits of the lease's holder are there."""
        said = self.limits
        return (
            said is not None
            and now - self.limits_at < min(said.time_to_live, LIMITS_TIME_TO_LIVE)
            and self.lease.admits(said.token, now)
        )


def negotiate(gate: Gate, request: Request, now: float) -> tuple[Gate, Answer]:
    """The gate after a lease request, and the answer."""
    lease, answer = ask(gate.lease, request, now)
    return replace(gate, lease=lease), answer


def hear(gate: Gate, command: Command, machine: Machine, now: float) -> Gate:
    """The gate after a command arrived at `now` [s]; refused ones are only counted."""
    last = gate.command
    if not gate.lease.admits(command.token, now):
        old = command.token < gate.lease.token or not gate.lease.held(now)
        return _refuse(gate, "token" if old else "foreign")
    if command.holder != gate.lease.holder:
        return _refuse(gate, "foreign")
    if last is not None and command.token == last.token and command.sequence <= last.sequence:
        return _refuse(gate, "replayed")
    if not _sound(command, machine):
        return _refuse(gate, "unsound")
    return replace(gate, command=command, heard_at=now, accepted=gate.accepted + 1)


def hear_limits(gate: Gate, limits: MotionLimits, machine: Machine, now: float) -> Gate:
    """The gate after motion limits arrived at `now` [s]."""
    last = gate.limits
    if not gate.lease.admits(limits.token, now):
        return _refuse(gate, "token")
    if last is not None and limits.token == last.token and limits.sequence <= last.sequence:
        return _refuse(gate, "replayed")
    fraction = _fractions(limits, machine)
    if fraction is None:
        return _refuse(gate, "unsound")
    return replace(gate, limits=limits, fraction=fraction, limits_at=now)


def demand(
    gate: Gate, machine: Machine, before: tuple[Array, Array], now: float, dt: float
) -> tuple[Array, Array]:
    """(joints (n,) [rad/s], tracks (2,) [m/s]) to ask of the machine at `now` [s].

    before: what was asked of it dt [s] ago. Speeds rise at the actuators' accelerations at most;
    they fall at once, since the machine brakes as fast as it can.
    """
    n = len(machine.joints)
    if not (gate.obeys(now) and gate.limited(now)):
        return np.zeros(n), np.zeros(2)
    assert gate.command is not None
    assert gate.fraction is not None
    joints, tracks = wanted(gate.command, machine)
    asked = np.concatenate([joints, tracks])
    full = np.append(machine.max_velocity, [machine.tracks.max_speed] * 2)
    rise = np.append(machine.max_acceleration, [machine.tracks.max_acceleration] * 2) * dt
    asked = np.clip(asked, -gate.fraction[:, 0] * full, gate.fraction[:, 1] * full)
    last = np.concatenate(before)
    # From a standstill or in the same direction: not faster than last plus what dt allows.
    ahead = np.where(asked * last > 0.0, np.abs(last), 0.0) + rise
    asked = np.sign(asked) * np.minimum(np.abs(asked), ahead)
    return asked[:n], asked[n:]


def wanted(command: Command, machine: Machine) -> tuple[Array, Array]:
    """The velocities of a command in the order of Machine.joints; joints not named stand still."""
    by_name = dict(zip(command.names, command.velocity, strict=True))
    joints = [by_name.get(j.name, by_name.get(j.role, 0.0)) for j in machine.joints]
    return np.array(joints), np.array([command.travel_left, command.travel_right])


def names_of(machine: Machine) -> tuple[str, ...]:
    """(m,) of the motions in the order of their fractions: joints, then tracks."""
    return (*(joint.name for joint in machine.joints), *TRACKS)


def _fractions(limits: MotionLimits, machine: Machine) -> Array | None:
    """(m, 2); what is not named stands still. None for limits that make no sense."""
    values = np.stack([limits.negative, limits.positive], axis=1)
    roles = {joint.role: joint.name for joint in machine.joints}
    names = [roles.get(name, name) for name in limits.names]
    known = names_of(machine)
    sound = (
        0.0 < limits.time_to_live < math.inf
        and set(names) <= set(known)
        and len(set(names)) == len(names)
        and bool(((values >= 0.0) & (values <= 1.0)).all())
    )
    if not sound:
        return None
    fraction = np.zeros((len(known), 2))
    for name, pair in zip(names, values, strict=True):
        fraction[known.index(name)] = pair
    return fraction


def _sound(command: Command, machine: Machine) -> bool:
    known = {joint.name for joint in machine.joints} | {joint.role for joint in machine.joints}
    travel = (command.travel_left, command.travel_right)
    return (
        0.0 < command.time_to_live < math.inf
        and set(command.names) <= known
        and bool(np.isfinite(command.velocity).all())
        and all(math.isfinite(value) for value in travel)
    )


def _refuse(gate: Gate, reason: str) -> Gate:
    counts = dict(gate.refusals)
    counts[reason] = counts.get(reason, 0) + 1
    return replace(gate, refusals=tuple(counts.items()))
