"""Events and time series of a whole session, built beside playback; and its diff."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from backend.pipeline.config import Config
from backend.shell.session.cycles import Topics, document
from backend.shell.session.events import (
    NEAR_MISS,
    Alarms,
    Event,
    alarms_of_document,
    alarms_of_snapshot,
    event_document,
    gaps,
    near_misses,
    ordered,
    spoken,
)
from backend.shell.session.format import ACTION, ALARM, MARKER, SNAPSHOT
from backend.shell.session.jobs import Job, Tell
from backend.shell.session.reader import Session, open_session
from backend.shell.session.series import (
    EMPTY,
    Series,
    SeriesBuilder,
    row_of_document,
    row_of_snapshot,
    series_document,
)
from backend.shell.session.tracks import sources

EVERY = 5  # evaluated cycles are taken together, for a value every 0.1 s
REFUSED = 0.2  # share of refused samples that is worth a word
MANY = 100  # samples before that share means anything


@dataclass(frozen=True)
class Known:
    """What has been found so far."""

    events: tuple[Event, ...] = ()
    series: Series = EMPTY
    problems: tuple[str, ...] = ()


class Index:
    """What is known of a whole session besides the moment that is shown."""

    def __init__(self, session: Session, topics: Topics, config: Config) -> None:
        self._session = session
        self.sources = sources(session, topics)
        self._known: dict[str, Known] = {}
        arguments = (session.path, topics, config)
        self._jobs = {
            source: Job(_WORK[source], *arguments, part=partial(self._take, source))
            for source in self.sources
        }
        self._diff = Job(_diff, *arguments)

    def start(self) -> None:
        """Begin with the source that playback begins with; the other is built when asked for."""
        self._jobs[self.sources[0]].start()

    def close(self) -> None:
        for job in (*self._jobs.values(), self._diff):
            job.close()

    @property
    def state(self) -> dict[str, Any]:
        """Of the events: what backend.documents.session.IndexModel describes."""
        job = self._jobs[self.sources[0]]
        words = {"none": "building", "running": "building", "done": "ready", "failed": "failed"}
        return {"state": words[job.state], "progress": job.progress}

    def events(self) -> list[dict[str, Any]]:
        known = self._known.get(self.sources[0], Known())
        return [event_document(event, self._session.begin) for event in known.events]

    def event_times(self) -> list[int]:
        """Starts of all events but operators' actions [ns]."""
        known = self._known.get(self.sources[0], Known())
        return [event.start for event in known.events if event.kind != "action"]

    def problems(self) -> list[str]:
        found = [text for known in list(self._known.values()) for text in known.problems]
        found += [
            f"the {source} index was not built: {job.error}"
            for source, job in self._jobs.items()
            if job.state == "failed"
        ]
        return list(dict.fromkeys(found))

    def series(self, source: str, start: float, end: float, points: int) -> dict[str, Any]:
        """What is known so far; asking for it has it built. Times [s] since the beginning."""
        self._jobs[source].start()
        known = self._known.get(source, Known())
        return series_document(known.series, self._session.begin, start, end, points)

    def start_diff(self) -> None:
        self._diff.start()

    def diff(self) -> dict[str, Any]:
        """What backend.documents.session.DiffDocument describes."""
        job = self._diff
        return {
            "state": job.state,
            "progress": job.progress,
            "error": job.error,
            "result": job.result,
        }

    def _take(self, source: str, known: Known) -> None:
        self._known[source] = known


def known_of(
    source: str, session: Session, topics: Topics, config: Config, tell: Tell = lambda *_: None
) -> Known:
    """Events and series of a whole session, here and now. tell: of progress, 0 to 1."""
    return _WORK[source](tell, session.path, topics, config)


class _Milestones:
    """Tells of progress often, and of what is known so far ever more rarely."""

    def __init__(self, session: Session, tell: Tell) -> None:
        self._begin, self._span = session.begin, max(session.end - session.begin, 1)
        self._tell = tell
        self._told = 0.0
        self._next = 0.02

    def at(self, time: int) -> bool:
        """Whether this is the time to tell what is known."""
        share = (time - self._begin) / self._span
        if share - self._told >= 0.01:
            self._told = share
            self._tell("progress", share)
        if share < self._next:
            return False
        self._next = 2.0 * self._next
        return True


