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
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Protocol

from backend.pipeline.config import Config
from backend.pipeline.people_records import Seen
from backend.pipeline.records import ImageStamp, Inputs, Notice, Snapshot
from backend.pipeline.step import initial, step
from backend.safety.surmounting import Surmounting
from backend.shell.hub import Hub
from backend.shell.image_loops import ImageLoop, ImageLoops, Stopwatch, ticks
from backend.shell.kinds import Wishes
from backend.shell.priority import thread_first
from backend.site.gauge_choice import NO_CHOICE, GaugeChoice

TELL_AGAIN = 1.0
"""How often what is chosen of the gauge is put in again [s]."""

log = logging.getLogger(__name__)


class Source(Protocol):
    """Where inputs come from: the link, a player, a test."""

    def take(self) -> Inputs: ...


class Runner:
    """Runs the pipeline in real time until stopped; every view reads the hub.

    loops: what images are made, and how often; wishes: what operators chose, asked each time;
    notices: what operators should know about the cockpit itself, asked each cycle; after_cycle:
    told a cycle's inputs and conclusions once every view has them; driven: which machines somebody
    controls from here; gauge: what operators chose of it, the same object until it changes; people:
    what LiDARs saw since it was last asked; surmounting: what machines climb by plan. All must be
    quick.
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
        notices: Callable[[], tuple[Notice, ...]] = lambda: (),
        after_cycle: Callable[[Inputs, Snapshot], None] = lambda inputs, snapshot: None,
        driven: Callable[[], tuple[str, ...]] = lambda: (),
        gauge: Callable[[], GaugeChoice] = lambda: NO_CHOICE,
        people: Callable[[], Seen | None] = lambda: None,
        surmounting: Callable[[], Mapping[str, Surmounting]] = dict,
    ) -> None:
        self.config = config
        self.hub = hub
        self.step_timing = Stopwatch()
        self._source = source
        self._step_period = 1.0 / step_hz
        self._clock = clock
        self._notices = notices
        self._after_cycle = after_cycle
        self._driven = driven
        self._gauge = gauge
        self._people = people
        self._surmounting = surmounting
        self._told: tuple[GaugeChoice, float] = (NO_CHOICE, -math.inf)
        self._done: deque[ImageStamp] = deque(maxlen=100)
        self._images = ImageLoops(hub, loops, wishes, self._done.append, clock)
        self.image_timing = self._images.timing
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._guard, name="fast loop", daemon=True)
        self._fatal = ""

    @property
    def failure(self) -> str:
        """What does not run; empty while all does."""
        return self._fatal or self._images.failure

    def start(self) -> None:
        self._thread.start()
        self._images.start()

    def stop(self) -> None:
        self._stopping.set()
        self._images.stop()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def _guard(self) -> None:
        thread_first()
        try:
            self._fast()
        except Exception as error:
            # A dead loop must be seen: without new snapshots every view goes stale, and says so.
            self._fatal = f"fast loop stopped: {error!r}"
            log.exception("%s", self._fatal)

    def _chosen(self, now: float) -> GaugeChoice | None:
        """What holds of the gauge when it changed, and now and then, so that whoever plays a part
        of a recording knows it, too.
        """
        chosen, (told, when) = self._gauge(), self._told
        if chosen is told and (chosen == NO_CHOICE or now - when < TELL_AGAIN):
            return None
        self._told = (chosen, now)
        return chosen

    def _fast(self) -> None:
        state = initial(self.config)
        for _ in ticks(self._step_period, self._clock, self._stopping):
            start = self._clock()
            inputs = self._source.take()
            finished = tuple(self._done.popleft() for _ in range(len(self._done)))
            notices, driven, chosen = self._notices(), self._driven(), self._chosen(start)
            people, climbing = self._people(), self._surmounting()
            known = chosen is not None or people is not None
            if finished or notices or driven or climbing or known:
                inputs = replace(
                    inputs,
                    images=inputs.images + finished,
                    notices=notices,
                    driven=driven,
                    gauge=chosen,
                    people=people,
                    surmounting=climbing,
                )
            state, snapshot = step(state, inputs, start, self.config)
            self.step_timing.add(start, self._clock())
            self.hub.publish(snapshot)
            self._after_cycle(inputs, snapshot)
