"""What machines did lately: their postures of the last seconds, and whose are asked for."""

from __future__ import annotations

import math
import threading
from collections import deque

from backend.fusion.pose import Validity
from backend.pipeline.records import Snapshot

SPAN = 20.0
"""[s] that are kept."""

PERIOD = 0.1
"""[s] between two kept postures."""

ASKED = 6.0
"""[s] for which a page's question holds; it asks again while it shows the answer."""

Posture = tuple[float, ...]


class Recent:
    """Told every snapshot; asked from other threads. Times are those of snapshots."""

    def __init__(self) -> None:
        self._kept: dict[str, deque[tuple[float, Posture]]] = {}
        self._asked: dict[str, float] = {}
        self._now = -math.inf
        self._lock = threading.Lock()

    def keep(self, snapshot: Snapshot) -> None:
        """Takes the joints of all machines that are known."""
        with self._lock:
            self._now = snapshot.time
            for name, state in snapshot.machines.items():
                known = state.pose.validity is Validity.VALID and state.body is not None
                kept = self._kept.setdefault(name, deque())
                if known and (not kept or snapshot.time - kept[-1][0] > 0.9 * PERIOD):
                    kept.append((snapshot.time, tuple(state.pose.joints.tolist())))
                while kept and kept[0][0] < snapshot.time - SPAN:
                    kept.popleft()

    def ask(self, name: str) -> None:
        """Somebody looks at what depends on it."""
        with self._lock:
            self._asked[name] = self._now

    def wanted(self) -> dict[str, tuple[Posture, ...]]:
        """The postures of those that somebody looks at now, the oldest first [rad]."""
        with self._lock:
            return {
                name: tuple(q for _, q in self._kept.get(name, ()))
                for name, since in self._asked.items()
                if self._now - since <= ASKED
            }
