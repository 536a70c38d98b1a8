"""A session's messages as the portions that cycles of the pipeline consumed, or would have."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeAlias

import msgspec

from backend.errors import InputError
from backend.fusion.samples import ClockSample, Sample
from backend.pipeline.people_records import Seen
from backend.pipeline.records import ImageStamp, Inputs, Notice
from backend.shell.link.codec import DecodeError, decode
from backend.shell.link.messages import AgentStatus, Command, TrueState
from backend.shell.link.topics import Direction, match
from backend.shell.session.format import CLOCK, CYCLE, GAUGE, OWN, PEOPLE, Message, seconds
from backend.shell.session.mapping import map_topics
from backend.shell.session.people_message import seen_of
from backend.shell.session.reader import Session
from backend.shell.session.surmounting_message import surmounting_of
from backend.site.gauge_choice import GaugeChoice, checked, from_document
from backend.site.site import Site

PERIOD = 20_000_000  # of portions where no cycles were recorded [ns]
SET = 0.5  # a cycle whose own time is this far from its message's was moved on the time line [s]
NOT_FOR_FUSION = ("points", "status", "truth")
NEEDED: dict[str, tuple[str, ...]] = {  # for a pose: how the topics' names begin
    "joint angles": ("joint_states", "imu/"),
    "positions": ("gnss/fix", "gnss/projected"),
    "headings": ("gnss/heading",),
}

Owner: TypeAlias = tuple[str, str]
"""(machine, suffix of the key below its prefix)."""


@dataclass(frozen=True)
class Portion:
    """What one cycle consumes. now: its local time [s]; time: on the session's line [ns];
    cycle: its recorded number, None where no cycles were recorded.
    """

    now: float
    time: int
    inputs: Inputs
    cycle: int | None = None


@dataclass(frozen=True)
class Topics:
    """Which topics are of which machine. machines: key prefix on the wire -> name.

    named: in other programs' recordings the owners of every topic that is of use, as the site file
    has it; None in ours. notes: what is not of use there, in words.
    """

    machines: Mapping[str, str]
    named: Mapping[str, tuple[Owner, ...]] | None = None
    notes: tuple[str, ...] = ()

    @staticmethod
    def of(site: Site, session: Session | None = None) -> Topics:
        """session: its topics are looked up in the site file where another program made it."""
        machines = {machine.prefix: machine.name for machine in site.machines}
        if session is None or session.headers:
            return Topics(machines)
        mapped = map_topics(site, {topic: info.type for topic, info in session.topics.items()})
        named = {
            topic: tuple((stream.machine, stream.suffix) for stream in streams)
            for topic, streams in mapped.streams.items()
        }
        return Topics(machines, named, tuple(note.rstrip(".") for note in mapped.unused))

    def owners(self, topic: str) -> tuple[Owner, ...]:
        """(machine, suffix below its prefix) of a topic; none for those of no machine."""
        if self.named is not None:
            return self.named.get(topic, ())
        key = topic.removeprefix("/")
        for prefix, name in self.machines.items():
            if key.startswith(f"{prefix}/"):
                return ((name, key[len(prefix) + 1 :]),)
        return ()

    def fused(self, topics: Collection[str]) -> dict[str, tuple[Owner, ...]]:
        """Those of `topics` that a pose is made from, each with its machine and suffix."""
        found = {}
        for topic in topics:
            rows = [(owner, match(owner[1])) for owner in self.owners(topic)]
            used = tuple(owner for owner, row in rows if row and _for_fusion(row[0]))
            if used:
                found[topic] = used
        return found


def _for_fusion(row: Any) -> bool:
    return (
        row.direction is Direction.FROM_MACHINE
        and row.name not in NOT_FOR_FUSION
        and not row.queryable
    )


def problems(session: Session, topics: Topics) -> tuple[str, ...]:
    """What a viewer should know about a session seen on a site: topics without a machine, machines
    without topics, machines that share a name. In words.
    """
    owned: dict[str, list[str]] = {name: [] for name in topics.machines.values()}
    strangers = set()
    for topic in session.topics:
        owners = topics.owners(topic)
        for machine, suffix in owners:
            owned[machine].append(suffix)
        if not owners and not topic.startswith(OWN):
            strangers.add(topic)
    found = list(topics.notes)
    if strangers:
        shown = ", ".join(sorted(strangers)[:5]) + (" …" if len(strangers) > 5 else "")
        listed = ", ".join(sorted(topics.machines))
        found.append(
            f"{len(strangers)} topics are of no machine of the site and not shown: {shown}; "
            f"the site's prefixes are {listed}"
        )
    for name, suffixes in owned.items():
        missing = [
            words
            for words, starts in NEEDED.items()
            if not any(suffix.startswith(starts) for suffix in suffixes)
        ]
        if len(missing) == len(NEEDED):
            found.append(f"{name}: nothing was recorded of this machine; it stays unknown")
        elif missing:
            found.append(f"{name}: no {' and no '.join(missing)} were recorded; it stays unknown")
    return tuple(found)


def has_cycles(session: Session) -> bool:
    """Whether the cycles of a live pipeline were recorded."""
    return CYCLE in session.topics and session.topics[CYCLE].count > 0


def portions(
    session: Session, topics: Topics, start: int | None = None, end: int | None = None
) -> Iterator[Portion]:
    """Portions with start <= time <= end [ns]; `now` never runs backward.

    A session with cycles is handed on in just their portions. Otherwise a portion is `PERIOD` long,
    on a grid that begins with the session, whatever `start` is.
    """
    reader = _Reader(session, topics)
    chosen = {*reader.fused, CLOCK}
    if has_cycles(session):
        chosen |= {CYCLE, GAUGE, PEOPLE}
    messages = session.messages(start, end, chosen)
    if has_cycles(session):
        yield from _recorded(reader, messages)
    else:
        yield from _periodic(reader, messages, start, end)


def samples(session: Session, topics: Topics, messages: Iterable[Message]) -> Iterator[Sample]:
    """The samples in some of a session's messages; what cannot be decoded is left out."""
    reader = _Reader(session, topics)
    for message in messages:
        with suppress(DecodeError):
            yield from reader.samples(message)


