"""What happened in a session, for its timeline."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.safety import words
from backend.shell.session.format import ACTION, MARKER
from backend.shell.session.reader import Session
from backend.shell.session.series import Series

NEAR_MISS = "near miss"
MOST = 5000
APART = 2.0  # near misses closer than this in time are one [s]


@dataclass(frozen=True)
class Event:
    """kind: "alarm", "note", "near miss", "pin", "action" or "gap"; start, end: [ns]."""

    kind: str
    level: str | None
    machine: str | None
    text: str
    start: int
    end: int | None


@dataclass
class Alarms:
    """Follows alarms as they come, change and go; each level of an alarm is an event."""

    events: list[Event] = field(default_factory=list)
    _open: dict[tuple[str, str], Event] = field(default_factory=dict)

    def at(self, time: int, alarms: Iterable[tuple[str, str, str, str]]) -> None:
        """All active alarms at `time` [ns]: machine, name, level, line."""
        present = {(machine, name): (level, line) for machine, name, level, line in alarms}
        for key, event in list(self._open.items()):
            if key not in present or present[key][0] != event.level:
                self.events.append(replace(event, end=time))
                del self._open[key]
        for key, (level, line) in present.items():
            if key not in self._open:
                self._open[key] = Event("alarm", level, key[0], line, time, None)

    def close(self, time: int) -> list[Event]:
        """All events at the session's end [ns]."""
        self.at(time, ())
        return self.events


def alarms_of_document(document: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """Of a document with "alarms"; those that are not yet past their on-delay are left out."""
    return [
        (one["machine"], one["name"], one["level"], one["line"])
        for one in document["alarms"]
        if one["active"]
    ]


def alarms_of_snapshot(snapshot: Snapshot, config: Config) -> list[tuple[str, str, str, str]]:
    return [
        (
            alarm.concern.machine,
            alarm.concern.name,
            alarm.concern.level.name,
            words.line(alarm.concern, config.labels),
        )
        for alarm in snapshot.alarms
        if alarm.active
    ]


def spoken(topic: str, document: Mapping[str, Any], time: int) -> Event | None:
    """The event of a marker or an operator's action."""
    if topic == MARKER:
        machine = document.get("machine")
        return Event(str(document["kind"]), None, machine, str(document["text"]), time, None)
    if topic == ACTION:
        details = document.get("details") or {}
        shown = ", ".join(f"{key} {value}" for key, value in list(details.items())[:4])
        text = f"{document['action']}: {shown}" if shown else str(document["action"])
        return Event("action", None, details.get("machine"), text[:200], time, None)
    return None


def gaps(session: Session) -> list[Event]:
    return [
        Event(
            "gap", None, None, f"nothing was recorded for {(end - start) / 1e9:.1f} s", start, end
        )
        for start, end in session.gaps
    ]


def near_misses(series: Series, below: float) -> list[Event]:
    """The smallest clearance of each time that two machines were closer than `below` [m]."""
    found = []
    for key, column in series.columns.items():
        if key[0] != "clearance":
            continue
        indices = np.flatnonzero(column < below)
        if not len(indices):
            continue
        times = series.times[indices]
        groups = np.split(indices, np.flatnonzero(np.diff(times) > APART * 1e9) + 1)
        for group in groups:
            least = int(group[np.argmin(column[group])])
            text = f"{key[1].replace('|', ' and ')}: {max(float(column[least]), 0.0):.2f} m"
            at = int(series.times[least])
            found.append(Event(NEAR_MISS, None, key[1].partition("|")[0], text, at, None))
    return found


def ordered(events: Iterable[Event]) -> list[Event]:
    """By start, at most MOST of them; alarms give way last."""
    chosen = list(events)
    if len(chosen) > MOST:
        chosen.sort(key=lambda event: event.kind == "action")
        chosen = chosen[:MOST]
    return sorted(chosen, key=lambda event: event.start)


def event_document(event: Event, begin: int) -> dict[str, Any]:
    """What backend.documents.session.EventModel describes; times [s] since `begin` [ns]."""
    return {
        "kind": event.kind,
        "level": event.level,
        "machine": event.machine,
        "text": event.text,
        "start": (event.start - begin) / 1e9,
        "end": None if event.end is None else (event.end - begin) / 1e9,
    }
