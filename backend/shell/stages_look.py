"""Who looks at what detection makes of the points, and the newest of it: made only when wanted."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from backend.perception.stages import StagedScan

LOOKED = 2.0
"""So long after somebody looked stages are still wanted [s]."""
PERIOD = 0.5
"""At least between two scans whose stages are told [s]."""
OLD = 1.0
"""Older stages are not shown [s]."""


class Look(NamedTuple):
    """stages: None when there are none, or older than OLD; age: of the newest [s], NaN before the
    first since somebody looks; reason: why there are none, else empty.
    """

    stages: StagedScan | None
    age: float = math.nan
    reason: str = ""


class StagesLook:
    """Filled by the thread that has stages made; looked at from any. Times by `clock` [s]."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._stages: StagedScan | None = None
        self._told = -math.inf
        self._looked = -math.inf
        self._lock = threading.Lock()

    def look(self, trouble: str = "") -> Look:
        """The newest stages. Whoever looks does so again and again. trouble: why none may come."""
        now = self._clock()
        with self._lock:
            if now - self._looked > LOOKED:
                self._stages = None  # of the last time that somebody looked
            self._looked = now
            stages = self._stages
        if stages is None:
            return Look(None, reason=trouble or "waiting for a scan")
        age = now - stages.time
        if age > OLD:
            return Look(None, age, trouble or f"no scan for {age:.1f} s")
        return Look(stages, age)

    def wanted(self) -> bool:
        """Whether somebody looks, and has not just been told."""
        now = self._clock()
        with self._lock:
            return now - self._looked <= LOOKED and now - self._told >= PERIOD

    def keep(self, stages: StagedScan) -> None:
        """The newest there are."""
        now = self._clock()
        with self._lock:
            self._stages, self._told = stages, now
