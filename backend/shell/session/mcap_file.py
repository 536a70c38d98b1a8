"""Writing one MCAP file so that whatever was written stays readable.

mcap's own writer keeps schemas and channels inside chunks, where one damaged chunk takes them
along, and does not say how far a file is whole after a failed write. Here they stand between the
chunks, every finished chunk goes to the operating system at once, and a failed write is cut off.
"""

from __future__ import annotations

import contextlib
import os
import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
LEVEL = 3  # of zstd
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log and publish time
_HEAD = 22  # bytes of a message record before its data


@dataclass
class _Open:
    """The chunk being filled. entries: by channel, (log time, offset) of its messages."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    begin: int = 0
    end: int = 0
    entries: dict[int, list[tuple[int, int]]] = field(default_factory=dict)


class McapFile:
    """Creates a file, which must not exist. Every method raises OSError when the disk refuses.

    After an OSError the file ends with the last whole record. Then `drop_chunk` and `close` finish
    it as soon as the disk allows it, or `abandon` leaves it without a summary.
    """

    def __init__(self, path: Path, profile: str, library: str) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self.size = 0  # bytes that are whole
        self.counts: dict[int, int] = {}  # messages in finished chunks, by channel
        self.begin, self.end = 0, 0  # log times of all messages in finished chunks
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._open = _Open()
        try:
            self._put(MAGIC + _record(Header(profile, library)))
        except OSError:
            self.abandon()
            raise

    @property
    def filled(self) -> int:
        """Bytes in the chunk being filled, not yet compressed."""
        return self._open.size

    def metadata(self, name: str, texts: dict[str, str]) -> None:
        data = _record(Metadata(name=name, metadata=texts))
        index = MetadataIndex(offset=self.size, length=len(data), name=name)
        self._put(data)
        self._metadata.append(index)

    def schema(self, name: str, encoding: str, data: bytes) -> int:
        """The new schema's id."""
        number = len(self._schemas) + 1
        schema = Schema(id=number, name=name, encoding=encoding, data=data)
        self._put(_record(schema))
        self._schemas.append(schema)
        return number

    def channel(self, topic: str, encoding: str, schema: int) -> int:
        """The new channel's id. schema: 0 for none."""
        number = len(self._channels) + 1
        channel = Channel(
            id=number, topic=topic, message_encoding=encoding, metadata={}, schema_id=schema
        )
        self._put(_record(channel))
        self._channels.append(channel)
        return number

    def message(self, channel: int, time: int, sequence: int, data: bytes) -> None:
        """Into the chunk being filled. time: [ns]."""
        chunk = self._open
        if not chunk.parts:
            chunk.begin = chunk.end = time
        chunk.begin, chunk.end = min(chunk.begin, time), max(chunk.end, time)
        chunk.entries.setdefault(channel, []).append((time, chunk.size))
        head = _MESSAGE.pack(Opcode.MESSAGE, _HEAD + len(data), channel, sequence, time, time)
        chunk.parts += (head, data)
        chunk.size += len(head) + len(data)

    def finish_chunk(self) -> None:
        """Hands the chunk to the operating system; nothing happens when it is empty."""
        chunk = self._open
        if not chunk.parts:
            return
        plain = b"".join(chunk.parts)
        packed = zstandard.compress(plain, LEVEL)
        head = _record(
            Chunk(
                compression="zstd",
                data=packed,
                message_start_time=chunk.begin,
                message_end_time=chunk.end,
                uncompressed_crc=zlib.crc32(plain),
                uncompressed_size=len(plain),
            )
        )
        offsets, blobs, at = {}, [head], self.size + len(head)
        for channel, entries in chunk.entries.items():
            offsets[channel] = at
            blobs.append(_record(MessageIndex(channel_id=channel, records=entries)))
            at += len(blobs[-1])
        index = ChunkIndex(
            message_start_time=chunk.begin,
            message_end_time=chunk.end,
            chunk_start_offset=self.size,
            chunk_length=len(head),
            message_index_offsets=offsets,
            message_index_length=at - self.size - len(head),
            compression="zstd",
            compressed_size=len(packed),
            uncompressed_size=len(plain),
        )
        self._put(b"".join(blobs))
        self._chunks.append(index)
        self.begin = min(self.begin, chunk.begin) if self.counts else chunk.begin
        self.end = max(self.end, chunk.end)
        for channel, entries in chunk.entries.items():
            self.counts[channel] = self.counts.get(channel, 0) + len(entries)
        self._open = _Open()

    def drop_chunk(self) -> None:
        """Forgets the messages in the chunk being filled."""
        self._open = _Open()

    def close(self) -> None:
        """The last chunk and the summary. Calling again is harmless."""
        if self._fd < 0:
            return
        self.finish_chunk()
        start = self.size + len(_record(DataEnd(0)))
        summary, offset_start = self._summary(start)
        footer = Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=0)
        body = _record(footer)[:-4]
        crc = zlib.crc32(summary + body)
        self._put(_record(DataEnd(0)) + summary + body + struct.pack("<I", crc) + MAGIC)
        self.abandon()

    def abandon(self) -> None:
        """Closes the file as it is, without a summary: for `cockpit recover` and readers of
        unfinished files. Calling again is harmless.
        """
        if self._fd >= 0:
            with contextlib.suppress(OSError):
                os.close(self._fd)
            self._fd = -1

    def _summary(self, start: int) -> tuple[bytes, int]:
        """The summary, and where its offsets begin in the file.

        Schemas in JSON come after the channels: rosbags stops at a channel whose schema it knows
        not to be of ROS, and takes one that it has not seen yet as it is.
        """
        ros = [schema for schema in self._schemas if schema.encoding != "jsonschema"]
        others = [schema for schema in self._schemas if schema.encoding == "jsonschema"]
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self.counts,
            chunk_count=len(self._chunks),
            message_count=sum(self.counts.values()),
            message_start_time=self.begin,
            message_end_time=self.end,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, list[Any]]] = [
            (Opcode.SCHEMA, ros),
            (Opcode.CHANNEL, self._channels),
            (Opcode.SCHEMA, others),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        data, offsets = b"", b""
        for opcode, records in groups:
            group = b"".join(map(_record, records))
            if group:
                entry = SummaryOffset(
                    group_opcode=opcode, group_start=start + len(data), group_length=len(group)
                )
                offsets += _record(entry)
            data += group
        return data + offsets, start + len(data)

    def _put(self, data: bytes) -> None:
        """All of `data`, or nothing of it."""
        view, done = memoryview(data), 0
        try:
            while done < len(data):
                done += os.write(self._fd, view[done:])
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._fd, self.size)
                os.lseek(self._fd, self.size, os.SEEK_SET)
            raise
        self.size += len(data)


def _record(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())
