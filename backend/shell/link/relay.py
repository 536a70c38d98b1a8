"""What this backend concluded, published for other hosts."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any

from backend.pipeline.records import Snapshot
from backend.shell.hub import Hub
from backend.shell.link.session import publisher

PERIOD = 0.1  # [s]


class Relay:
    """Publishes the newest snapshot and images at 10 Hz, and alarms when they change.

    texts: JSON of a snapshot, and of its alarms; images: (state time, frame) of every image by
    (kind, pair).
    """

    def __init__(
        self,
        session: Any,
        hub: Hub,
        texts: Callable[[Snapshot], tuple[str, str]],
        images: Callable[[], Mapping[tuple[str, str], tuple[float, bytes]]],
    ) -> None:
        self._hub = hub
        self._session = session
        self._images = images
        self._image_publishers: dict[str, Any] = {}
        self._texts = texts
        self._snapshots = publisher(session, "snapshot")
        self._alarms = publisher(session, "alarm")
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="relay", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=1.0)
        self._snapshots.undeclare()
        self._alarms.undeclare()
        for publisher_ in self._image_publishers.values():
            publisher_.undeclare()

    def _run(self) -> None:
        cycle, said = -1, ""
        sent: dict[tuple[str, str], float] = {}
        while not self._stopping.wait(PERIOD):
            snapshot = self._hub.wait(cycle, PERIOD)
            if snapshot is None:
                continue
            cycle = snapshot.cycle
            text, alarms = self._texts(snapshot)
            self._snapshots.put(text)
            if alarms != said:
                said = alarms
                self._alarms.put(alarms)
            for (kind, pair), (stamp, frame) in self._images().items():
                if sent.get((kind, pair)) != stamp:
                    sent[(kind, pair)] = stamp
                    self._publisher(kind).put(frame)

    def _publisher(self, kind: str) -> Any:
        if kind not in self._image_publishers:
            self._image_publishers[kind] = publisher(self._session, "image", kind=kind)
        return self._image_publishers[kind]
