"""ROS 2 recordings (rosbag2 folders, .db3 and .mcap files) to the messages of our keys."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader

from backend.errors import InputError
from backend.fusion.samples import JointSample
from backend.shell.link.codec import DecodeError, decode
from backend.shell.session.format import OWN, Message
from backend.shell.session.mapping import Mapped, Stream, map_topics, refuse_nothing
from backend.shell.session.reader import Session, open_session
from backend.shell.session.source import Problems, Progress, Source, SteadyClock
from backend.site.site import Site

SUFFIXES = (".db3", ".mcap")
METADATA_FILE = "metadata.yaml"
_NOT_CHECKED = ("points", "cmd", "status")  # their bytes are taken as they are


def is_bag(path: Path) -> bool:
    """Whether `path` looks like a ROS 2 recording."""
    if path.is_dir():
        return (path / METADATA_FILE).exists() or bool(_files(path))
    return path.suffix in SUFFIXES


def read_bag(path: Path, site: Site, progress: Progress | None = None) -> Source:
    """The messages of the site's machines, byte by byte as recorded, by time.

    Raises InputError when nothing can be read, or nothing is of a machine of the site. What breaks
    off later is a problem, and what came before it is kept.
    """
    stack = ExitStack()
    problems = Problems()
    readers = _open(path, stack, problems)
    types: dict[str, str] = {}
    counts: dict[str, int] = {}
    senders: dict[int, set[str]] = {}
    for reader in readers:
        for connection in reader.connections:
            if connection.topic.startswith(OWN):
                stack.close()
                raise InputError(f"{path}: is a session already; allowed are other recordings.")
            if connection.topic in senders.setdefault(id(reader), set()):
                problems.add(
                    connection.topic,
                    "several senders shared this topic; are there two machines with one name?",
                    kind=f"{connection.topic} shared",
                )
            senders[id(reader)].add(connection.topic)
            counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
            known = types.setdefault(connection.topic, connection.msgtype)
            if known != connection.msgtype:
                problems.add(
                    connection.topic,
                    f"has the types {known} and {connection.msgtype}; the first counts",
                )
    try:
        if not sum(counts.values()):
            raise InputError(f"{path}: holds no messages.")
        mapped = map_topics(site, types)
        refuse_nothing(mapped, str(path))
    except InputError:
        stack.close()
        raise
    for note in mapped.notes:
        problems.add("", note)
    total = sum(counts[topic] for topic in mapped.streams)
    return Source(
        path=path,
        origin=f"rosbag2: {path.name}",
        note="",
        messages=_messages(path, readers, mapped, types, total, stack, problems, progress),
        problems=problems,
        skipped={topic: counts[topic] for topic in mapped.unknown},
    )


def _messages(
    path: Path,
    readers: list[Any],
    mapped: Mapped,
    types: dict[str, str],
    total: int,
    stack: ExitStack,
    problems: Problems,
    progress: Progress | None,
) -> Iterator[Message]:
    clock = SteadyClock(problems)
    check = _Check(problems)
    done = 0
    parts = [_of_one(reader, mapped, types, path, problems) for reader in readers]
    with stack:
        for topic, time, data in merge(*parts, key=lambda item: item[1]):
            placed = clock.place(time, topic)
            for stream in mapped.streams[topic]:
                check.message(stream, data)
                yield Message(stream.topic, placed, data)
            done += 1
            if progress and done % 1000 == 0:
                progress(min(done / max(total, 1), 1.0))
    if done < total:
        problems.add(str(path), f"{total} messages are announced, {done} could be read")


def _of_one(
    reader: Any, mapped: Mapped, types: dict[str, str], path: Path, problems: Problems
) -> Iterator[tuple[str, int, bytes]]:
    wanted = [
        connection
        for connection in reader.connections
        if connection.topic in mapped.streams and connection.msgtype == types[connection.topic]
    ]
    if not wanted:
        return
    try:
        for connection, time, data in reader.messages(connections=wanted):
            yield connection.topic, time, bytes(data)
    except Exception as error:  # whatever a damaged file provokes in its reader
        problems.add(
            reader.path.name, f"breaks off here: {_reason(error)}; what came before is kept"
        )


def _open(path: Path, stack: ExitStack, problems: Problems) -> list[Any]:
    """rosbags' readers: the folder as its metadata says, else each file in it that opens."""
    paths = [path]
    if path.is_dir() and not (path / METADATA_FILE).exists():
        paths = _files(path)
        problems.add(path.name, f"has no {METADATA_FILE}; its files are read one by one")
    readers: list[Any] = []
    reasons = []
    for file in paths:
        try:
            readers.append(stack.enter_context(Reader(file)))
        except Exception as error:  # whatever a foreign file provokes in its reader
            damaged = _Damaged.opened(file)
            if damaged is not None:
                problems.add(
                    file.name,
                    f"is not as rosbags wants it ({_reason(error)}); what is whole is read",
                )
                readers.append(damaged)
            else:
                reasons.append((file, _reason(error)))
    if not readers:
        stack.close()
        file, reason = reasons[0]
        raise InputError(
            f"{file}: cannot be read as a ROS 2 recording ({reason}); allowed are rosbag2 folders, "
            ".db3 and .mcap files that were closed."
        )
    for file, reason in reasons:
        problems.add(file.name, f"cannot be read: {reason}")
    return readers


