"""The fast loop turns what arrived into snapshots; image loops turn snapshots into images.

The fast loop never waits for an image: image loops take the newest snapshot, and what they finish
comes back to the pipeline as a stamped input.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from backend.pipeline.config import Config
from backend.pipeline.records import ImageStamp, Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.shell.hub import Hub
from backend.shell.image_worker import WorkerGone
from backend.shell.kinds import Made, Wishes

log = logging.getLogger(__name__)

HISTORY = 500
REFRESH = 0.2  # [s]


class Source(Protocol):
    """Where inputs come from: the link, a player, a test."""

    def take(self) -> Inputs: ...


@dataclass(frozen=True)
class Timing:
    """Percentiles of one loop's durations [ms] and its achieved rate [Hz]."""

    p50: float
    p95: float
    p99: float
    rate: float


class ImageMaker(Protocol):
    """Makes images of a snapshot: a process of its own, or a function in a test."""

    def make(self, snapshot: Snapshot, wishes: Wishes) -> list[Made]: ...


@dataclass(frozen=True)
class ImageLoop:
    """Images that are made together. hz: how often, at most."""

    name: str
    hz: float
    maker: ImageMaker


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


class Runner:
    """Runs the pipeline in real time until stopped; every view reads the hub.

    loops: what images are made, and how often; wishes: what operators chose, asked each time.
    """

    def __init__(
        self,
        config: Config,
        loops: Iterable[ImageLoop],
        source: Source,
        hub: Hub,
        step_hz: float,
        wishes: Callable[[], Wishes] = lambda: Wishes({}),
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.config = config
        self.hub = hub
        self.step_timing = Stopwatch()
        image_loops = tuple(loops)
        self._wishes = wishes
        self.image_timing = {loop.name: Stopwatch() for loop in image_loops}
        self._source = source
        self._step_period = 1.0 / step_hz
        self._clock = clock
        self._done: deque[ImageStamp] = deque(maxlen=100)
        self._stopping = threading.Event()
        bodies: list[tuple[str, Callable[[], None]]] = [("fast loop", self._fast)]
        bodies += [(f"{loop.name} loop", partial(self._images, loop)) for loop in image_loops]
        self._threads = [
            threading.Thread(target=self._guard, args=(name, loop), name=name, daemon=True)
            for name, loop in bodies
        ]
        self._fatal = ""
        self.troubles: dict[str, str] = {}

    @property
    def failure(self) -> str:
        """What does not run; empty while all does."""
        return self._fatal or "; ".join(self.troubles.values())

    def start(self) -> None:
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        self._stopping.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(timeout=2.0)

    def _guard(self, name: str, loop: Callable[[], None]) -> None:
        try:
            loop()
        except Exception as error:
            # A dead loop must be seen: without new snapshots every view goes stale, and says so.
            self._fatal = f"{name} stopped: {error!r}"
            log.exception("%s", self._fatal)

    def _fast(self) -> None:
        state = initial(self.config)
        for _ in self._ticks(self._step_period):
            start = self._clock()
            inputs = self._source.take()
            finished = tuple(self._done.popleft() for _ in range(len(self._done)))
            if finished:
                inputs = Inputs(
                    inputs.samples,
                    inputs.images + finished,
                    inputs.malformed,
                    inputs.foreign,
                    inputs.lost,
                )
            state, snapshot = step(state, inputs, start, self.config)
            self.step_timing.add(start, self._clock())
            self.hub.publish(snapshot)

    def _images(self, loop: ImageLoop) -> None:
        for _ in self._ticks(1.0 / loop.hz):
            snapshot = self.hub.latest()
            if snapshot is None:
                continue
            start = self._clock()
            try:
                made = loop.maker.make(snapshot, self._wishes())
            except (WorkerGone, RuntimeError) as error:
                # The last images grow old, and every view says so; the next are tried anew.
                self.troubles[loop.name] = f"{loop.name}: {error}"
                log.warning("%s", self.troubles[loop.name])
                self._stopping.wait(1.0)
                continue
            self.troubles.pop(loop.name, None)
            now = self._clock()
            for one in made:
                self.hub.publish_image(one.kind, one.image.key, one.image)
                stamp = ImageStamp(one.image.key, one.kind, one.image.state_time, now, one.seconds)
                self._done.append(stamp)
            if made:
                self.image_timing[loop.name].add(start, now)

    def _ticks(self, period: float) -> Iterable[int]:
        """One tick a period; ticks that were missed are dropped, never made up for."""
        due = self._clock()
        tick = 0
        while not self._stopping.is_set():
            yield tick
            tick += 1
            due = max(due + period, self._clock() - period)
            self._stopping.wait(max(0.0, due - self._clock()))
