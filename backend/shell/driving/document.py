"""What pages are told of driving: who holds which machine, what each seat does, what limits it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from backend.control.latency import Condition
from backend.control.seat import Seat
from backend.machine.model import Machine
from backend.safety.limiter import Decision
from backend.shell.driving.follows import Followed
from backend.shell.driving.leases import Held
from backend.shell.driving.methods import Told
from backend.shell.driving.outlet import TRACKS
from backend.shell.link.messages import AgentStatus

SILENT = 1.0
"""A machine whose agent has not reported for this long has none, as far as is known [s]."""


def machine_document(
    status: AgentStatus | None, held: Held | None, condition: Condition | None, now: float
) -> dict[str, Any]:
    """condition: of the way to the machine, None where no command is sent; now [s]."""
    present = status is not None and now - status.arrival <= SILENT
    known = condition is not None and condition.known
    return {
        "agent": present,
        "mode": status.mode if present and status else None,
        "holder": status.holder if present and status else "",
        "offered_to": held.offered_to if held else "",
        "round_trip": condition.round_trip if known and condition else None,
        "level": condition.level if condition else "unknown",
        "locked": condition.locked if condition else "",
    }


def seat_document(
    name: str,
    seat: Seat,
    held: Mapping[str, Held],
    refused: Mapping[str, str],
    decisions: Mapping[str, tuple[Decision, Told]],
    machines: Mapping[str, Machine],
    follows: Mapping[str, Followed | None],
    unfollowed: Mapping[str, str],
) -> dict[str, Any]:
    """name: of the seat; refused: by machine, what its last request was answered with; decisions:
    by machine, with what the seat's method made of the wish before; follows: by machine, what the
    seat follows with it; unfollowed: by machine, why a trajectory was refused it.
    """
    mine = [machine for machine, lease in held.items() if lease.seat == name]
    return {
        "who": seat.person.who,
        "role": seat.person.role,
        "driven": seat.desk.driven,
        "pattern": seat.setting.pattern.value,
        "fine": seat.setting.fine,
        "method": seat.setting.method.value,
        "override": seat.reason,
        "source": seat.input.source,
        "sticks": vars(seat.input.sticks),
        "consoles": {
            machine: {
                "state": console.state.value,
                "why": console.why,
                "since": console.since if math.isfinite(console.since) else None,
                "held": machine in mine,
                "refused": refused.get(machine, ""),
            }
            for machine, console in seat.desk.consoles.items()
        },
        "decision": {
            machine: decision_document(*decisions[machine], machines[machine])
            for machine in mine
            if machine in decisions
        },
        "follow": {
            machine: follow_document(one, machines[machine])
            for machine, one in follows.items()
            if one is not None
        },
        "follow_refused": {machine: why for machine, why in unfollowed.items() if why},
    }


def follow_document(followed: Followed, machine: Machine) -> dict[str, Any]:
    follow = followed.follow
    errors = [0.0] * len(machine.joints) if follow.error is None else follow.error.tolist()
    return {
        "plan": followed.plan,
        "at": follow.at,
        "duration": follow.trajectory.duration,
        "pace": follow.pace,
        "error": {joint.role: e for joint, e in zip(machine.joints, errors, strict=True)},
        "ended": follow.ended,
        "arrived": follow.arrived,
    }


def decision_document(decision: Decision, told: Told, machine: Machine) -> dict[str, Any]:
    """By motion: joints by role, then the tracks; pairs are (negative, positive)."""
    motions = (*(joint.role for joint in machine.joints), *TRACKS)
    command = [*decision.joints.tolist(), *decision.tracks.tolist()]
    return {
        "locked": decision.locked,
        "fraction": dict(zip(motions, decision.fraction.tolist(), strict=True)),
        "causes": {
            motion: [vars(cause) for cause in pair]
            for motion, pair in zip(motions, decision.causes, strict=True)
        },
        "cut": {motions[k]: cause.reason for k, cause in decision.cut.items()},
        "command": dict(zip(motions, command, strict=True)),
        "method": {
            "name": told.method.value,
            "upper": told.thresholds.upper,
            "lower": told.thresholds.lower,
            "scale": told.scale,
            "why": list(told.why),
            "warnings": list(told.warnings),
        },
    }
