"""A snapshot as JSON, for the page, the API, other hosts and recordings."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from backend.documents.people_document import people_document
from backend.documents.stability import stability_document
from backend.documents.working_area import working_area_document
from backend.machine.model import Machine
from backend.machine.outline import outlines_of
from backend.machine.sun_map import sun_angles
from backend.pipeline.config import Config
from backend.pipeline.records import (
    Freedom,
    MachineMargins,
    MachineState,
    PairDistance,
    Snapshot,
)
from backend.safety import words
from backend.safety.alarms import Alarm
from backend.safety.record import Concern


def snapshot_document(snapshot: Snapshot, config: Config) -> dict[str, Any]:
    """Plain numbers, texts, lists and dicts; NaN and infinity where a value does not exist."""
    return {
        "time": snapshot.time,
        "state_time": snapshot.state_time,
        "cycle": snapshot.cycle,
        "mode": snapshot.mode,
        "machines": {
            name: machine_document(state, config.machines[name], config)
            for name, state in snapshot.machines.items()
        },
        "pairs": [_pair(pair) for pair in snapshot.pairs],
        "margins": {
            name: _margins(margins, config.machines[name])
            for name, margins in snapshot.margins.items()
        },
        "concerns": [_concern(c, config.machines[c.machine]) for c in snapshot.concerns],
        "alarms": [_alarm(alarm, config) for alarm in snapshot.alarms],
        "notices": [
            {"key": notice.key, "line": notice.line, "since": notice.since}
            for notice in snapshot.notices
        ],
        "gauge": {
            "choice": snapshot.gauge.choice.digest,
            "own_tracks": {name: list(on) for name, on in snapshot.gauge.own_tracks.items()},
        },
        "people": None
        if snapshot.people is None
        else people_document(snapshot.people, snapshot.time),
        "stability": {
            name: stability_document(found) for name, found in snapshot.stability.items()
        },
        **_surmounting(snapshot),
        "images": {
            key: {
                "state_time": stamp.state_time,
                "ready_time": stamp.ready_time,
                "seconds": stamp.seconds,
            }
            for key, stamp in snapshot.health.images.items()
        },
        "health": {
            "malformed": snapshot.health.malformed,
            "foreign": snapshot.health.foreign,
            "lost": snapshot.health.lost,
        },
    }


def _surmounting(snapshot: Snapshot) -> dict[str, Any]:
    """What machines climb by plan, where any does."""
    if not snapshot.surmounting:
        return {}
    return {"surmounting": {name: asdict(one) for name, one in snapshot.surmounting.items()}}


def machine_document(state: MachineState, machine: Machine, config: Config) -> dict[str, Any]:
    """One machine. Site frame in metres, radians; ages in seconds."""
    pose = state.pose
    roles = [joint.role for joint in machine.joints]
    document: dict[str, Any] = {
        "label": config.labels[pose.machine],
        "model": machine.name,
        "validity": pose.validity.value,
        "reasons": list(pose.reasons),
        "position": pose.position.tolist(),
        "position_projected": config.frame.to_projected(pose.position).tolist(),
        "yaw": pose.yaw,
        "pitch": pose.pitch,
        "roll": pose.roll,
        "joints": dict(zip(roles, pose.joints.tolist(), strict=True)),
        "joint_velocities": dict(zip(roles, pose.joint_velocities.tolist(), strict=True)),
        "sigma": {
            "position": pose.sigma_position,
            "yaw": pose.sigma_yaw,
            "joints": pose.sigma_joints,
        },
        "eta": state.eta,
        "ages": {name: stream.age for name, stream in pose.streams.items()},
        "rates": {name: stream.rate for name, stream in pose.streams.items()},
        "received": {name: stream.received for name, stream in pose.streams.items()},
        "rejected": {name: stream.rejected for name, stream in pose.streams.items()},
        "age_source": _age_source(state),
        "fix": pose.fix.value,
        "max_reach": machine.max_reach,
        "working_area": working_area_document(state.area),
    }
    if state.body is not None:
        outlines = outlines_of(machine, state.body.boxes)
        angles = sun_angles(machine, pose.joints)
        document |= {
            "swing_center": state.body.swing_center.tolist(),
            "end_point": state.body.end_point.tolist(),
            "azimuth": state.body.azimuth,
            "reach": state.body.reach,
            "sun": dict(zip(("boom", "stick", "bucket"), angles.tolist(), strict=True)),
            "outlines": {part: np.round(xy, 3).tolist() for part, xy in outlines.items()},
        }
    return document


def _age_source(state: MachineState) -> str:
    sources = {s.age_source for s in state.pose.streams.values() if math.isfinite(s.age)}
    return "arrival" if "arrival" in sources or not sources else "offset"


def _pair(pair: PairDistance) -> dict[str, Any]:
    return {
        "a": pair.a,
        "b": pair.b,
        "body_a": pair.body_a,
        "body_b": pair.body_b,
        "distance": pair.distance if pair.near else math.nan,
        "at_least": math.nan if pair.near else pair.distance,
        "points": None if pair.points is None else pair.points.tolist(),
        "reason": pair.reason,
        "approach": pair.approach,
        "checked": pair.checked,
    }


def _margins(margins: MachineMargins, machine: Machine) -> dict[str, Any]:
    motion = margins.motion
    return {
        "eta": margins.eta,
        "reason": margins.reason,
        "joints": {
            joint.role: {"negative": _freedom(negative), "positive": _freedom(positive)}
            for joint, (negative, positive) in zip(machine.joints, margins.joints, strict=False)
        },
        "motion": None
        if motion is None
        else {"free": motion.free, "own": motion.own, "hits": motion.hits},
    }


def _freedom(freedom: Freedom) -> dict[str, Any]:
    return {
        "free": freedom.free,
        "own": freedom.own,
        "hits": freedom.hits,
        "time_now": freedom.time_now,
        "time_full": freedom.time_full,
        "stop_now": freedom.stop_now,
        "stop_full": freedom.stop_full,
        "can_stop": freedom.can_stop,
    }


def _concern(concern: Concern, machine: Machine) -> dict[str, Any]:
    evidence = concern.evidence
    names = words.directions(machine)
    return {
        "name": concern.name,
        "machine": concern.machine,
        "level": concern.level.name,
        "reason": concern.reason,
        "time": concern.time,
        "allowed": {
            joint.role: {
                "negative": float(fraction[0]),
                "positive": float(fraction[1]),
                "words": list(names[joint.role]),
            }
            for joint, fraction in zip(machine.joints, concern.allowed, strict=True)
        },
        "travel": {"backward": float(concern.travel[0]), "forward": float(concern.travel[1])},
        "evidence": None
        if evidence is None
        else {
            "own": evidence.own,
            "other": evidence.other,
            "distance": evidence.distance,
            "points": None if evidence.points is None else evidence.points.tolist(),
            "time_to_contact": evidence.time_to_contact,
        },
    }


def _alarm(alarm: Alarm, config: Config) -> dict[str, Any]:
    concern = alarm.concern
    return {
        "level": concern.level.name,
        "name": concern.name,
        "machine": concern.machine,
        "line": words.line(concern, config.labels),
        "detail": words.detail(concern, config.machines[concern.machine], config.labels),
        "since": alarm.since,
        "active": alarm.active,
    }
