"""A recorded session: one MCAP file, or a folder of consecutive ones, entered anywhere at once.

`Message.time` and all times of a session are log times on a line that never runs backward, see
`timeline`; in a recording whose clock was never set back they are the log times themselves.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from itertools import groupby, islice
from pathlib import Path

from backend.errors import InputError
from backend.shell.session import format as our_format
from backend.shell.session.chunks import (
    MAGIC,
    Damaged,
    File,
    check_magic,
    summary,
)
from backend.shell.session.files import Streams, missing, paths_of, shared
from backend.shell.session.format import Header, Message
from backend.shell.session.timeline import JUMP, Record, Stretch, Timeline, in_order
from backend.shell.session.walk import walk

MOST_NOTES = 50

Progress = Callable[[float], None]


@dataclass(frozen=True)
class TopicInfo:
    """type: name of the message's schema; encoding: "cdr", "json", ...; count: messages."""

    type: str
    encoding: str
    count: int


@dataclass(frozen=True)
class Part:
    """One file of a session. begin, end: of its messages [ns]; header: None in foreign files."""

    path: Path
    header: Header | None
    begin: int
    end: int


@dataclass
class Session:
    """What `open_session` found. begin, end [ns since 1970]; notes: what could not be read.

    offset: [ns] from the monotonic clock of the recording to 1970; in foreign files `begin`.
    """

    path: Path
    parts: tuple[Part, ...]
    topics: dict[str, TopicInfo]
    begin: int
    end: int
    _files: list[File]
    _timeline: Timeline
    _notes: list[str] = field(default_factory=list)

    @property
    def title(self) -> str:
        return self.headers[0].recording if self.headers else self.path.stem

    @property
    def headers(self) -> tuple[Header, ...]:
        return tuple(part.header for part in self.parts if part.header is not None)

    @property
    def offset(self) -> int:
        return self.headers[0].offset if self.headers else self.begin

    @property
    def notes(self) -> tuple[str, ...]:
        """In words; grows while damaged places are met."""
        return tuple(self._notes)

    @property
    def gaps(self) -> tuple[tuple[int, int], ...]:
        """(start, end) [ns] of stretches longer than a second in which nothing was recorded."""
        found = []
        line = self._timeline
        for reached, stretch in zip(line.reached, line.stretches[1:], strict=False):
            if stretch.start - reached > JUMP and stretch.file not in line.unsorted:
                found.append((reached, stretch.start))
        return tuple(found)

    def note(self, text: str) -> None:
        """One more thing that could not be read; the same words are said once."""
        if text not in self._notes and len(self._notes) < MOST_NOTES:
            self._notes.append(text)

    def messages(
        self,
        start: int | None = None,
        end: int | None = None,
        topics: Collection[str] | None = None,
    ) -> Iterator[Message]:
        """Messages with start <= time <= end [ns], in file order; chunks without any of `topics`
        are not read. Damaged chunks are left out and noted.
        """
        wanted = [
            {k for k, (topic, _, _) in file.topics.items() if topics is None or topic in topics}
            for file in self._files
        ]
        with Streams(self._files) as streams:

            def read(stretch: Stretch) -> list[Record]:
                try:
                    return stretch.moved(streams.messages(stretch))
                except (Damaged, OSError) as error:
                    self._skipped(stretch, str(error))
                    return []

            chosen = self._chosen(start, end, wanted, by_topic=topics is not None)
            for number, stretches in groupby(chosen, key=lambda stretch: stretch.file):
                if number in self._timeline.unsorted:
                    lists = in_order(list(stretches), read)
                else:
                    lists = ((stretch, read(stretch)) for stretch in stretches)
                known, names = wanted[number], self._files[number].topics
                for _, records in lists:
                    for channel, time, data in records:
                        if (
                            (channel in known or (topics is None and channel in names))
                            and (start is None or time >= start)
                            and (end is None or time <= end)
                        ):
                            yield Message(names[channel][0], time, data)

    def _chosen(
        self, start: int | None, end: int | None, wanted: list[set[int]], by_topic: bool
    ) -> Iterator[Stretch]:
        """Stretches that may hold what is asked for, in file order."""
        line = self._timeline
        first = 0 if start is None else bisect_left(line.reached, start)
        for stretch in islice(line.stretches, first, None):
            if end is not None and stretch.start > end:
                if stretch.start > end + JUMP and not line.unsorted:
                    return
                continue
            if start is not None and stretch.end < start:
                continue
            channels = stretch.chunk.channels
            if by_topic and channels is not None and not channels & wanted[stretch.file]:
                continue
            yield stretch

    def last_before(self, time: int, topic: str) -> int | None:
        """When the newest message of a topic before `time` came [ns]; chunks without it are not
        read.
        """
        line = self._timeline
        wanted = [{k for k, (name, *_) in f.topics.items() if name == topic} for f in self._files]
        last = bisect_left(line.reached, time)
        for stretch in reversed(line.stretches[: last + 1]):
            channels = stretch.chunk.channels
            if channels is not None and not channels & wanted[stretch.file]:
                continue
            found = [
                m.time for m in self.messages(stretch.start, min(stretch.end, time - 1), [topic])
            ]
            if found:
                return max(found)
        return None

    def _skipped(self, stretch: Stretch, why: str) -> None:
        name = self._files[stretch.file].path.name
        at, span = (stretch.start - self.begin) / 1e9, (stretch.end - stretch.start) / 1e9
        self.note(f"{name}: {span:.1f} s at {at:.1f} s are damaged and left out ({why})")


