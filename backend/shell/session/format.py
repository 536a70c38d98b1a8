"""What a recorded session is: an MCAP file, or a folder of consecutive ones.

Messages from the wire are recorded byte by byte as they arrived: ROS 2 types in CDR on the topic
`/` + key, so that Foxglove, PlotJuggler, `ros2 bag` and `rosbags` read them. What is ours is JSON
with a JSON Schema, on topics below `/cockpit`. A file's profile is "ros2"; chunks are compressed.

Time. log_time and publish_time are [ns] since 1970 by one clock that never jumps: the local
monotonic clock, plus an offset that is fixed when a recording begins (`Header.offset`). A float
time t [s] of the monotonic clock becomes `stamp(t)` and comes back bit by bit by `seconds(...)`,
so that a replay sees exactly what the live pipeline saw.

Order. The messages that a cycle of the pipeline consumed stand before the `/cockpit/cycle`
message of that cycle, what operators chose of the working gauge among them: it is written when it
changes and once a second, so that whoever plays a part of a recording knows it within a second. A
replay hands them to the pipeline in just these portions; a recording without cycles (of a ROS 2
machine) is replayed in portions of one period.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from typing import Any

from backend.errors import InputError

FORMAT = 1
PROFILE = "ros2"
CHUNK_BYTES = 64 * 1024
METADATA = "cockpit"  # name of the metadata record, the first after the file's header

OWN = "/cockpit/"
CYCLE, CLOCK, SNAPSHOT = "/cockpit/cycle", "/cockpit/clock", "/cockpit/snapshot"
ALARM, ACTION, MARKER = "/cockpit/alarm", "/cockpit/action", "/cockpit/marker"
GAUGE = "/cockpit/gauge"
PEOPLE = "/cockpit/people"

_NUMBER, _TEXT, _COUNT = {"type": "number"}, {"type": "string"}, {"type": "integer", "minimum": 0}
_COUNTS = {
    "type": "array",
    "items": {"type": "array", "prefixItems": [_TEXT, _COUNT], "minItems": 2, "maxItems": 2},
}


def _object(title: str, required: dict[str, Any], optional: dict[str, Any]) -> dict[str, Any]:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "type": "object",
        "properties": {**required, **optional},
        "required": list(required),
    }


SCHEMAS: dict[str, dict[str, Any]] = {
    # time: of the cycle; counts as in pipeline.records.Inputs; surmounting: by machine
    CYCLE: _object(
        "Cycle",
        {"cycle": _COUNT, "time": _NUMBER},
        {
            "images": {"type": "array", "items": {"type": "object"}},
            "malformed": _COUNTS,
            "foreign": _COUNTS,
            "lost": _COUNT,
            "notices": {"type": "array", "items": {"type": "object"}},
            "driven": {"type": "array", "items": {"type": "string"}},
            "surmounting": {"type": "object"},
        },
    ),
    # one round trip to a machine's clock: local, remote, local [s]
    CLOCK: _object(
        "ClockRoundTrip",
        {"machine": _TEXT, "sent": _NUMBER, "remote": _NUMBER, "received": _NUMBER},
        {},
    ),
    # what operators chose of the working gauge, when it changed and once a second, site frame [m]
    GAUGE: _object("GaugeChoice", {"drawn": {"type": "array"}, "switched": {"type": "object"}}, {}),
    # what the LiDARs' process told: tracks of people and objects, site frame [m], local times [s]
    PEOPLE: _object(
        "People",
        {"time": _NUMBER, "ready": _NUMBER, "sensors": {"type": "array"}, "id": {"type": "array"}},
        {
            name: {"type": "array"}
            for name in ("status", "state", "cov", "ahead", "ahead_cov", "last_seen", "lost")
        },
    ),
    SNAPSHOT: _object("Snapshot", {"time": _NUMBER, "cycle": _COUNT, "machines": {}}, {}),
    ALARM: _object("Alarms", {"alarms": {"type": "array"}}, {}),
    # what an operator did on a page
    ACTION: _object("Action", {"action": _TEXT}, {"page": _TEXT, "details": {"type": "object"}}),
    # kind: "note", "near miss", "pin"; text: in an operator's words; details: of a near miss
    MARKER: _object(
        "Marker", {"kind": _TEXT, "text": _TEXT}, {"machine": _TEXT, "details": {"type": "object"}}
    ),
}
"""JSON Schema of every topic of ours."""


@dataclass(frozen=True)
class Header:
    """What a file says of itself, in its metadata record. All values travel as text.

    offset: [ns] from the monotonic clock to 1970; part: number of this file in its recording, from
    0; recording: the same text in all parts; site_file: path, site: its text (TOML); own: machines
    answered for, comma separated; origin: "live", "demo", or what a converted session came from;
    note: what a viewer must know, such as that positions are synthesised.
    """

    offset: int
    recording: str
    part: int
    site_file: str
    site: str
    own: str
    origin: str
    software: str
    note: str = ""
    format: int = FORMAT

    def texts(self) -> dict[str, str]:
        """As an MCAP metadata record holds it."""
        return {key: str(value) for key, value in asdict(self).items()}

    @staticmethod
    def read(texts: dict[str, str], where: str) -> Header:
        """From a metadata record. Raises InputError for what is missing, and for future formats."""
        version = texts.get("format", "")
        if not version.isdigit():
            raise InputError(f"{where}: metadata format is {version!r}; allowed is a number.")
        if int(version) > FORMAT:
            raise InputError(
                f"{where}: format {version} is of a newer cockpit; allowed is up to {FORMAT}."
            )
        values: dict[str, Any] = {}
        for field in fields(Header):
            if field.name not in texts:
                if field.name == "note":
                    continue
                raise InputError(f"{where}: metadata has no {field.name!r}.")
            text = texts[field.name]
            try:
                values[field.name] = int(text) if field.type == "int" else text
            except ValueError:
                raise InputError(
                    f"{where}: metadata {field.name} is {text!r}; allowed is a whole number."
                ) from None
        return Header(**values)


@dataclass(frozen=True)
class Message:
    """One recorded message. time: log_time [ns since 1970]; topic: with its leading slash."""

    topic: str
    time: int
    data: bytes


def stamp(time: float, offset: int) -> int:
    """[ns since 1970] of `time` [s] on the monotonic clock.

    After weeks that clock's float is coarser than a nanosecond, and the product is rounded once
    more: the nearest neighbour that gives `time` again is taken.
    """
    near = round(time * 1e9)
    for away in range(17):
        for count in (near + away, near - away):
            if count / 1e9 == time:
                return count + offset
    return near + offset


def seconds(log_time: int, offset: int) -> float:
    """`time` [s] on the monotonic clock, exactly as it was: that clock counts whole nanoseconds."""
    return (log_time - offset) / 1e9


def dumps(document: dict[str, Any]) -> bytes:
    """JSON with numbers that come back bit by bit."""
    return json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode()
