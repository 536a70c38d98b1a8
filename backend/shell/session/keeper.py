"""The process that writes a running cockpit's recording to disk, part by part."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

from backend.errors import InputError
from backend.shell.priority import AFTER, set_niceness
from backend.shell.session.format import Header, Message
from backend.shell.session.repair import last_sequence, list_parts, repair_last
from backend.shell.session.ring import (
    LOCK,
    Limits,
    in_use,
    locked,
    make_room,
    part_name,
    parts_of,
    pins_of,
    recordings_of,
)
from backend.shell.session.writer import SessionWriter

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Blocked while the process starts."""
NICENESS = AFTER
"""Before the images: it takes a hundredth of a processor, and an overloaded computer's last seconds
are those that somebody will want to see.
"""
CHUNK_SECONDS = 0.5  # at most this much is in a chunk
SPACE_PERIOD = 0.5  # between two looks at the disk's free space [s]
TRIES = 50  # to finish a part after a failed write
GRACE = 10.0  # from SIGTERM until the process ends, unless its parent does before [s]


class Record(NamedTuple):
    """One message on its way to disk. type: ROS 2 type, empty for ours; time: log_time [ns]."""

    sequence: int
    topic: str
    type: str
    time: int
    data: bytes


@dataclass(frozen=True)
class Plan:
    """What to write where. site_folder: of all the site's recordings; header: of part 0."""

    site_folder: Path
    header: Header
    limits: Limits

    @property
    def folder(self) -> Path:
        return self.site_folder / self.header.recording


@dataclass(frozen=True)
class Order:
    """Records to write. rotate: finish the part after them."""

    records: list[Record]
    rotate: bool = False


@dataclass(frozen=True)
class Answer:
    """durable: sequence of the last record that the operating system has, modulo 2^32, None when
    there is none; trouble: why nothing is written, in words, else empty; part: number of the
    newest, -1 before the first.
    """

    durable: int | None
    trouble: str
    part: int


class Keeper:
    """Writes records into parts and keeps the ring within its limits. Never raises."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._writer: SessionWriter | None = None
        self._cut: list[tuple[SessionWriter, int]] = []  # without a summary; how often it was tried
        self._closing = contextlib.ExitStack()
        self._durable: int | None = None
        self._next = 0
        self._began = self._flushed = self._looked = 0.0
        self._listing = threading.Thread()

    def begin(self) -> Answer:
        """Finishes what earlier processes left cut, and tells how far they came."""
        trouble = ""
        try:
            self._tidy()
        except (OSError, InputError) as error:
            trouble = _words(error)
        return self._answer(trouble)

    def write(self, order: Order) -> Answer:
        start = time.monotonic()
        trouble = ""
        try:
            self._look_at_the_disk(start)
            self._write(order, start)
        except (OSError, InputError) as error:
            trouble = _words(error)
            if self._writer is not None:
                # The parent still has what was not flushed, and sends it again.
                self._writer.drop_chunk()
                self._note_durable(self._writer)
                self._cut.append((self._writer, 0))
                self._writer = None
        return self._answer(trouble)

    def close(self) -> None:
        with contextlib.suppress(OSError, InputError):
            self._finish()
        self._finish_cut()
        if self._writer is not None:
            self._writer.abandon()
        for writer, _ in self._cut:
            writer.abandon()
        if self._listing.is_alive():
            self._listing.join()
        list_parts(self._plan.folder)
        self._closing.close()

    def _finish_cut(self) -> None:
        """Tries again to finish parts of which a write failed."""
        waiting, self._cut = self._cut, []
        for writer, tries in waiting:
            try:
                writer.close()
            except OSError:
                if tries < TRIES:
                    self._cut.append((writer, tries + 1))
                else:
                    writer.abandon()

    def _note_durable(self, writer: SessionWriter) -> None:
        if writer.durable >= 0:
            self._durable = writer.durable % 2**32

    def _write(self, order: Order, now: float) -> None:
        if self._cut:
            self._finish_cut()
        writer = self._writer
        if writer is None:
            writer = self._writer = self._open(now)
        for record in order.records:
            message = Message(record.topic, record.time, record.data)
            writer.write_as(message, record.type, record.sequence)
        if now - self._flushed >= CHUNK_SECONDS:
            writer.flush_chunk()
            self._flushed = now
        self._note_durable(writer)
        limits = self._plan.limits
        full = writer.size >= limits.part_bytes or now - self._began >= limits.part_seconds
        if full or order.rotate:
            self._finish()

    def _open(self, now: float) -> SessionWriter:
        plan = self._plan
        self._lock()
        header = replace(plan.header, part=self._next)
        path = plan.folder / part_name(self._next)
        writer = SessionWriter(path, header)
        self._next += 1
        self._began = self._flushed = now
        make_room(plan.site_folder, plan.limits, time.time(), keep={path})
        return writer

    def _finish(self) -> None:
        writer = self._writer
        if writer is None:
            return
        writer.close()
        self._writer = None
        self._note_durable(writer)
        if not self._listing.is_alive():  # of a long recording it takes a while
            self._listing = threading.Thread(target=list_parts, args=(self._plan.folder,))
            self._listing.daemon = True
            self._listing.start()

    def _lock(self) -> None:
        folder = self._plan.folder
        if not (folder / LOCK).exists() or not in_use(folder):
            folder.mkdir(parents=True, exist_ok=True)
            self._closing.enter_context(locked(folder))

    def _look_at_the_disk(self, now: float) -> None:
        """Stops while there still is room for the summary of what was begun."""
        if now - self._looked < SPACE_PERIOD:
            return
        self._looked = now
        folder = self._plan.site_folder
        while not folder.exists():
            folder = folder.parent
        disk = os.statvfs(folder)
        free = disk.f_bavail * disk.f_frsize
        if free < self._plan.limits.free_bytes:
            self._looked = 0.0  # look again each time
            self._finish()
            raise InputError(f"disk full, {free / 2**20:.0f} MiB left")

    def _tidy(self) -> None:
        """Whole files of the parts that were cut: by a kill in this recording, or in earlier ones
        whose cockpit is gone.
        """
        self._lock()
        own = self._plan.folder
        parts = parts_of(own)
        self._next = parts[-1].number + 1 if parts else 0
        for part in reversed(parts):
            if self._durable is None:
                self._durable = last_sequence(part.path)
            if self._durable is not None:
                break
        repair_last(own)
        for folder in recordings_of(self._plan.site_folder):
            if not in_use(folder):
                repair_last(folder)
        for folder in pins_of(self._plan.site_folder):
            repair_last(folder, shared=True)

    def _answer(self, trouble: str) -> Answer:
        return Answer(self._durable, trouble, self._next - 1)


def _words(error: OSError | InputError) -> str:
    if isinstance(error, OSError):
        return (error.strerror or str(error)).lower()
    return str(error).rstrip(".")


def run(connection: Connection, plan: Plan) -> None:
    """The process: orders in, answers out, until the parent is gone or says None."""
    terminated: list[float] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    signal.signal(signal.SIGTERM, lambda *_: terminated.append(time.monotonic()))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    set_niceness(NICENESS)
    keeper = Keeper(plan)
    with contextlib.suppress(EOFError, OSError):
        connection.send(keeper.begin())
        while not terminated or time.monotonic() - terminated[0] < GRACE:
            if not connection.poll(0.2):
                continue
            order: Order | None = connection.recv()
            if order is None:
                break
            connection.send(keeper.write(order))
    keeper.close()