@dataclass(frozen=True)
class _Topic:
    topic: str
    msgtype: str
    msgcount: int


class _Damaged:
    """An MCAP file that was never closed, or its like, with what `rosbags` has for a whole one."""

    def __init__(self, path: Path, session: Session) -> None:
        self.path = path
        self._session = session
        self.connections = [
            _Topic(name, info.type, info.count)
            for name, info in session.topics.items()
            if info.encoding == "cdr"
        ]

    @staticmethod
    def opened(path: Path) -> _Damaged | None:
        """None for what is no MCAP, or has nothing left to read."""
        files = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
        if not files or any(file.suffix != ".mcap" for file in files):
            return None
        try:
            session = open_session(path)
        except InputError:
            return None
        if session.headers:
            raise InputError(f"{path}: is a session already; allowed are other recordings.")
        return _Damaged(path, session)

    def messages(self, connections: list[_Topic]) -> Iterator[tuple[_Topic, int, bytes]]:
        known = {connection.topic: connection for connection in connections}
        for message in self._session.messages(topics=known):
            yield known[message.topic], message.time, message.data


def _files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix in SUFFIXES)


def _reason(error: Exception) -> str:
    text = str(error).strip().rstrip(".") or type(error).__name__
    return text.splitlines()[0][:200]


class _Check:
    """Tells what the pipeline will refuse, and stamps that go back; messages are kept as is."""

    def __init__(self, problems: Problems) -> None:
        self._problems = problems
        self._stamps: dict[str, int] = {}

    def message(self, stream: Stream, data: bytes) -> None:
        if stream.row.name in _NOT_CHECKED:
            return
        key = f"{stream.prefix}/{stream.suffix}"
        try:
            sample = decode(stream.machine, stream.suffix, data, 0.0)
        except DecodeError as error:
            self._problems.add(key, f"cannot be decoded: {error}", kind=f"{key} malformed")
            return
        if not _finite(sample):
            self._problems.add(
                key, "values that are not finite; the cockpit refuses these", kind=f"{key} NaN"
            )
        stamp = _stamp(data)
        last = self._stamps.get(key, stamp)
        if stamp < last:
            self._problems.add(
                key,
                f"the machine's clock goes back by {(last - stamp) / 1e9:.3f} s; "
                "the cockpit takes the newest stamp as the present",
                kind=f"{key} stamp",
            )
        self._stamps[key] = stamp


def _finite(sample: Any) -> bool:
    if isinstance(sample, JointSample):
        return bool(np.isfinite(sample.position).all() and np.isfinite(sample.velocity).all())
    for value in vars(sample).values():
        if isinstance(value, float):
            if not math.isfinite(value):
                return False
        elif isinstance(value, np.ndarray) and not np.isfinite(value).all():
            return False
    return True


def _stamp(data: bytes) -> int:
    """[ns] of the header that all our ROS 2 types begin with."""
    seconds, nanoseconds = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
