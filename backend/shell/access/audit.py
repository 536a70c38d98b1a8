"""The audit log: who came, who was refused, who moved what. JSON lines, only appended."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

log = logging.getLogger(__name__)

WAITING = 10_000  # entries not yet on the disk; more are counted as lost
AGAIN = 1.0  # between attempts to write [s]
_END = b""


class Audit:
    """Appends to a file of mode 0600, in a thread of its own: `write` never waits.

    path: None for no log; clock: seconds since 1970.
    """

    def __init__(self, path: Path | None, clock: Callable[[], float] = time.time) -> None:
        self.path = path
        self._clock = clock
        self._queue: queue.Queue[bytes] = queue.Queue(WAITING)
        self._lost = 0
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        if path is not None:
            self._thread = threading.Thread(target=self._run, name="audit", daemon=True)
            self._thread.start()

    def write(self, event: str, who: str | None, details: Mapping[str, Any]) -> None:
        """One line, as `AuditEntry` describes it. details: anything that JSON has a word for."""
        if self._thread is None:
            return
        entry = {"time": self._clock(), "event": event, "who": who, "details": dict(details)}
        try:
            self._queue.put_nowait(msgspec.json.encode(entry, enc_hook=str) + b"\n")
        except queue.Full:
            self._lost += 1

    def close(self, timeout: float = 2.0) -> None:
        """Writes what waits, and ends."""
        if self._thread is not None and not self._closing.is_set():
            self._closing.set()
            with contextlib.suppress(queue.Full):  # then the thread ends with the program
                self._queue.put_nowait(_END)
            self._thread.join(timeout)

    def _run(self) -> None:
        while (line := self._queue.get()) != _END:
            self._append(line)
            if self._lost:
                lost, self._lost = self._lost, 0
                entry = {"time": self._clock(), "event": "lost", "who": None}
                self._append(msgspec.json.encode({**entry, "details": {"lines": lost}}) + b"\n")

    def _append(self, line: bytes) -> None:
        """Tries until it is written, or the program ends."""
        said = False
        while True:
            try:
                append(self.path, line)
                return
            except OSError as error:
                if not said:
                    log.error("the audit log cannot be written: %s", error)
                    said = True
            if self._closing.wait(AGAIN):
                return


def append(path: Path | None, line: bytes) -> None:
    """Appends a line to a file of mode 0600. Raises OSError; then nothing of it is there."""
    assert path is not None
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o600)
    try:
        os.fchmod(descriptor, 0o600)
        before = os.fstat(descriptor).st_size
        written = os.write(descriptor, line)
        if written < len(line):
            os.ftruncate(descriptor, before)
            raise OSError(28, "no space left")
    finally:
        os.close(descriptor)
