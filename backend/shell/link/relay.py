"""What this backend concluded, published for other hosts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from backend.pipeline.records import Snapshot
from backend.shell.hub import Hub
from backend.shell.link.session import publisher

PERIOD = 0.1  # [s]


class Relay:
    """Publishes the newest snapshot at 10 Hz, and alarms when they change.

    snapshot_text, alarms_text: JSON of a snapshot, and of its alarms.
    """

    def __init__(
        self,
        session: Any,
        hub: Hub,
        snapshot_text: Callable[[Snapshot], str],
        alarms_text: Callable[[Snapshot], str],
    ) -> None:
        self._hub = hub
        self._texts = snapshot_text, alarms_text
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

    def _run(self) -> None:
        cycle, said = -1, ""
        snapshot_text, alarms_text = self._texts
        while not self._stopping.wait(PERIOD):
            snapshot = self._hub.wait(cycle, PERIOD)
            if snapshot is None:
                continue
            cycle = snapshot.cycle
            self._snapshots.put(snapshot_text(snapshot))
            alarms = alarms_text(snapshot)
            if alarms != said:
                said = alarms
                self._alarms.put(alarms)