class _Reader:
    """Messages to samples. fused: topic -> its owners."""

    def __init__(self, session: Session, topics: Topics) -> None:
        self.session = session
        self._offset = session.offset
        self.fused = topics.fused(session.topics)
        self.names = set(topics.machines.values())

    def local(self, time: int) -> float:
        return seconds(time, self._offset)

    def samples(self, message: Message) -> list[Sample]:
        """What is for the fusion: one, none, or several of a topic with several owners. Raises
        DecodeError."""
        if message.topic == CLOCK:
            trip = self._clock(message)
            return [] if trip is None else [trip]
        arrival = self.local(message.time)
        decoded = (decode(*owner, message.data, arrival) for owner in self.fused[message.topic])
        return [s for s in decoded if not isinstance(s, (AgentStatus, Command, TrueState))]

    def _clock(self, message: Message) -> ClockSample | None:
        try:
            trip = document(message.data)
            machine = str(trip["machine"])
            sent, remote, received = (float(trip[k]) for k in ("sent", "remote", "received"))
        except (ValueError, TypeError, KeyError) as error:
            raise DecodeError(f"clock: {error}") from error
        if machine not in self.names:
            return None
        moved = self.local(message.time) - received
        if abs(moved) > SET:
            sent, received = sent + moved, received + moved
        return ClockSample(machine, sent, remote, received)


def _recorded(reader: _Reader, messages: Iterator[Message]) -> Iterator[Portion]:
    heard: list[Sample] = []
    chosen: GaugeChoice | None = None
    people: Seen | None = None
    newest = -math.inf
    for message in messages:
        if message.topic == GAUGE:
            chosen = gauge_choice(message.data) or chosen
            continue
        if message.topic == PEOPLE:
            people = _people(message.data) or people
            continue
        if message.topic != CYCLE:
            # What could not be decoded then cannot be now: the cycle's message counts it.
            with suppress(DecodeError):
                heard += reader.samples(message)
            continue
        try:
            cycle = document(message.data)
            own = float(cycle["time"])
            number = int(cycle["cycle"])
            local = reader.local(message.time)
            moved = local - own if abs(own - local) > SET else 0.0
            inputs = _inputs(tuple(heard), cycle, chosen, people, moved)
        except (ValueError, TypeError, KeyError, AttributeError):
            reader.session.note("a cycle's message cannot be read; its portion joins the next")
            continue
        newest = max(newest, local if moved else own)
        heard, chosen, people = [], None, None
        yield Portion(newest, message.time, inputs, number)


def _inputs(
    heard: tuple[Sample, ...],
    cycle: dict[str, Any],
    chosen: GaugeChoice | None,
    people: Seen | None,
    moved: float,
) -> Inputs:
    """moved: later on the time line than by the cycle's own times [s]."""
    return Inputs(
        samples=heard,
        images=tuple(ImageStamp(**image) for image in cycle.get("images", ())),
        malformed=tuple((str(key), int(n)) for key, n in cycle.get("malformed", ())),
        foreign=tuple((str(key), int(n)) for key, n in cycle.get("foreign", ())),
        lost=int(cycle.get("lost", 0)),
        notices=tuple(Notice(**notice) for notice in cycle.get("notices", ())),
        driven=tuple(str(name) for name in cycle.get("driven", ())),
        gauge=chosen,
        people=people,
        surmounting={
            str(name): surmounting_of(one, moved)
            for name, one in cycle.get("surmounting", {}).items()
        },
    )


def gauge_choice(data: bytes) -> GaugeChoice | None:
    """What operators chose of the working gauge, as a message has it; None for what is none."""
    try:
        return checked(from_document(document(data)))
    except (ValueError, TypeError, KeyError, AttributeError, InputError):
        return None


def _people(data: bytes) -> Seen | None:
    """What LiDARs saw, as a message has it; None for what is none."""
    try:
        return seen_of(document(data))
    except (ValueError, TypeError, KeyError):
        return None


def _periodic(
    reader: _Reader, messages: Iterator[Message], start: int | None, end: int | None
) -> Iterator[Portion]:
    """Portions of one period each, empty ones included: silence makes poses stale."""
    session = reader.session
    first = session.begin if start is None else max(start, session.begin)
    last = session.end if end is None else min(end, session.end)
    due = session.begin + max(1, -(-(first - session.begin) // PERIOD)) * PERIOD
    heard: list[Sample] = []
    malformed: dict[str, int] = {}

    def portion() -> Portion:
        found = Portion(
            reader.local(due), due, Inputs(tuple(heard), malformed=tuple(malformed.items()))
        )
        heard.clear()
        malformed.clear()
        return found

    for message in messages:
        while message.time > due:
            yield portion()
            due += PERIOD
        try:
            heard += reader.samples(message)
        except DecodeError:
            machine, suffix = reader.fused.get(message.topic, (("", message.topic),))[0]
            malformed[f"{machine}/{suffix}"] = malformed.get(f"{machine}/{suffix}", 0) + 1
    while due <= last or heard:
        yield portion()
        due += PERIOD


def document(data: bytes) -> Any:
    """A JSON document; NaN and infinities are allowed. Raises ValueError."""
    try:
        return msgspec.json.decode(data)
    except msgspec.DecodeError:
        return json.loads(data)
