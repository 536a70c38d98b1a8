"""Reading a cut or damaged MCAP file: every undamaged chunk, whatever is in between."""

from __future__ import annotations

import contextlib
import mmap
import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import mcap.records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.stream_reader import breakup_chunk

from backend.errors import InputError
from backend.shell.session.format import METADATA, PROFILE, Header
from backend.shell.session.mcap_file import MAGIC

_HEAD = 9  # of a record: opcode, length
_CHUNK_HEAD = re.compile(
    # opcode, length; times, size, crc; one of the compressions that MCAP knows
    rb"\x06[\s\S]{6}\x00\x00[\s\S]{28}(?:\x04\x00\x00\x00zstd|\x03\x00\x00\x00lz4|\x00{4})"
)
_READ: dict[int, Any] = {
    Opcode.HEADER: mcap.records.Header,
    Opcode.SCHEMA: mcap.records.Schema,
    Opcode.CHANNEL: mcap.records.Channel,
    Opcode.CHUNK: mcap.records.Chunk,
    Opcode.METADATA: mcap.records.Metadata,
    Opcode.MESSAGE_INDEX: mcap.records.MessageIndex,
    Opcode.ATTACHMENT: mcap.records.Attachment,
}
_DESCRIBING = re.compile(rb"[\x03\x04][\s\S]{2}\x00{6}")  # a schema or channel below 64 KiB
_DATA = {*_READ, Opcode.MESSAGE}  # what may stand before the end of the data
_ENDS = {Opcode.DATA_END: 4, Opcode.FOOTER: 20}  # and their lengths


@dataclass(frozen=True)
class Skipped:
    """Bytes that were not read. at: where they begin; why: in words."""

    at: int
    bytes: int
    why: str


@dataclass
class Saved:
    """What was read of one file. begin, end: log times [ns]; whole: it had its summary, and nothing
    was skipped; last: sequence number of the last message, None without messages.
    """

    path: Path
    size: int
    chunks: int = 0
    messages: int = 0
    begin: int = 0
    end: int = 0
    whole: bool = False
    last: int | None = None
    skipped: list[Skipped] = field(default_factory=list)
    unknown: int = 0  # messages of channels that the damage took along


@dataclass(frozen=True)
class Read:
    """A message with the records that describe it. schema: None when the file has none."""

    schema: Any
    channel: Any
    message: Any


