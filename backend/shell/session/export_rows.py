"""The tables of an export: columns with their units, and the rows of one snapshot document."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import pyarrow as pa

from backend.machine.model import ROLES
from backend.safety.record import Level
from backend.shell.session.format import stamp

_F, _S, _I = pa.float64(), pa.string(), pa.int64()

POSES: dict[str, tuple[Any, str, str]] = {
    "time_ns": (_I, "ns", "of the pose, since 1970"),
    "elapsed_s": (_F, "s", "since the session begins"),
    "machine": (_S, "", "name in the site file"),
    "validity": (_S, "", "VALID, STALE or UNKNOWN"),
    **{f"{role}_rad": (_F, "rad", f"joint value of the {role}, the URDF's own") for role in ROLES},
    "easting_m": (_F, "m", "of the base (URDF root), in the site's projected CRS"),
    "northing_m": (_F, "m", "of the base, in the site's projected CRS"),
    "height_m": (_F, "m", "of the base, in the site's projected CRS"),
    "yaw_rad": (_F, "rad", "of the tracks, counter-clockwise from grid east"),
    "pitch_rad": (_F, "rad", "positive raises the front"),
    "roll_rad": (_F, "rad", "about the forward axis"),
    "sigma_position_m": (_F, "m", "standard deviation of each coordinate of the base"),
    "sigma_yaw_rad": (_F, "rad", "standard deviation of the yaw"),
    "sigma_joints_rad": (_F, "rad", "standard deviation of each joint value"),
    "eta_m": (_F, "m", "inflation of the bodies"),
    "fix": (_S, "", "quality of the GNSS position"),
}
"""Column -> type, unit, what it is. `cockpit convert` reads this table back."""

CLEARANCES: dict[str, tuple[Any, str, str]] = {
    "time_ns": (_I, "ns", "of the poses, since 1970"),
    "elapsed_s": (_F, "s", "since the session begins"),
    "a": (_S, "", "one machine"),
    "b": (_S, "", "the other"),
    "distance_m": (_F, "m", "of the closest bodies as built, negative on overlap; empty: unknown"),
    "at_least_m": (_F, "m", "lower bound where they are too far apart to be measured"),
    "approach_m_per_s": (_F, "m/s", "closing speed"),
    "body_a": (_S, "", "closest body of a"),
    "body_b": (_S, "", "closest body of b"),
    "level_a": (_S, "", "worst level of any concern of a"),
    "level_b": (_S, "", "worst level of any concern of b"),
    "reason": (_S, "", "why the distance is unknown"),
}
ALARMS: dict[str, tuple[Any, str, str]] = {
    "time_ns": (_I, "ns", "when it came, since 1970"),
    "elapsed_s": (_F, "s", "since the session begins"),
    "duration_s": (_F, "s", "until it went, or changed its level"),
    "machine": (_S, "", "name in the site file"),
    "concern": (_S, "", "what it is about"),
    "level": (_S, "", "SLOW, STOP or UNKNOWN"),
    "line": (_S, "", "as the operator read it first"),
}
TABLES = {"poses": POSES, "clearances": CLEARANCES, "alarms": ALARMS}

_RANK = {level.name: level.value for level in Level}


class Rows:
    """Snapshot documents, in order, to rows. begin, offset [ns]: of the session."""

    def __init__(self, begin: int, offset: int) -> None:
        self._begin = begin
        self._offset = offset
        self._alarms: dict[tuple[str, str], dict[str, Any]] = {}
        self._last = begin

    def of(
        self, document: Mapping[str, Any], fallback: int
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """(table, row) of one document. fallback: its message's time [ns]."""
        time = self._time(document.get("state_time"), fallback)
        for name, machine in document.get("machines", {}).items():
            yield "poses", self._at(time) | _pose(name, machine)
        levels = _levels(document.get("concerns", ()))
        for pair in document.get("pairs", ()):
            yield "clearances", self._at(time) | _clearance(pair, levels)
        yield from self._changed(document, self._time(document.get("time"), fallback))

    def rest(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Alarms that still stood at the end."""
        for row in self._alarms.values():
            yield "alarms", self._ended(row, self._last)
        self._alarms = {}

    def _time(self, value: Any, fallback: int) -> int:
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            return fallback
        time = stamp(value, self._offset)
        # A recording whose clock was set has times of its own.
        return time if abs(time - fallback) < 1_000_000_000 else fallback

    def _at(self, time: int) -> dict[str, Any]:
        return {"time_ns": time, "elapsed_s": (time - self._begin) / 1e9}

    def _changed(
        self, document: Mapping[str, Any], time: int
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        self._last = time
        standing = {(a["name"], a["machine"]): a for a in document.get("alarms", ())}
        for key, row in list(self._alarms.items()):
            alarm = standing.get(key)
            if alarm is None or alarm["level"] != row["level"]:
                yield "alarms", self._ended(self._alarms.pop(key), time)
        for key, alarm in standing.items():
            if key not in self._alarms and alarm.get("active", True):
                row = {"machine": alarm["machine"], "concern": alarm["name"]}
                row |= {"level": alarm["level"], "line": alarm["line"]}
                self._alarms[key] = self._at(time) | row

    @staticmethod
    def _ended(row: dict[str, Any], time: int) -> dict[str, Any]:
        return row | {"duration_s": (time - row["time_ns"]) / 1e9}


def _pose(name: str, machine: Mapping[str, Any]) -> dict[str, Any]:
    """A machine that was never placed has no position and no angles."""
    row = {"machine": name, "validity": machine["validity"], "fix": machine["fix"]}
    if machine.get("swing_center") is None:
        return row
    easting, northing, height = machine["position_projected"]
    row |= {f"{role}_rad": value for role, value in machine["joints"].items()}
    row |= {"easting_m": easting, "northing_m": northing, "height_m": height}
    row |= {f"{angle}_rad": machine[angle] for angle in ("yaw", "pitch", "roll")}
    sigma = machine["sigma"]
    row |= {
        "sigma_position_m": sigma["position"],
        "sigma_yaw_rad": sigma["yaw"],
        "sigma_joints_rad": sigma["joints"],
        "eta_m": machine["eta"],
    }
    return {key: _known(value) for key, value in row.items()}


def _clearance(pair: Mapping[str, Any], levels: Mapping[str, str]) -> dict[str, Any]:
    row = {key: pair[key] for key in ("a", "b", "body_a", "body_b", "reason")}
    row |= {
        "distance_m": pair["distance"],
        "at_least_m": pair["at_least"],
        "approach_m_per_s": pair["approach"],
        "level_a": levels.get(pair["a"]),
        "level_b": levels.get(pair["b"]),
    }
    return {key: _known(value) for key, value in row.items()}


def _levels(concerns: Any) -> dict[str, str]:
    """The worst level of each machine."""
    worst: dict[str, str] = {}
    for concern in concerns:
        machine, level = concern["machine"], concern["level"]
        if machine not in worst or _RANK[level] > _RANK[worst[machine]]:
            worst[machine] = level
    return worst


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
