"""The two ways to see a session: as we would judge it now, and as it was."""

from __future__ import annotations

import time as clocks
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from backend.fusion.clock import WINDOW
from backend.fusion.streams import SPAN
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs, Snapshot
from backend.safety.alarms import OFF_DELAY, ON_DELAY
from backend.shell.session.cycles import (
    Portion,
    Topics,
    document,
    gauge_choice,
    has_cycles,
    portions,
    samples,
)
from backend.shell.session.format import CLOCK, GAUGE, SNAPSHOT, Message
from backend.shell.session.reader import Session
from backend.shell.session.recorded_snapshot import NotASnapshot, recorded_snapshot
from backend.site.gauge_choice import GaugeChoice

SECOND = 1_000_000_000
WARM = round((SPAN + 0.5) * SECOND)  # what the fusion remembers, and the radio's delay [ns]
CLOCKS = round((WINDOW + 1.0) * SECOND)  # what the estimate of a clock remembers [ns]
SETTLE = round((ON_DELAY + OFF_DELAY + 0.05) * SECOND)  # what alarms remember [ns]
SETTLE_EVERY = 16  # portions to a step then, before the one that is shown
EXACT = 3  # cycles in a row, so that the common time no longer hangs on the ones left out
LOOK_BACK = 30 * SECOND  # for the newest recorded snapshot
TOLD = 3 * SECOND // 2  # within this, what is chosen of the gauge was recorded again


@dataclass(frozen=True)
class Shown:
    """time: of the cycle on the session's line [ns]; document: as recorded, None when judged."""

    time: int
    snapshot: Snapshot
    document: dict[str, Any] | None = None


class Track(Protocol):
    """A position in a session that moves on, and the conclusions there."""

    def seek(self, time: int) -> Shown | None:
        """What is shown at `time` [ns]; None where there is nothing yet."""

    def advance(self, time: int, merge: bool, deadline: float) -> tuple[Shown | None, int]:
        """What is new up to `time` [ns], and how far it came by the deadline (monotonic) [s].

        merge: cycles may be taken together; without it each is stepped, and the last is returned.
        """

    def step(self) -> Shown | None:
        """The next cycle; None at the end."""

    @property
    def ended(self) -> bool: ...


class EvaluatedTrack:
    """The recorded messages, judged by today's pipeline."""

    def __init__(self, session: Session, topics: Topics, config: Config) -> None:
        from backend.shell.session.evaluate import Evaluator  # the whole pipeline, a second

        self._session, self._topics, self._config = session, topics, config
        self._new = partial(Evaluator, config)
        self._evaluator = self._new()
        self._portions: Iterator[Portion] = iter(())
        self._next: Portion | None = None

    @property
    def ended(self) -> bool:
        return self._next is None

    def seek(self, time: int) -> Shown | None:
        """With what the fusion remembers at `time`, so that poses are what they were.

        Counters begin anew, and so do the times since when alarms hold.
        """
        self._evaluator = self._new()
        start = max(time - WARM, self._session.begin - 1)
        self._portions = portions(self._session, self._topics, start)
        self._next = next(self._portions, None)
        if self._next is None:
            return None
        before = Inputs(tuple(samples(self._session, self._topics, self._before(start))))
        self._evaluator.put_aside(Portion(self._next.now, start, before, self._next.cycle))
        before_it: list[Portion] = []
        while (portion := self._next) is not None and portion.time <= time:
            before_it.append(portion)
            self._next = next(self._portions, None)
        shown = None
        for left, portion in zip(range(len(before_it), 0, -1), before_it, strict=True):
            settles = portion.time > time - SETTLE and left % SETTLE_EVERY == 0
            if left <= EXACT or settles:
                shown = Shown(portion.time, self._evaluator.step(portion, seen=left == 1))
            else:
                self._evaluator.put_aside(portion)
        return shown

    def advance(self, time: int, merge: bool, deadline: float) -> tuple[Shown | None, int]:
        shown = None
        while (portion := self._next) is not None and portion.time <= time:
            self._next = next(self._portions, None)
            late = clocks.monotonic() > deadline
            if not merge or late or self._next is None or self._next.time > time:
                shown = Shown(portion.time, self._evaluator.step(portion))
            else:
                self._evaluator.put_aside(portion)
            if late:
                return shown, portion.time
        return shown, time

    def step(self) -> Shown | None:
        portion = self._next
        if portion is None:
            return None
        self._next = next(self._portions, None)
        return Shown(portion.time, self._evaluator.step(portion))

    def _before(self, start: int) -> list[Message]:
        """What is still remembered from before `start`: round trips to the clocks, and the last
        samples of streams that had fallen silent.
        """
        session = self._session
        found = list(session.messages(start - CLOCKS, start - 1, [CLOCK]))
        fused = self._topics.fused(session.topics)
        heard = {m.topic for m in session.messages(start, start + WARM, fused)}
        for topic in fused.keys() - heard:
            last = session.last_before(start, topic)
            if last is not None:
                found += session.messages(last - round(SPAN * SECOND), last, [topic])
        return sorted(found, key=lambda message: message.time)


