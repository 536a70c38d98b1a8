"""Other people's recordings to a session of ours."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.metadata import version
from itertools import chain
from pathlib import Path

from backend.errors import InputError
from backend.shell.session import bags, can_log, pose_tables
from backend.shell.session.format import MARKER, Header, Message, dumps
from backend.shell.session.source import Event, Problem, Progress, Source
from backend.shell.session.writer import SessionWriter
from backend.site.site import SITES, Site

ALLOWED = (
    "rosbag2 folders and files (.db3, .mcap), CAN logs (.asc, .blf, .csv, .log) and tables of "
    "poses (.csv, .parquet)"
)
MOST_EVENTS = 200  # markers that a conversion may put on the timeline


@dataclass(frozen=True)
class Conversion:
    """What came out. counts: messages by topic; begin, end: [ns since 1970]; skipped: what is of no
    machine of the site, with how often; note: what a viewer must know."""

    path: Path
    out: Path
    origin: str
    note: str
    counts: dict[str, int]
    begin: int
    end: int
    problems: tuple[Problem, ...]
    skipped: dict[str, int]

    @property
    def messages(self) -> int:
        return sum(self.counts.values())


def convert(
    path: Path,
    site: Site,
    out: Path,
    progress: Progress | None = None,
    dbc: Path | None = None,
    can_map: Path | None = None,
    note: str = "",
) -> Conversion:
    """Writes `path` as a session to `out`, which must not exist.

    dbc, can_map: for CAN logs; default: what the site file names. note: what a viewer must know, in
    place of the source's own. Raises InputError, and leaves no
    file behind then.
    """
    if out.exists():
        raise InputError(f"{out}: exists already; allowed is a new file.")
    source = open_source(path, site, progress, dbc, can_map)
    source = replace(source, note=note) if note else source
    first = next(source.messages, None)
    if first is None:
        reasons = source.problems.found()
        why = f"; {_shown(reasons[0])}" if reasons else ""
        raise InputError(f"{path}: nothing of the site's machines could be read{why}.")
    partial = out.with_name(out.name + ".part")
    try:
        counts, end = _write(source, first, partial, site, out)
        os.replace(partial, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror or error}).") from error
    finally:
        partial.unlink(missing_ok=True)
    if progress:
        progress(1.0)
    return Conversion(
        path=path,
        out=out,
        origin=source.origin,
        note=source.note,
        counts=counts,
        begin=first.time,
        end=end,
        problems=source.problems.found(),
        skipped=dict(source.skipped),
    )


def needs_conversion(path: Path) -> bool:
    """Whether `path` is something that `convert` reads and the session reader does not."""
    if path.is_dir():
        return bags.is_bag(path) and not any(path.glob("*.mcap"))
    if path.suffix == ".mcap" or not path.is_file():
        return False
    return bags.is_bag(path) or can_log.is_can_log(path) or pose_tables.is_table(path)


def open_source(
    path: Path,
    site: Site,
    progress: Progress | None = None,
    dbc: Path | None = None,
    can_map: Path | None = None,
) -> Source:
    """The reader for what `path` is. Raises InputError for what cannot be read or is unknown."""
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder.")
    if path.is_file() and path.stat().st_size == 0:
        raise InputError(f"{path}: is empty.")
    if bags.is_bag(path):
        return bags.read_bag(path, site, progress)
    if can_log.is_can_log(path):
        return can_log.read_can_log(path, site, dbc, can_map, progress)
    if pose_tables.is_table(path):
        return pose_tables.read_poses(path, site, progress)
    raise InputError(f"{path}: is of no known kind; allowed are {ALLOWED}.")


def _write(
    source: Source, first: Message, path: Path, site: Site, out: Path
) -> tuple[dict[str, int], int]:
    header = Header(
        offset=first.time // 1_000_000_000 * 1_000_000_000,
        recording=out.stem,
        part=0,
        site_file=_site_file(site),
        site=site.path.read_text(encoding="utf-8"),
        own=",".join(machine.name for machine in site.machines),
        origin=source.origin,
        software=f"excavator-cockpit {version('excavator-cockpit')}",
        note=source.note,
    )
    writer = SessionWriter(path, header)
    counts: dict[str, int] = {}
    end = first.time
    told = 0
    try:
        for message in _with_events(first, source):
            if message.topic == MARKER:
                told += 1
                if told > MOST_EVENTS:
                    continue
            writer.write(message)
            counts[message.topic] = counts.get(message.topic, 0) + 1
            end = message.time
    finally:
        writer.close()
    return counts, end


def _site_file(site: Site) -> str:
    """A shipped site's path as it is in every installation; another's as it is here."""
    return f"scenes/sites/{site.path.name}" if site.path.parent == SITES else str(site.path)


def _with_events(first: Message, source: Source) -> Iterator[Message]:
    """The messages, each event in front of the first message that is not earlier."""
    told = 0
    end = first.time
    for message in chain((first,), source.messages):
        while told < len(source.events) and source.events[told].time <= message.time:
            yield _marker(source.events[told], end)
            told += 1
        yield message
        end = message.time
    for event in source.events[told:]:
        yield _marker(event, end)


def _marker(event: Event, earliest: int) -> Message:
    document = {"kind": "note", "text": event.text, "machine": event.machine}
    return Message(MARKER, max(event.time, earliest), dumps(document))


def _shown(problem: Problem) -> str:
    return f"{problem.where}: {problem.text}" if problem.where else problem.text
