"""A recorded snapshot document as the snapshot that it was, so that every view can show it.

Bodies are placed anew from the recorded poses. What a document does not hold (velocity of the base,
bounds of the clock's offset) is unknown: NaN or None.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from backend.documents.stability import read_stability
from backend.documents.working_area import read_working_area
from backend.errors import InputError
from backend.fusion.pose import FusedPose, StreamStatus, Validity
from backend.fusion.samples import Fix
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import (
    Freedom,
    GaugeInForce,
    Health,
    ImageStamp,
    MachineMargins,
    MachineState,
    Motion,
    Notice,
    PairDistance,
    Snapshot,
)
from backend.safety.alarms import Alarm
from backend.safety.record import Concern, Evidence, Level
from backend.shell.session.recorded_people import recorded_people
from backend.shell.session.surmounting_message import surmounting_of
from backend.site.gauge_choice import NO_CHOICE, GaugeChoice
from backend.spatial.types import Array

Document = Mapping[str, Any]
NO_CHOICES: Mapping[str, GaugeChoice] = MappingProxyType({})


class NotASnapshot(ValueError):  # noqa: N818 - told to the reader, who skips it
    """A document that is no snapshot of the machines of this site."""


def recorded_snapshot(
    document: Document, config: Config, choices: Mapping[str, GaugeChoice] = NO_CHOICES
) -> Snapshot:
    """The snapshot of a document. Machines that the site does not list are left out.

    choices: of operators about the working gauge that are known, by digest; of another choice
    nothing is known.

    Raises NotASnapshot for what is missing or of the wrong kind.
    """
    try:
        return replace(_snapshot(document, config), gauge=_gauge(document, choices))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, InputError) as error:
        raise NotASnapshot(f"a recorded snapshot cannot be read ({error!r})") from error


def _snapshot(document: Document, config: Config) -> Snapshot:
    known = config.machines
    concerns = tuple(
        _concern(one, known[one["machine"]])
        for one in document.get("concerns", ())
        if one["machine"] in known
    )
    health = document.get("health", {})
    state_time = float(document["state_time"])
    return Snapshot(
        time=float(document["time"]),
        state_time=state_time,
        cycle=int(document["cycle"]),
        mode=str(document["mode"]),
        machines={
            name: _machine(name, document["machines"][name], machine, state_time)
            for name, machine in known.items()
            if name in document["machines"]
        },
        pairs=tuple(
            _pair(pair)
            for pair in document.get("pairs", ())
            if pair["a"] in known and pair["b"] in known
        ),
        concerns=concerns,
        alarms=tuple(
            _alarm(one, concerns, known[one["machine"]], float(document["time"]))
            for one in document.get("alarms", ())
            if one["machine"] in known
        ),
        health=Health(
            malformed=dict(health.get("malformed", {})),
            foreign=dict(health.get("foreign", {})),
            lost=int(health.get("lost", 0)),
            images={key: _image(key, one) for key, one in document.get("images", {}).items()},
        ),
        margins={
            name: _margins(name, one, known[name])
            for name, one in document.get("margins", {}).items()
            if name in known
        },
        notices=tuple(Notice(**notice) for notice in document.get("notices", ())),
        stability={
            name: read_stability(one)
            for name, one in document.get("stability", {}).items()
            if name in known
        },
        surmounting={
            name: surmounting_of(one)
            for name, one in document.get("surmounting", {}).items()
            if name in known
        },
        people=recorded_people(document.get("people"), float(document["time"]), config),
    )


def _gauge(document: Document, choices: Mapping[str, GaugeChoice]) -> GaugeInForce:
    told = document.get("gauge", {})
    own_tracks = told.get("own_tracks", {})
    return GaugeInForce(
        choices.get(str(told.get("choice")), NO_CHOICE),
        {str(name): tuple(str(track) for track in on) for name, on in own_tracks.items()},
    )


def _machine(name: str, one: Document, machine: Machine, state_time: float) -> MachineState:
    roles = [joint.role for joint in machine.joints]
    source = str(one["age_source"])
    pose = FusedPose(
        machine=name,
        time=state_time,
        validity=Validity(one["validity"]),
        reasons=tuple(one["reasons"]),
        position=_array(one["position"]),
        yaw=_number(one["yaw"]),
        pitch=_number(one["pitch"]),
        roll=_number(one["roll"]),
        joints=_array([one["joints"][role] for role in roles]),
        joint_velocities=_array([one["joint_velocities"][role] for role in roles]),
        base_velocity=np.full(3, math.nan),
        sigma_position=_number(one["sigma"]["position"], math.inf),
        sigma_yaw=_number(one["sigma"]["yaw"], math.inf),
        sigma_joints=_number(one["sigma"]["joints"], math.inf),
        fix=Fix(one["fix"]),
        streams={
            stream: StreamStatus(
                _number(age, math.inf),
                float(one["rates"][stream]),
                source,
                int(one["received"][stream]),
                int(one["rejected"][stream]),
            )
            for stream, age in one["ages"].items()
        },
        clock_offset=None,
    )
    body = None
    if one.get("end_point") is not None:
        body = place(machine, pose.joints, base_transform(pose))
    area = read_working_area(one.get("working_area"))
    return MachineState(pose=pose, body=body, eta=_number(one["eta"], math.inf), area=area)


def _pair(one: Document) -> PairDistance:
    distance, least = _number(one["distance"]), _number(one["at_least"])
    return PairDistance(
        a=one["a"],
        b=one["b"],
        body_a=one["body_a"],
        body_b=one["body_b"],
        distance=distance if math.isnan(least) else least,
        points=None if one["points"] is None else _array(one["points"]),
        reason=one["reason"],
        checked=int(one["checked"]),
        near=math.isnan(least),
        approach=_number(one["approach"]),
    )


def _margins(name: str, one: Document, machine: Machine) -> MachineMargins:
    motion = one["motion"]
    return MachineMargins(
        machine=name,
        eta=_number(one["eta"]),
        reason=one["reason"],
        joints=tuple(
            (
                _freedom(one["joints"][j.role]["negative"]),
                _freedom(one["joints"][j.role]["positive"]),
            )
            for j in machine.joints
            if j.role in one["joints"]
        ),
        motion=None
        if motion is None
        else Motion(_number(motion["free"], math.inf), motion["own"], motion["hits"]),
    )


def _freedom(one: Document) -> Freedom:
    numbers = ("free", "time_now", "time_full", "stop_now", "stop_full")
    return Freedom(
        own=one["own"], hits=one["hits"], **{k: _number(one[k], math.inf) for k in numbers}
    )


def _concern(one: Document, machine: Machine) -> Concern:
    evidence = one["evidence"]
    allowed = [one["allowed"][joint.role] for joint in machine.joints]
    return Concern(
        name=one["name"],
        machine=one["machine"],
        level=Level[one["level"]],
        reason=one["reason"],
        allowed=_array([[a["negative"], a["positive"]] for a in allowed]).reshape(-1, 2),
        travel=_array([one["travel"]["backward"], one["travel"]["forward"]]),
        evidence=None
        if evidence is None
        else Evidence(
            own=evidence["own"],
            other=evidence["other"],
            distance=_number(evidence["distance"]),
            points=None if evidence["points"] is None else _array(evidence["points"]),
            time_to_contact=_number(evidence["time_to_contact"], math.inf),
        ),
        time=float(one["time"]),
    )


def _alarm(one: Document, concerns: tuple[Concern, ...], machine: Machine, now: float) -> Alarm:
    """The alarm with the concern that raised it; one that lingers has only its words left."""
    level = Level[one["level"]]
    for concern in concerns:
        if (concern.name, concern.machine, concern.level) == (one["name"], one["machine"], level):
            break
    else:
        unlimited = np.ones((len(machine.joints), 2)), np.ones(2)
        words = str(one["line"]).removeprefix(f"{level.name} · ")
        concern = Concern(one["name"], one["machine"], level, words, *unlimited, None, now)
    return Alarm(concern, float(one["since"]), concern.time, bool(one["active"]))


def _image(key: str, one: Document) -> ImageStamp:
    kind, _, name = key.partition(" ")
    times = (float(one[k]) for k in ("state_time", "ready_time", "seconds"))
    return ImageStamp(name, kind, *times)


def _number(value: float | None, unknown: float = math.nan) -> float:
    """JSON has no word for NaN and infinity: null may stand for either."""
    return unknown if value is None else float(value)


def _array(values: Any) -> Array:
    return np.array(values, dtype=np.float64)
