"""CAN logs (.asc, .blf, .csv, .log) with a DBC and a map to the messages of our keys."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import cantools
from cantools.database.errors import Error as DbcError

from backend.errors import InputError
from backend.shell.session.can_map import CanMap, load_can_map
from backend.shell.session.can_streams import MachineStreams
from backend.shell.session.format import Message
from backend.shell.session.source import Event, Problems, Progress, Source, SteadyClock
from backend.site.site import Site

SUFFIXES = (".asc", ".blf", ".log", ".csv")
_CSV_HEADER = "timestamp,arbitration_id,"
_SHOWN = 8


def is_can_log(path: Path) -> bool:
    """By the suffix; a .csv by the header that python-can writes."""
    if path.suffix != ".csv":
        return path.suffix in SUFFIXES
    with path.open("rb") as file:
        return file.read(len(_CSV_HEADER)) == _CSV_HEADER.encode()


@dataclass(frozen=True)
class _Target:
    """Where a signal of a frame goes. message, signal: of the DBC; name: as the map calls it."""

    message: Any
    machine: str
    streams: MachineStreams
    name: str
    signal: str


def read_can_log(
    path: Path,
    site: Site,
    dbc: Path | None,
    can_map: Path | None,
    progress: Progress | None = None,
) -> Source:
    """The streams of the mapped machines. can_map: default is what the site file names.

    Raises InputError for a log, DBC or map that cannot be read or do not belong together.
    """
    chosen = can_map or site.can_map
    if chosen is None:
        raise InputError(
            f"{path}: a CAN log needs a map; allowed are --map FILE, or [can] map in the site file."
        )
    mapping = load_can_map(chosen, site)
    file = dbc or mapping.dbc
    if file is None:
        raise InputError(f"{mapping.path}: names no DBC; allowed are dbc in it, or --dbc FILE.")
    database = _database(file)
    targets = _targets(database, file, mapping, site)
    problems = Problems()
    events: list[Event] = []
    skipped: dict[str, int] = {}
    frames = _frames(path, problems, progress)
    return Source(
        path=path,
        origin=f"CAN log: {path.name}, DBC: {file.name}, map: {mapping.path.name}",
        note=mapping.note,
        messages=_messages(path, frames, targets, problems, events, skipped),
        problems=problems,
        events=events,
        skipped=skipped,
    )


def _messages(
    path: Path,
    frames: Iterator[Any],
    targets: dict[tuple[int, bool], list[_Target]],
    problems: Problems,
    events: list[Event],
    skipped: dict[str, int],
) -> Iterator[Message]:
    clock = SteadyClock(problems)
    unknown: Counter[tuple[int, bool]] = Counter()
    known = total = 0
    for number, frame in enumerate(frames, start=1):
        where = f"{path.name}, frame {number}"
        if frame.is_error_frame or frame.is_remote_frame:
            problems.add(where, "error and remote frames", kind="error frames")
            continue
        total += 1
        identifier = (frame.arbitration_id, frame.is_extended_id)
        wanted = targets.get(identifier)
        if wanted is None:
            unknown[identifier] += 1
            skipped[_id(*identifier)] = unknown[identifier]
            continue
        known += 1
        if not math.isfinite(frame.timestamp):
            problems.add(where, "frames without a time are left out")
            continue
        time = clock.place(round(frame.timestamp * 1e9), where)
        try:
            values = wanted[0].message.decode(bytes(frame.data), decode_choices=False)
        except (DbcError, ValueError) as error:
            name = _id(*identifier)
            problems.add(where, f"{name} does not fit the DBC: {error}", kind=f"{name} undecodable")
            continue
        for target in wanted:
            if target.signal not in values:
                continue  # a multiplexed signal that is not in this frame
            value = float(values[target.signal])
            taken, messages = target.streams.update(time, target.name, value)
            if not taken:
                signal = f"{target.message.name}.{target.signal}"
                why = "an outlier" if math.isfinite(value) else "not a number"
                text = f"{frame.arbitration_id} {signal} = {value:g} is kept out: {why}"
                problems.add(f"{where}, {time / 1e9:.3f} s", text, kind=f"outlier {signal}")
                events.append(Event(time, target.machine, text))
            yield from messages
    if total and not known:
        ids = ", ".join(_id(*identifier) for identifier, _ in unknown.most_common(_SHOWN))
        expected = ", ".join(_id(*identifier) for identifier in sorted(targets)[:_SHOWN])
        raise InputError(
            f"{path}: none of its {total} frames has an identifier of the map; in the log are "
            f"{ids}, in the map {expected}."
        )


def _frames(path: Path, problems: Problems, progress: Progress | None) -> Iterator[Any]:
    """The log's frames. What breaks off is a problem, what came before is kept."""
    size = max(path.stat().st_size, 1)
    options = {"relative_timestamp": False} if path.suffix == ".asc" else {}
    count = 0
    try:
        with can.LogReader(path, **options) as reader:
            for frame in reader:
                count += 1
                if progress and count % 1000 == 0:
                    with suppress(Exception):
                        file = getattr(reader.file, "buffer", reader.file)
                        progress(min(file.tell() / size, 1.0))
                yield frame
    except InputError:
        raise
    except Exception as error:  # whatever a damaged log provokes in its reader
        reason = str(error).strip() or type(error).__name__
        if not count:
            raise InputError(
                f"{path}: cannot be read as a CAN log ({reason}); allowed are "
                f"{', '.join(SUFFIXES)} as python-can, Vector or can-utils write them."
            ) from error
        problems.add(
            f"{path.name}, after frame {count}", f"breaks off: {reason}; what came before is kept"
        )
    if not count:
        raise InputError(f"{path}: holds no CAN frames.")


def _database(file: Path) -> Any:
    try:
        return cantools.database.load_file(file, database_format="dbc", strict=True)
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error}).") from error
    except Exception as error:  # parse errors of several kinds
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"{file}: is not a DBC ({reason}).") from error


def _targets(
    database: Any, file: Path, mapping: CanMap, site: Site
) -> dict[tuple[int, bool], list[_Target]]:
    known = {
        f"{message.name}.{signal.name}": message
        for message in database.messages
        for signal in message.signals
    }
    targets: dict[tuple[int, bool], list[_Target]] = {}
    for machine in mapping.machines:
        streams = MachineStreams(machine, site)
        for name, signal in streams.signals.items():
            message = known.get(str(signal.signal))
            if message is None:
                shown = ", ".join(sorted(known)[:_SHOWN]) + (", ..." if len(known) > _SHOWN else "")
                raise InputError(
                    f'{mapping.path}: machine "{machine.name}": {name} is "{signal.signal}", which '
                    f"{file.name} does not have; allowed are {shown}."
                )
            key = (message.frame_id, message.is_extended_frame)
            of_signal = str(signal.signal).split(".")[1]
            target = _Target(message, machine.name, streams, name, of_signal)
            targets.setdefault(key, []).append(target)
    return targets


def _id(identifier: int, extended: bool) -> str:
    return f"{identifier} (0x{identifier:X}{', extended' if extended else ''})"