def open_session(path: Path, progress: Progress | None = None) -> Session:
    """A file or folder of files. progress: told a share, 0 to 1.

    Raises InputError where nothing can be read; what is wrong with a part becomes a note.
    """
    tell = progress or (lambda _: None)
    paths = paths_of(path)
    files: list[File] = []
    headers: list[Header | None] = []
    notes: list[str] = []
    refused: InputError | None = None
    for k, one in enumerate(paths):
        try:
            file = _read(one, lambda share, k=k: tell((k + share) / len(paths)))  # type: ignore[misc]
            header = _header(file)
        except InputError as error:
            refused = refused or error
            notes.append(str(error).rstrip("."))
            continue
        if file.note:
            notes.append(f"{one.name}: {file.note}")
        if file.chunks:
            files.append(file)
            headers.append(header)
        elif len(paths) == 1:
            raise InputError(f"{one}: holds no complete message; nothing can be shown.")
        else:
            notes.append(f"{one.name}: holds no complete message")
        tell((k + 1) / len(paths))
    if not files:
        raise refused or InputError(f"{path}: holds no complete message; nothing can be shown.")
    order = sorted(range(len(files)), key=lambda k: _place(headers[k], k))
    files, headers = [files[k] for k in order], [headers[k] for k in order]
    return _joined(path, files, headers, notes)


def _place(header: Header | None, k: int) -> tuple[int, int]:
    return (header.part if header is not None else k, k)


def _read(path: Path, progress: Progress) -> File:
    try:
        with path.open("rb") as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            check_magic(path, stream.read(len(MAGIC)), size)
            try:
                found = summary(path, stream, size)
            except Damaged:
                found = None
            return found or walk(path, stream, size, progress)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error


def _header(file: File) -> Header | None:
    texts = file.metadata.get(our_format.METADATA)
    return None if texts is None else Header.read(texts, str(file.path))


def _joined(
    path: Path, files: list[File], headers: list[Header | None], notes: list[str]
) -> Session:
    """The files on one time line."""
    line = Timeline()
    parts = []
    for k, (file, header) in enumerate(zip(files, headers, strict=True)):
        begin, end = line.add(k, file, ours=header is not None)
        parts.append(Part(file.path, header, begin, end))
    return Session(
        path=path,
        parts=tuple(parts),
        topics=_topics(files),
        begin=min(part.begin for part in parts),
        end=max(part.end for part in parts),
        _files=files,
        _timeline=line,
        _notes=[*notes, *line.notes, *missing(headers), *shared(files)][:MOST_NOTES],
    )


def _topics(files: list[File]) -> dict[str, TopicInfo]:
    found: dict[str, TopicInfo] = {}
    for file in files:
        for channel, (topic, schema, encoding) in file.topics.items():
            known, kind = found.get(topic), file.schemas.get(schema, "")
            count = file.counts.get(channel, 0) + (known.count if known else 0)
            found[topic] = TopicInfo(kind, encoding, count)
    return dict(sorted(found.items()))
