"""Image loops: from the newest snapshot in the hub to images in the hub, each at its own rate."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from backend.pipeline.records import ImageStamp, Snapshot
from backend.shell.hub import Hub
from backend.shell.image_worker import WorkerGone
from backend.shell.kinds import Made, Wishes

log = logging.getLogger(__name__)

HISTORY = 500
REFRESH = 0.2  # [s]


@dataclass(frozen=True)
class Timing:
    """Percentiles of one loop's durations [ms] and its achieved rate [Hz]."""

    p50: float
    p95: float
    p99: float
    rate: float


class Stopwatch:
    """The durations of one loop's last cycles."""

    def __init__(self) -> None:
        self._seconds: deque[float] = deque(maxlen=HISTORY)
        self._ends: deque[float] = deque(maxlen=HISTORY)
        self._known = (-math.inf, Timing(0.0, 0.0, 0.0, 0.0))

    def add(self, start: float, end: float) -> None:
        self._seconds.append(end - start)
        self._ends.append(end)

    def timing(self) -> Timing:
        """Of the last cycles; up to REFRESH old, for it is asked for with every snapshot."""
        seconds, ends = list(self._seconds), list(self._ends)
        if len(seconds) < 2:
            return Timing(0.0, 0.0, 0.0, 0.0)
        until, known = self._known
        if not until <= ends[-1] < until + REFRESH:
            p50, p95, p99 = (float(v) for v in 1e3 * np.percentile(seconds, [50, 95, 99]))
            rate = (len(ends) - 1) / max(ends[-1] - ends[0], 1e-9)
            known = Timing(p50, p95, p99, rate)
            self._known = (ends[-1], known)
        return known


class ImageMaker(Protocol):
    """Makes images of a snapshot: a process of its own, or a function in a test."""

    def make(self, snapshot: Snapshot, wishes: Wishes) -> list[Made]: ...


@dataclass(frozen=True)
class ImageLoop:
    """Images that are made together. hz: how often, at most."""

    name: str
    hz: float
    maker: ImageMaker


class ImageLoops:
    """Threads that take the newest snapshot and make images of it until stopped.

    wishes: what operators chose, asked each time; done: told of every finished image;
    once: a state is not made again while neither it nor the wishes change.
    """

    def __init__(
        self,
        hub: Hub,
        loops: Iterable[ImageLoop],
        wishes: Callable[[], Wishes],
        done: Callable[[ImageStamp], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
        once: bool = False,
    ) -> None:
        image_loops = tuple(loops)
        self.timing = {loop.name: Stopwatch() for loop in image_loops}
        self.troubles: dict[str, str] = {}
        self._fatal: dict[str, str] = {}
        self._hub = hub
        self._wishes = wishes
        self._done = done
        self._clock = clock
        self._once = once
        self._stopping = threading.Event()
        self._threads = [
            threading.Thread(
                target=partial(self._guard, loop), name=f"{loop.name} loop", daemon=True
            )
            for loop in image_loops
        ]

    @property
    def failure(self) -> str:
        """What does not run; empty while all does."""
        return "; ".join([*self._fatal.values(), *self.troubles.values()])

    def start(self) -> None:
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        self._stopping.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(timeout=2.0)

    def _guard(self, loop: ImageLoop) -> None:
        try:
            self._run(loop)
        except Exception as error:
            if self._stopping.is_set():
                return  # its process was ended under its hands
            self._fatal[loop.name] = f"{loop.name} loop stopped: {error!r}"
            log.exception("%s", self._fatal[loop.name])

    def _run(self, loop: ImageLoop) -> None:
        made_of: tuple[float, Wishes] | None = None
        for _ in ticks(1.0 / loop.hz, self._clock, self._stopping):
            snapshot = self._hub.latest()
            if snapshot is None:
                continue
            wishes = self._wishes()
            if self._once and made_of == (snapshot.state_time, wishes):
                continue
            start = self._clock()
            try:
                made = loop.maker.make(snapshot, wishes)
            except (WorkerGone, RuntimeError) as error:
                # The last images grow old, and every view says so; the next are tried anew.
                self.troubles[loop.name] = f"{loop.name}: {error}"
                log.warning("%s", self.troubles[loop.name])
                self._stopping.wait(1.0)
                continue
            self.troubles.pop(loop.name, None)
            made_of = (snapshot.state_time, wishes)
            now = self._clock()
            for one in made:
                self._hub.publish_image(one.kind, one.image.key, one.image)
                self._done(
                    ImageStamp(one.image.key, one.kind, one.image.state_time, now, one.seconds)
                )
            if made:
                self.timing[loop.name].add(start, now)


def ticks(period: float, clock: Callable[[], float], stopping: threading.Event) -> Iterator[int]:
    """One tick a period until stopped; ticks that were missed are dropped, never made up for."""
    due = clock()
    tick = 0
    while not stopping.is_set():
        yield tick
        tick += 1
        due = max(due + period, clock() - period)
        stopping.wait(max(0.0, due - clock()))
