"""Everything of a running cockpit that is recorded, as records for the feeder.

Callers wait for nothing: see feeder.py for what the disk does.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec

from backend.errors import InputError
from backend.fusion.samples import ClockSample
from backend.pipeline.records import Inputs, Notice, Snapshot
from backend.shell.link.receiver import Heard
from backend.shell.session import ring
from backend.shell.session.feeder import Entry, Feeder
from backend.shell.session.format import (
    ACTION,
    ALARM,
    CLOCK,
    CYCLE,
    GAUGE,
    MARKER,
    PEOPLE,
    SNAPSHOT,
    dumps,
    stamp,
)
from backend.shell.session.keeper import Plan, run
from backend.shell.session.near_miss import NearMiss, NearMisses
from backend.shell.session.people_message import people_message
from backend.site.gauge_choice import as_document

ACTIONS = 50  # recorded in a second, at most
MAX_TEXT = 500  # of a marker
ROTATE = 2.0  # a pin waits so long for its last part to be finished [s]


@dataclass(frozen=True)
class State:
    """state: "on", "off" or "trouble"; text: in words."""

    state: str
    text: str


class Recorder:
    """Records into a plan's folder from `start` until `close`.

    stop_below: distance below which two machines passing each other are a near miss [m]; clock:
    that of the snapshots; target: the writing process's body, for tests.
    """

    wants_everything = True  # that arrives, also what no cycle consumes

    def __init__(
        self,
        plan: Plan,
        stop_below: float,
        clock: Callable[[], float] = time.monotonic,
        target: Callable[[Connection, Plan], None] = run,
    ) -> None:
        self.plan = plan
        self._feeder = Feeder(plan, clock, target)
        self._offset = plan.header.offset
        self._clock = clock
        self._misses = NearMisses(stop_below)
        self._heard: tuple[Heard | ClockSample, ...] = ()
        self._began = ""
        self._alarms = ""
        self._actions = (0, 0)  # of this second

    def hear(self, items: tuple[Heard | ClockSample, ...]) -> None:
        """What arrived for the next cycle; called by the fast loop."""
        self._heard += items

    def after_cycle(self, inputs: Inputs, snapshot: Snapshot) -> None:
        """A cycle, after all that it consumed; called by the fast loop."""
        offset = self._offset
        entries: list[Entry] = []
        for item in self._heard:
            if isinstance(item, ClockSample):
                entries.append((CLOCK, "", stamp(item.received, offset), _clock_text(item)))
            else:
                at = stamp(item.arrival, offset)
                entries.append(("/" + item.key, item.row.type, at, item.payload))
        self._heard = ()
        if inputs.gauge is not None:
            chosen = dumps(as_document(inputs.gauge))
            entries.append((GAUGE, "", stamp(snapshot.time, offset), chosen))
        if inputs.people is not None:
            told = msgspec.json.encode(people_message(inputs.people))
            entries.append((PEOPLE, "", stamp(snapshot.time, offset), told))
        entries.append((CYCLE, "", stamp(snapshot.time, offset), _cycle_text(inputs, snapshot)))
        self._feeder.put(entries)
        for miss in self._misses.update(snapshot):
            self._mark_miss(miss)

    def notices(self) -> tuple[Notice, ...]:
        """What operators must know of the recording; empty while all is well."""
        line = self._feeder.line()
        return (Notice("recording", f"RECORDING · {line}"),) if line else ()

    def snapshot(self, text: str, at: float) -> None:
        """A snapshot's JSON as published. at: its time [s]."""
        self._feeder.put([(SNAPSHOT, "", stamp(at, self._offset), text.encode())])

    def alarms(self, text: str, at: float) -> None:
        """The JSON list of alarms as published, kept when it changed. at: of the snapshot [s]."""
        if text == self._alarms:
            return
        self._alarms = text
        data = b'{"alarms":' + text.encode() + b"}"
        self._feeder.put([(ALARM, "", stamp(at, self._offset), data)])

    def action(self, action: str, page: str | None, details: dict[str, Any]) -> None:
        """What an operator did on a page. A page that floods is recorded in part."""
        second = int(self._clock())
        self._actions = (second, self._actions[1] + 1 if self._actions[0] == second else 1)
        if self._actions[1] > ACTIONS:
            return
        self._put_now(ACTION, {"action": action, "page": page or "", "details": details})

    def mark(self, kind: str, text: str, **more: Any) -> None:
        """A marker on the timeline, now."""
        self._put_now(MARKER, {"kind": kind, "text": text[:MAX_TEXT], **more})

    def pin(self, name: str, seconds: float) -> Path:
        """Keep the last `seconds` for good under `name`; the folder. Raises InputError.

        What is pinned ends now, with a whole file, unless the disk is slow.
        """
        self.mark("pin", name)
        self._feeder.rotate(ROTATE)
        return ring.pin(self.plan.site_folder, name, seconds)

    def state(self) -> State:
        line = self._feeder.line()
        return State("trouble", line) if line else State("on", f"since {self._began}")

    @property
    def ready(self) -> bool:
        """Whether the process that writes has begun."""
        return self._feeder.ready

    @property
    def pid(self) -> int | None:
        """Of the process that writes."""
        return self._feeder.pid

    def start(self) -> None:
        self._began = time.strftime("%H:%M:%S")
        self._feeder.start()

    def close(self) -> None:
        """Writes what waits, finishes the file and ends the process."""
        for miss in self._misses.close():
            self._mark_miss(miss)
        self._feeder.close()

    def _mark_miss(self, miss: NearMiss) -> None:
        self.mark("near miss", miss.text, machine=miss.machine, details=vars(miss))

    def _put_now(self, topic: str, document: dict[str, Any]) -> None:
        try:
            json.dumps(document, allow_nan=False)
        except ValueError:  # a page sent what is not a number
            return
        self._feeder.put([(topic, "", stamp(self._clock(), self._offset), dumps(document))])