class Damaged:
    """Reads a file from its first byte to its last, whatever is in between.

    Raises InputError for files that are empty, that are of another kind, or of a future version.
    profile, metadata: as met so far while reading.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._stream = path.open("rb")
            size = path.stat().st_size
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror}).") from error
        self.saved = Saved(path, size)
        self.profile = PROFILE
        self.metadata: dict[str, dict[str, str]] = {}
        self._schemas: dict[int, Any] = {}
        self._channels: dict[int, Any] = {}
        self._end = size
        if size == 0:
            self._stream.close()
            raise InputError(f"{path}: is empty; allowed is an MCAP file.")
        self._map = mmap.mmap(self._stream.fileno(), 0, access=mmap.ACCESS_READ)
        start = self._map[: len(MAGIC)]
        if start != MAGIC and start[:5] == MAGIC[:5] and start[6:] == MAGIC[6:]:
            raise InputError(
                f"{path}: is of MCAP version {chr(start[5])!r}; allowed is version '0'."
            )
        if start != MAGIC and not MAGIC.startswith(start) and not _CHUNK_HEAD.search(self._map):
            raise InputError(
                f"{path}: does not begin as an MCAP file does; allowed is such a file."
            )
        self._read_summary()

    def close(self) -> None:
        self._map.close()
        self._stream.close()

    def messages(self, progress: Callable[[float], None] = lambda _: None) -> Iterator[Read]:
        """Every message of every undamaged chunk, in the order of the file. progress: 0 to 1."""
        saved = self.saved
        at = len(MAGIC) if self._map[: len(MAGIC)] == MAGIC else 0
        while at < self._end:
            try:
                opcode, length = self._head(at)
                if _ENDS.get(opcode) == length:
                    break
                if opcode not in _DATA:
                    raise _Damage(f"{opcode:#04x} is no kind of record that belongs here")
                content = self._map[at + _HEAD : at + _HEAD + length]
                found = self._take(opcode, content)
            except _Damage as bad:
                following = self._next_chunk(at + 1)
                self._salvage(at + 1, following)
                saved.skipped.append(Skipped(at, following - at, str(bad)))
                at = following
                continue
            yield from found
            at += _HEAD + length
            progress(at / max(1, saved.size))
        saved.whole &= not saved.skipped and not saved.unknown

    def _head(self, at: int) -> tuple[int, int]:
        if at + _HEAD > self._end:
            raise _Damage("the file ends within a record")
        opcode, length = struct.unpack_from("<BQ", self._map, at)
        if at + _HEAD + length > self._end:
            raise _Damage("the file ends within a record")
        return opcode, length

    def _take(self, opcode: int, content: bytes) -> list[Read]:
        """What a record adds. Raises _Damage when it is damaged."""
        try:
            if opcode == Opcode.MESSAGE:
                stream = ReadDataStream(BytesIO(content))
                return self._described([mcap.records.Message.read(stream, len(content))])
            stream = ReadDataStream(BytesIO(content))
            record = _READ[opcode].read(stream)
            if stream.count != len(content):
                raise ValueError(f"{len(content)} bytes long instead of {stream.count}")
            if opcode == Opcode.CHUNK:
                records = breakup_chunk(record, validate_crc=True)
                self.saved.chunks += 1
                return self._described(records)
        except Exception as error:  # whatever garbage provokes in a parser
            what = "a chunk" if opcode == Opcode.CHUNK else "a record"
            raise _Damage(f"{what} is damaged ({error or type(error).__name__})") from error
        self._learn(record)
        return []

    def _described(self, records: list[Any]) -> list[Read]:
        found = []
        saved = self.saved
        for record in records:
            if not isinstance(record, mcap.records.Message):
                self._learn(record)
                continue
            channel = self._channels.get(record.channel_id)
            if channel is None:
                saved.unknown += 1
                continue
            saved.begin = min(saved.begin, record.log_time) if saved.messages else record.log_time
            saved.end = max(saved.end, record.log_time)
            saved.messages += 1
            saved.last = record.sequence
            found.append(Read(self._schemas.get(channel.schema_id), channel, record))
        return found

    def _learn(self, record: Any) -> None:
        if isinstance(record, mcap.records.Schema):
            self._schemas[record.id] = record
        elif isinstance(record, mcap.records.Channel):
            self._channels[record.id] = record
        elif isinstance(record, mcap.records.Header):
            self.profile = record.profile
        elif isinstance(record, mcap.records.Metadata):
            if record.name == METADATA:
                Header.read(record.metadata, str(self.saved.path))  # of a future format: InputError
            self.metadata.setdefault(record.name, record.metadata)

    def _read_summary(self) -> None:
        """Schemas and channels of the summary, if there is one: the data may have lost them."""
        footer = _HEAD + 20
        at = self._end - len(MAGIC) - footer
        if at < len(MAGIC) or self._map[-len(MAGIC) :] != MAGIC:
            return
        opcode, length, start = struct.unpack_from("<BQQ", self._map, at)
        if (opcode, length) != (Opcode.FOOTER, 20) or not len(MAGIC) < start <= at:
            return
        try:
            where = start
            while where < at:
                opcode, length = self._head(where)
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._take(opcode, self._map[where + _HEAD : where + _HEAD + length])
                where += _HEAD + length
        except _Damage:
            return
        self._end = start
        self.saved.whole = True

    def _salvage(self, begin: int, end: int) -> None:
        """Schemas and channels in a damaged stretch, of which every length agrees."""
        at = begin
        while found := _DESCRIBING.search(self._map, at, end):
            at = found.start() + 1
            opcode, length = struct.unpack_from("<BQ", self._map, found.start())
            if found.end() + length > end:
                continue
            with contextlib.suppress(_Damage):
                self._take(opcode, self._map[found.end() : found.end() + length])
                at = found.end() + length

    def _next_chunk(self, at: int) -> int:
        """Where the next chunk begins that is whole in its lengths; the end when there is none."""
        while found := _CHUNK_HEAD.search(self._map, at, self._end):
            start, size_at = found.span()
            at = start + 1
            if size_at + 8 > self._end:
                continue
            (length,) = struct.unpack_from("<Q", self._map, start + 1)
            (size,) = struct.unpack_from("<Q", self._map, size_at)
            end = start + _HEAD + length
            if end <= self._end and end == size_at + 8 + size:
                return start
        return self._end


class _Damage(Exception):  # noqa: N818 - a fact about a file
    """A record that cannot be read; the text says why."""