class RecordedTrack:
    """The recorded snapshots."""

    def __init__(self, session: Session, config: Config) -> None:
        self._session, self._config = session, config
        self._messages: Iterator[Message] = iter(())
        self._next: Message | None = None
        self._choices: dict[str, GaugeChoice] = {}

    @property
    def ended(self) -> bool:
        return self._next is None

    def seek(self, time: int) -> Shown | None:
        for message in self._session.messages(time - TOLD, time, [GAUGE]):
            self._choose(message)
        shown = None
        for back in (SECOND, LOOK_BACK):
            found = list(self._session.messages(time - back, time, [SNAPSHOT]))
            shown = next((one for m in reversed(found) if (one := self._shown(m))), None)
            if shown is not None:
                break
        self._messages = self._session.messages(start=time + 1, topics=[SNAPSHOT, GAUGE])
        self._next = self._following()
        return shown

    def advance(self, time: int, merge: bool, deadline: float) -> tuple[Shown | None, int]:
        newest = None
        while self._next is not None and self._next.time <= time:
            newest, self._next = self._next, self._following()
            if clocks.monotonic() > deadline:
                return self._shown(newest), newest.time
        return (None if newest is None else self._shown(newest)), time

    def step(self) -> Shown | None:
        while self._next is not None:
            message, self._next = self._next, self._following()
            shown = self._shown(message)
            if shown is not None:
                return shown
        return None

    def _following(self) -> Message | None:
        """The next recorded snapshot; what was chosen of the gauge before it is remembered."""
        for message in self._messages:
            if message.topic == SNAPSHOT:
                return message
            self._choose(message)
        return None

    def _choose(self, message: Message) -> None:
        choice = gauge_choice(message.data)
        if choice is not None:
            self._choices[choice.digest] = choice

    def _shown(self, message: Message) -> Shown | None:
        try:
            found = document(message.data)
            snapshot = recorded_snapshot(found, self._config, self._choices)
            return Shown(message.time, snapshot, found)
        except (ValueError, NotASnapshot):
            self._session.note("some recorded snapshots cannot be read and are left out")
            return None


def recorded(session: Session, config: Config) -> Iterator[tuple[int, Snapshot]]:
    """(time [ns], snapshot) of all that was recorded; what cannot be read is left out and noted."""
    for message in session.messages(topics=[SNAPSHOT]):
        try:
            yield message.time, recorded_snapshot(document(message.data), config)
        except (ValueError, NotASnapshot):
            session.note("some recorded snapshots cannot be read and are left out")


def sources(session: Session, topics: Topics) -> tuple[str, ...]:
    """The ways in which a session can be seen: "recorded", "evaluated"."""
    found = []
    if SNAPSHOT in session.topics and session.topics[SNAPSHOT].count:
        found.append("recorded")
    if has_cycles(session) or topics.fused(session.topics):
        found.append("evaluated")
    return tuple(found)


def track(source: str, session: Session, topics: Topics, config: Config) -> Track:
    """The track of a source."""
    if source == "recorded":
        return RecordedTrack(session, config)
    return EvaluatedTrack(session, topics, config)
