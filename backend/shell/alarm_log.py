"""Every alarm of a running cockpit, kept in memory for the page and on disk for later.

On disk one JSON line for each that ended. The disk is written to by a thread of its own: a full or
slow disk holds nothing up, and is told as a notice.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from backend.documents.alarms import episode_document
from backend.pipeline.records import Notice, Snapshot
from backend.safety.history import Episode, History, silence, update
from backend.shell.app.wire import dumps

log = logging.getLogger(__name__)
WAITING = 1000
"""Lines that wait for the disk; beyond them the oldest alarms are only in the recording."""


class AlarmLog:
    """path: of the .jsonl file, None to keep none; labels: of the machines."""

    def __init__(
        self,
        path: Path | None,
        labels: dict[str, str],
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self._path = path
        self._labels = labels
        self._clock, self._wall = clock, wall
        self._lock = threading.Lock()
        self._history = History()
        self._lines: queue.Queue[str | None] = queue.Queue(WAITING)
        self._trouble = ""
        self._thread = threading.Thread(target=self._write, name="alarm log", daemon=True)

    def start(self) -> None:
        if self._path is not None:
            self._thread.start()

    def close(self) -> None:
        """Writes what still lasts as unfinished, then ends."""
        with self._lock:
            for episode in self._history.present.values():
                self._put(episode)
        if self._thread.is_alive():
            self._lines.put(None)
            self._thread.join(timeout=2.0)

    def after_cycle(self, snapshot: Snapshot) -> None:
        """Once every cycle of the fast loop."""
        with self._lock:
            self._history, ended = update(
                self._history, snapshot.alarms, snapshot.concerns, snapshot.time
            )
            for episode in ended:
                self._put(episode)

    def silence(self, name: str, machine: str, who: str) -> None:
        """Somebody acknowledged an alarm."""
        with self._lock:
            self._history = silence(self._history, name, machine, who, self._clock())

    def notices(self) -> tuple[Notice, ...]:
        return (Notice("alarm log", self._trouble),) if self._trouble else ()

    def document(self) -> list[dict[str, Any]]:
        """What lasts, then what ended, the newest first: backend.documents.alarms."""
        with self._lock:
            history = self._history
        episodes = (*history.present.values(), *reversed(history.past))
        return [self._document(episode) for episode in episodes]

    def _document(self, episode: Episode) -> dict[str, Any]:
        return episode_document(episode, self._labels, self._wall() - self._clock())

    def _put(self, episode: Episode) -> None:
        if self._path is None:
            return
        try:
            self._lines.put_nowait(dumps(self._document(episode)))
        except queue.Full:
            self._trouble = f"{self._path}: cannot keep up; alarms are missing in it"

    def _write(self) -> None:
        assert self._path is not None
        while (line := self._lines.get()) is not None:
            try:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                with self._path.open("a", encoding="utf-8") as file:
                    file.write(line + "\n")
                self._trouble = ""
            except OSError as error:
                self._trouble = f"{self._path}: {error.strerror}; alarms are not written"
                log.warning("%s", self._trouble)
