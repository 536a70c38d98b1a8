"""The newest snapshot and images, for any number of readers. The latest value wins."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from backend.pipeline.records import Snapshot


class OncePerSnapshot:
    """What is made of a snapshot, made once for all who ask for the same one. Nobody changes it."""

    def __init__(self, make: Callable[[Snapshot], dict[str, Any]]) -> None:
        self._make = make
        self._lock = threading.Lock()
        self._made: tuple[Snapshot | None, dict[str, Any]] = (None, {})

    def __call__(self, snapshot: Snapshot) -> dict[str, Any]:
        with self._lock:
            if self._made[0] is not snapshot:
                self._made = (snapshot, self._make(snapshot))
            return self._made[1]


class Hub:
    """Thread-safe exchange between the fast loop, the image workers and all views."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._snapshot: Snapshot | None = None
        self._images: dict[tuple[str, str], Any] = {}
        self._listeners: list[Callable[[], None]] = []
        self._published = 0.0

    def publish(self, snapshot: Snapshot) -> None:
        with self._changed:
            self._snapshot = snapshot
            self._published = time.monotonic()
            self._changed.notify_all()
            listeners = tuple(self._listeners)
        for notify in listeners:
            notify()

    def publish_image(self, kind: str, key: str, image: Any) -> None:
        """image: a frozen record, for example backend.cspace's image of one ordered pair."""
        with self._changed:
            self._images[(kind, key)] = image

    def latest(self) -> Snapshot | None:
        return self._snapshot

    def age(self) -> float | None:
        """Seconds since the newest snapshot was published; None before the first."""
        return None if self._snapshot is None else time.monotonic() - self._published

    def wait(self, after_cycle: int, timeout: float) -> Snapshot | None:
        """The newest snapshot past `after_cycle`, or None after `timeout` seconds."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._snapshot is not None and self._snapshot.cycle > after_cycle, timeout
            )
            newest = self._snapshot
        return newest if newest is not None and newest.cycle > after_cycle else None

    def image(self, kind: str, key: str) -> Any | None:
        with self._changed:
            return self._images.get((kind, key))

    def images(self) -> dict[tuple[str, str], Any]:
        with self._changed:
            return dict(self._images)

    def listen(self, notify: Callable[[], None]) -> Callable[[], None]:
        """Call `notify` after each snapshot, from the publishing thread; returns the undo."""
        with self._changed:
            self._listeners.append(notify)

        def stop() -> None:
            with self._changed:
                if notify in self._listeners:
                    self._listeners.remove(notify)

        return stop
