"""Two rates: the fast loop turns what arrived into snapshots, the image loop into images.

The fast loop never waits for an image: workers take the newest snapshot, and what they finish
comes back to the pipeline as a stamped input.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from backend.pipeline.config import Config
from backend.pipeline.images import PairImage, SunParameters, ordered_pairs, pair_image
from backend.pipeline.records import ImageStamp, Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.shell.hub import Hub

log = logging.getLogger(__name__)

IMAGE_WORKERS = 1  # they hold the interpreter: a second one would only slow the fast loop
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
    """Runs the pipeline in real time until stopped; every view reads the hub."""

    def __init__(
        self,
        config: Config,
        sun: SunParameters,
        source: Source,
        hub: Hub,
        step_hz: float,
        image_hz: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.config = config
        self.hub = hub
        self.step_timing = Stopwatch()
        self.image_timing = Stopwatch()
        self._sun = sun
        self._source = source
        self._step_period = 1.0 / step_hz
        self._image_period = 1.0 / image_hz
        self._clock = clock
        self._done: deque[ImageStamp] = deque(maxlen=100)
        self._stopping = threading.Event()
        self._threads = [
            threading.Thread(target=self._guard, args=(loop,), name=name, daemon=True)
            for name, loop in (("fast-loop", self._fast), ("image-loop", self._images))
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

    def _guard(self, loop: Callable[[], None]) -> None:
        try:
            loop()
        except Exception as error:
            # A dead loop must be seen: without new snapshots every view goes stale, and says so.
            self.failure = f"{loop.__name__.strip('_')} loop stopped: {error!r}"
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

    def _images(self) -> None:
        with ThreadPoolExecutor(IMAGE_WORKERS, thread_name_prefix="image") as pool:
            for _ in self._ticks(self._image_period):
                snapshot = self.hub.latest()
                if snapshot is None:
                    continue
                start = self._clock()
                list(
                    pool.map(
                        lambda pair, s=snapshot: self._image(s, *pair),
                        ordered_pairs(snapshot, self.config),
                    )
                )
                self.image_timing.add(start, self._clock())

    def _image(self, snapshot: Snapshot, own: str, partner: str) -> PairImage:
        start = self._clock()
        image = pair_image(snapshot, self.config, own, partner, self._sun)
        now = self._clock()
        self.hub.publish_image("sun", image.key, image)
        self._done.append(ImageStamp(image.key, "sun", image.state_time, now, now - start))
        return image

    def _ticks(self, period: float) -> Iterable[int]:
        """One tick a period; ticks that were missed are dropped, never made up for."""
        due = self._clock()
        tick = 0
        while not self._stopping.is_set():
            yield tick
            tick += 1
            due = max(due + period, self._clock() - period)
            self._stopping.wait(max(0.0, due - self._clock()))