class NoRecorder:
    """In the place of a recorder when nothing is recorded. why: in words."""

    wants_everything = False

    def __init__(self, why: str) -> None:
        self._why = why

    def hear(self, items: tuple[Heard | ClockSample, ...]) -> None: ...

    def after_cycle(self, inputs: Inputs, snapshot: Snapshot) -> None: ...

    def notices(self) -> tuple[Notice, ...]:
        return ()

    def snapshot(self, text: str, at: float) -> None: ...

    def alarms(self, text: str, at: float) -> None: ...

    def action(self, action: str, page: str | None, details: dict[str, Any]) -> None: ...

    def mark(self, kind: str, text: str, **more: Any) -> None:
        raise InputError(f"nothing is recorded: {self._why}.")

    def pin(self, name: str, seconds: float) -> Path:
        raise InputError(f"nothing is recorded: {self._why}.")

    def state(self) -> State:
        return State("off", self._why)

    @property
    def pid(self) -> None:
        return None

    def start(self) -> None: ...

    def close(self) -> None: ...


def _clock_text(item: ClockSample) -> bytes:
    return msgspec.json.encode(
        {
            "machine": item.machine,
            "sent": item.sent,
            "remote": item.remote,
            "received": item.received,
        }
    )


def _cycle_text(inputs: Inputs, snapshot: Snapshot) -> bytes:
    """All of a cycle's inputs but its samples, which stand before it."""
    document: dict[str, Any] = {"cycle": snapshot.cycle, "time": snapshot.time}
    if inputs.images:
        document["images"] = [vars(image) for image in inputs.images]
    if inputs.malformed:
        document["malformed"] = inputs.malformed
    if inputs.foreign:
        document["foreign"] = inputs.foreign
    if inputs.lost:
        document["lost"] = inputs.lost
    if inputs.driven:
        document["driven"] = list(inputs.driven)
    if inputs.surmounting:
        document["surmounting"] = {name: asdict(one) for name, one in inputs.surmounting.items()}
    if inputs.notices:
        document["notices"] = [{"key": n.key, "line": n.line} for n in inputs.notices]
    return msgspec.json.encode(document)  # numbers come back bit by bit, and it is quick
