"""The fast loop turns what arrived into snapshots; image loops turn snapshots into images.

The fast loop never waits for an image: image loops take the newest snapshot, and what they finish
comes back to the pipeline as a stamped input.
"""

from __future__ import annotations

import logging
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
from backend.shell.kinds import ImageKind

log = logging.getLogger(__name__)

HISTORY = 500


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


class Stopwatch:
    """The durations of one loop's last cycles."""

    def __init__(self) -> None:
        self._seconds: deque[float] = deque(maxlen=HISTORY)
        self._ends: deque[float] = deque(maxlen=HISTORY)

    def add(self, start: float, end: float) -> None:
        self._seconds.append(end - start)
        self._ends.append(end)

    def timing(self) -> Timing:
        seconds, ends = list(self._seconds), list(self._ends)
        if len(seconds) < 2:
            return Timing(0.0, 0.0, 0.0, 0.0)
        p50, p95, p99 = (float(v) for v in 1e3 * np.percentile(seconds, [50, 95, 99]))
        return Timing(p50, p95, p99, (len(ends) - 1) / max(ends[-1] - ends[0], 1e-9))


class Runner:
    """Runs the pipeline in real time until stopped; every view reads the hub.

    kinds: the images to make; those of one rate share a loop, and the loops have nothing in common
    but the interpreter.
    """

    def __init__(
        self,
        config: Config,
        kinds: Iterable[ImageKind],
        source: Source,
        hub: Hub,
        step_hz: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.config = config
        self.hub = hub
        self.step_timing = Stopwatch()
        self._kinds: dict[float, list[ImageKind]] = {}
        for kind in kinds:
            self._kinds.setdefault(kind.hz, []).append(kind)
        self.image_timing = {hz: Stopwatch() for hz in sorted(self._kinds, reverse=True)}
        self._source = source
        self._step_period = 1.0 / step_hz
        self._clock = clock
        self._done: deque[ImageStamp] = deque(maxlen=100)
        self._stopping = threading.Event()
        loops: list[tuple[str, Callable[[], None]]] = [("fast loop", self._fast)]
        loops += [(f"{hz:g} Hz image loop", partial(self._images, hz)) for hz in self._kinds]
        self._threads = [
            threading.Thread(target=self._guard, args=(name, loop), name=name, daemon=True)
            for name, loop in loops
        ]
        self.failure: str = ""

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
            self.failure = f"{name} stopped: {error!r}"
            log.exception("%s", self.failure)

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

    def _images(self, hz: float) -> None:
        for _ in self._ticks(1.0 / hz):
            snapshot = self.hub.latest()
            if snapshot is None:
                continue
            start = self._clock()
            for kind in self._kinds[hz]:
                for target in kind.targets(snapshot):
                    self._image(kind, snapshot, target)
            self.image_timing[hz].add(start, self._clock())

    def _image(self, kind: ImageKind, snapshot: Snapshot, target: tuple[str, ...]) -> None:
        start = self._clock()
        image = kind.make(snapshot, *target)
        now = self._clock()
        self.hub.publish_image(kind.name, image.key, image)
        self._done.append(ImageStamp(image.key, kind.name, image.state_time, now, now - start))

    def _ticks(self, period: float) -> Iterable[int]:
        """One tick a period; ticks that were missed are dropped, never made up for."""
        due = self._clock()
        tick = 0
        while not self._stopping.is_set():
            yield tick
            tick += 1
            due = max(due + period, self._clock() - period)
            self._stopping.wait(max(0.0, due - self._clock()))