def _index_recorded(tell: Tell, path: Path, topics: Topics, config: Config) -> Known:
    session = open_session(path)
    milestones = _Milestones(session, tell)
    builder, alarms, others = SeriesBuilder(), Alarms(), gaps(session)
    last: dict[str, Any] = {}
    for time, topic, found in _documents(session, (SNAPSHOT, ALARM, MARKER, ACTION)):
        try:
            if topic == SNAPSHOT:
                builder.add(row_of_document(time, found))
                last = found
            if topic in (SNAPSHOT, ALARM):
                alarms.at(time, alarms_of_document(found))
            elif (event := spoken(topic, found, time)) is not None:
                others.append(event)
        except (KeyError, TypeError, ValueError, AttributeError):
            session.note(f"some messages on {topic} cannot be read and are left out")
        if milestones.at(time):
            tell("part", Known(tuple(ordered([*alarms.events, *others])), builder.series()))
    counts = {
        (name, stream): (received, machine["rejected"][stream])
        for name, machine in last.get("machines", {}).items()
        for stream, received in machine["received"].items()
    }
    return _known(session, config, builder, alarms, others, counts)


def _index_evaluated(tell: Tell, path: Path, topics: Topics, config: Config) -> Known:
    from backend.shell.session.evaluate import evaluate  # in this job's process only

    session = open_session(path)
    milestones = _Milestones(session, tell)
    builder, alarms, others = SeriesBuilder(), Alarms(), gaps(session)
    for time, topic, found in _documents(session, (MARKER, ACTION)):
        if (event := spoken(topic, found, time)) is not None:
            others.append(event)
    counts: dict[tuple[str, str], tuple[int, int]] = {}
    for portion, snapshot in evaluate(session, topics, config, every=EVERY):
        builder.add(row_of_snapshot(portion.time, snapshot, config))
        alarms.at(portion.time, alarms_of_snapshot(snapshot, config))
        if milestones.at(portion.time):
            tell("part", Known(tuple(ordered([*alarms.events, *others])), builder.series()))
        counts = {
            (name, stream): (status.received, status.rejected)
            for name, state in snapshot.machines.items()
            for stream, status in state.pose.streams.items()
        }
    return _known(session, config, builder, alarms, others, counts)


def _diff(tell: Tell, path: Path, topics: Topics, config: Config) -> dict[str, Any]:
    from backend.shell.session.diff import diff

    session = open_session(path)
    result = diff(session, topics, config, lambda share: tell("progress", share))
    return result.model_dump()


def _documents(
    session: Session, topics: tuple[str, ...]
) -> Iterator[tuple[int, str, dict[str, Any]]]:
    for message in session.messages(topics=topics):
        try:
            found = document(message.data)
        except ValueError:
            found = None
        if isinstance(found, dict):
            yield message.time, message.topic, found
        else:
            session.note(f"some messages on {message.topic} cannot be read and are left out")


def _known(
    session: Session,
    config: Config,
    builder: SeriesBuilder,
    alarms: Alarms,
    others: list[Event],
    counts: dict[tuple[str, str], tuple[int, int]],
) -> Known:
    """Everything, at the session's end. counts: (received, refused) by machine and stream."""
    series = builder.series()
    if not any(event.kind == NEAR_MISS for event in others):
        others = [*others, *near_misses(series, config.limits.stop_below)]
    refused = [
        f"{name}: {100 * rejected / received:.0f} % of its {stream} samples were refused (late, "
        "out of order or impossible); are there two machines with one name?"
        for (name, stream), (received, rejected) in counts.items()
        if received > MANY and rejected > REFUSED * received
    ]
    events = ordered([*alarms.close(session.end), *others])
    return Known(tuple(events), series, (*session.notes, *refused))


_WORK = {"recorded": _index_recorded, "evaluated": _index_evaluated}
