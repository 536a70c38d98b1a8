"""Through an MCAP file record by record: for files cut off, still growing, or without an index."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode

from backend.shell.session.chunks import (
    HEAD,
    LARGEST,
    MAGIC,
    MESSAGE,
    TIMES,
    Chunk,
    Damaged,
    File,
)

RUN = 256 * 1024  # messages outside of chunks are taken together up to this size [bytes]
TELL = 0.01  # progress is told in steps of this share


def walk(path: Path, stream: IO[bytes], size: int, progress: Callable[[float], None]) -> File:
    """All whole records' table of contents; `File.note` says so where the end is missing."""
    walker = _Walker(File(path), stream)
    offset, told, finished = len(MAGIC), 0.0, False
    while offset + HEAD.size <= size and not finished:
        stream.seek(offset)
        opcode, length = HEAD.unpack(stream.read(HEAD.size))
        after = offset + HEAD.size + length
        if opcode == 0 or length > LARGEST or after > size:
            break
        try:
            walker.take(opcode, offset, length)
        except Damaged:
            break
        finished = opcode in (Opcode.DATA_END, Opcode.FOOTER)
        offset = after
        if offset / size - told > TELL:
            told = offset / size
            progress(told)
    walker.close()
    if not finished:
        walker.file.note = "its end is missing; what stands before is shown"
    return walker.file


@dataclass
class _Walker:
    """open: the chunk whose message indexes are being passed; seen: its messages by channel;
    run: messages outside of chunks, taken together.
    """

    file: File
    stream: IO[bytes]
    open: Chunk | None = None
    seen: dict[int, int] = field(default_factory=dict)
    run: Chunk | None = None

    def take(self, opcode: int, offset: int, length: int) -> None:
        """One record; the stream stands at its body. Raises Damaged."""
        if opcode == Opcode.MESSAGE_INDEX and self.open is not None and length >= 6:
            channel, size = struct.unpack("<HI", self.stream.read(6))
            if size:
                self.seen[channel] = size // 16
            return
        body = self.stream.tell()
        self._close_chunk()
        self.stream.seek(body)
        if opcode == Opcode.MESSAGE and length >= MESSAGE.size:
            channel, _, time, _ = MESSAGE.unpack(self.stream.read(MESSAGE.size))
            self._append(channel, time, offset, HEAD.size + length)
        elif opcode == Opcode.CHUNK and length >= TIMES.size:
            self._close_run()
            start, end = TIMES.unpack(self.stream.read(TIMES.size))
            self.open = Chunk(offset, HEAD.size + length, start, end, None)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            self.file.learn(opcode, memoryview(self.stream.read(length)))

    def close(self) -> None:
        """After the last record."""
        self.seen = {}  # the indexes of a chunk that is still open may be cut off: count it
        self._close_chunk()
        self._close_run()

    def _append(self, channel: int, time: int, offset: int, length: int) -> None:
        run = self.run
        if run is not None and (run.offset + run.length != offset or run.length > RUN):
            self._close_run()
            run = None
        if run is None:
            self.run = Chunk(offset, length, time, time, frozenset((channel,)), raw=True)
        else:
            channels = run.channels or frozenset()
            self.run = run._replace(
                length=run.length + length,
                start=min(run.start, time),
                end=max(run.end, time),
                channels=channels if channel in channels else channels | {channel},
            )
        self.file.counts[channel] = self.file.counts.get(channel, 0) + 1

    def _close_run(self) -> None:
        if self.run is not None:
            self.file.chunks.append(self.run)
            self.run = None

    def _close_chunk(self) -> None:
        chunk, self.open = self.open, None
        if chunk is None:
            return
        if not self.seen or not self.seen.keys() <= self.file.topics.keys():
            # Channels are told in the chunk where they first appear, or it has no indexes.
            try:
                messages = self.file.messages(self.stream, chunk)
            except Damaged:
                messages = []  # skipped, and told of, when it is read
            if not self.seen:
                for channel, _, _ in messages:
                    self.seen[channel] = self.seen.get(channel, 0) + 1
        for channel, count in self.seen.items():
            self.file.counts[channel] = self.file.counts.get(channel, 0) + count
        self.file.chunks.append(chunk._replace(channels=frozenset(self.seen) or None))
        self.seen = {}
