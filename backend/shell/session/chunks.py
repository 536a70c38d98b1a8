"""One MCAP file as a list of chunks, from its summary.

Chunks are read one by one, so that a file of hours opens at once and is entered anywhere. The
summary's chunk index and the messages in a chunk are unpacked here: a record at a time, as the
library does it, an hour's file would take ten times as long.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics
from mcap.records import Chunk as ChunkRecord
from mcap.stream_reader import get_chunk_data_stream

from backend.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
ALLOWED = "allowed is an MCAP file (.mcap) or a folder of them"
LARGEST = 1 << 30  # no record is longer, no chunk holds more [bytes]
HEAD = struct.Struct("<BQ")  # of every record: opcode, length
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
TIMES = struct.Struct("<QQ")
_FOOTER = struct.Struct("<BQQQI")
_INDEX = struct.Struct("<QQQQI")  # message times, offset, length, size of the channel map
_ENTRY = struct.Struct("<HQ")


class Chunk(NamedTuple):
    """Where messages stand in a file. start, end: log times [ns]; channels: ids of those in it,
    None when not known; raw: message records outside of any chunk.
    """

    offset: int
    length: int
    start: int
    end: int
    channels: frozenset[int] | None
    raw: bool = False


class Damaged(Exception):  # noqa: N818 - told to the reader, who skips the chunk
    """A chunk that does not hold what it promises."""


@dataclass
class File:
    """One file's table of contents. topics: (topic, schema id, encoding) by channel id; schemas:
    names by id; counts: messages by channel id; metadata: by name; note: what is wrong, else empty.
    """

    path: Path
    chunks: list[Chunk] = field(default_factory=list)
    topics: dict[int, tuple[str, int, str]] = field(default_factory=dict)
    schemas: dict[int, str] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    note: str = ""

    def messages(self, stream: IO[bytes], chunk: Chunk) -> list[tuple[int, int, bytes]]:
        """(channel id, log time [ns], data) of a chunk in file order. Raises Damaged."""
        stream.seek(chunk.offset)
        data = stream.read(chunk.length)
        if len(data) < chunk.length:
            raise Damaged("the file ends in it")
        if not chunk.raw:
            data = _inflated(data)
        found = []
        for opcode, body in records(data):
            if opcode == Opcode.MESSAGE:
                if len(body) < MESSAGE.size:
                    raise Damaged("a message is too short")
                channel, _, time, _ = MESSAGE.unpack_from(body)
                found.append((channel, time, bytes(body[MESSAGE.size :])))
            else:
                self.learn(opcode, body)
        return found

    def learn(self, opcode: int, body: memoryview) -> None:
        """Takes note of a schema, a channel or metadata; other records say nothing here."""
        try:
            stream = ReadDataStream(BytesIO(body))
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self.schemas.setdefault(schema.id, schema.name)
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(stream)
                entry = (channel.topic, channel.schema_id, channel.message_encoding)
                self.topics.setdefault(channel.id, entry)
            elif opcode == Opcode.METADATA:
                metadata = Metadata.read(stream)
                self.metadata.setdefault(metadata.name, metadata.metadata)
            elif opcode == Opcode.STATISTICS:
                self.counts = dict(Statistics.read(stream).channel_message_counts)
        except Exception as error:  # whatever damaged bytes provoke in the library
            raise Damaged(f"a record cannot be read ({error})") from error


def check_magic(path: Path, magic: bytes, size: int) -> None:
    """Raises InputError for what is no MCAP file at all."""
    if size == 0:
        raise InputError(f"{path}: is empty; {ALLOWED}.")
    if magic == MAGIC:
        return
    if magic[:5] == MAGIC[:5] and len(magic) == len(MAGIC):
        version = chr(magic[5]) if 32 < magic[5] < 127 else "?"
        raise InputError(f"{path}: is MCAP of version {version}; allowed is version 0.")
    if len(magic) < len(MAGIC) and MAGIC.startswith(magic):
        raise InputError(f"{path}: was cut off at its very beginning; nothing can be read.")
    raise InputError(f"{path}: is not an MCAP file; {ALLOWED}.")


def summary(path: Path, stream: IO[bytes], size: int) -> File | None:
    """From the file's summary; None where there is none that tells of the messages.

    Raises Damaged.
    """
    tail = _FOOTER.size + len(MAGIC)
    if size < tail + len(MAGIC):
        return None
    stream.seek(size - tail)
    footer = stream.read(tail)
    opcode, length, start, _, crc = _FOOTER.unpack_from(footer)
    if footer[-len(MAGIC) :] != MAGIC or opcode != Opcode.FOOTER or length != 20 or start == 0:
        return None
    end = size - tail
    if start > end:
        return None
    stream.seek(start)
    data = stream.read(end - start)
    # The checksum covers the summary and the footer up to itself.
    if crc and zlib.crc32(footer[: _FOOTER.size - 4], zlib.crc32(data)) != crc:
        return None
    file = File(path)
    metadata = []
    for opcode, body in records(data):
        if opcode == Opcode.CHUNK_INDEX:
            file.chunks.append(_index(body))
        elif opcode == Opcode.METADATA_INDEX:
            metadata.append(struct.unpack_from("<QQ", body))
        else:
            file.learn(opcode, body)
    if bool(file.chunks) != any(file.counts.values()) or not (file.chunks or file.topics):
        return None  # messages outside of chunks, or not counted
    for offset, length in metadata:
        stream.seek(offset)
        for opcode, body in records(stream.read(min(length, LARGEST))):
            file.learn(opcode, body)
    if file.chunks and not file.topics:
        _learn_topics(file, stream)
    file.chunks.sort(key=lambda chunk: chunk.offset)
    return file


def _index(body: memoryview) -> Chunk:
    if len(body) < _INDEX.size:
        raise Damaged("an index entry is too short")
    start, end, offset, length, size = _INDEX.unpack_from(body)
    entries = body[_INDEX.size : _INDEX.size + size]
    channels = frozenset(_ENTRY.unpack_from(entries, k)[0] for k in range(0, size, _ENTRY.size))
    return Chunk(offset, length, start, end, channels or None)


def _learn_topics(file: File, stream: IO[bytes]) -> None:
    """Channels from the chunks themselves, where a summary does not repeat them."""
    for chunk in file.chunks:
        if chunk.channels is None or not chunk.channels <= file.topics.keys():
            try:
                file.messages(stream, chunk)
            except Damaged:
                continue


def _inflated(record: bytes) -> bytes:
    """The records in a chunk's record. Raises Damaged."""
    opcode, length = HEAD.unpack_from(record)
    if opcode != Opcode.CHUNK or length != len(record) - HEAD.size:
        raise Damaged("the index points elsewhere")
    try:
        chunk: Any = ChunkRecord.read(ReadDataStream(BytesIO(record[HEAD.size :])))
        if chunk.uncompressed_size > LARGEST:
            raise Damaged(f"it claims {chunk.uncompressed_size} bytes")
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
        data: bytes = stream.read(size)
    except Exception as error:  # whatever damaged bytes provoke in the library and zstd
        raise Damaged(str(error) or type(error).__name__) from error
    return data


def records(data: bytes) -> Iterator[tuple[int, memoryview]]:
    """(opcode, body) of consecutive records. Raises Damaged where one is longer than the data."""
    view = memoryview(data)
    offset, size = 0, len(data)
    while offset < size:
        if offset + HEAD.size > size:
            raise Damaged("a record is cut off")
        opcode, length = HEAD.unpack_from(view, offset)
        offset += HEAD.size
        if length > size - offset:
            raise Damaged("a record is cut off")
        yield opcode, view[offset : offset + length]
        offset += length
