"""Plays a session into a hub in real time: what every view shows follows the cursor.

There is no way from here to a machine: a player reads files and publishes snapshots to views.
"""

from __future__ import annotations

import logging
import math
import threading
import time as clocks
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from backend.errors import InputError
from backend.pipeline.config import Config
from backend.shell.hub import Hub
from backend.shell.image_loops import Stopwatch
from backend.shell.session.cycles import Topics
from backend.shell.session.reader import Session
from backend.shell.session.tracks import SECOND, Shown, Track, sources, track

log = logging.getLogger(__name__)

MODE = "PLAYBACK"
SLOWEST, FASTEST = 0.1, 50.0
TICK = 0.02  # [s]
FAST_TICK = 0.04  # above FAST: fewer snapshots, each of more cycles [s]
FAST = 2.0
BUDGET = 0.1  # of one turn: what is not done by then is catching up [s]
STALL = 1.0  # more than this is not made up for when a computer was held up [s]
AGAIN = 0.2  # how soon the same snapshot is published again [s]
NEAR = round(0.05 * SECOND)  # an event this near the cursor is the present one [ns]
RETURN = SECOND  # while playing, "previous" goes to the event before one this close [ns]
DOCUMENTS = 8  # recorded documents of the last snapshots that are kept
ACTIONS = (
    *("play", "pause", "toggle", "step", "back", "seek", "speed", "loop", "source"),
    *("next", "previous"),
)


class Player:
    """The cursor of one session. All methods may be called from any thread.

    events: times of what is on the timeline [ns], asked each time; source: "recorded" (as it was)
    or "evaluated" (as we would judge it now); wait: called before the source is changed, returns
    when what judges may be loaded.
    """

    def __init__(
        self,
        session: Session,
        topics: Topics,
        config: Config,
        hub: Hub,
        source: str | None = None,
        events: Callable[[], Sequence[int]] = lambda: (),
        clock: Callable[[], float] = clocks.monotonic,
        wait: Callable[[], None] = lambda: None,
    ) -> None:
        self.sources = sources(session, topics)
        if not self.sources:
            raise InputError(
                f"{session.path}: holds neither snapshots nor poses of any machine of the site; "
                "nothing can be played."
            )
        if source is not None and source not in self.sources:
            allowed = ", ".join(self.sources)
            raise InputError(f'{session.path}: source "{source}"; allowed here are {allowed}.')
        self.timing = Stopwatch()
        self.failure = ""
        self._session, self._topics, self._config, self._hub = session, topics, config, hub
        self._events = events
        self._clock = clock
        self._wait = wait
        self._source = source or self.sources[0]
        self._track: Track  # made in the player's own thread: what judges takes long to load
        self._shown: Shown | None = None
        self._cursor = session.begin
        self._playing = False
        self._speed = 1.0
        self._loop: tuple[int, int] | None = None
        self._late = -math.inf
        self._owed = 0  # of the session, by which a turn did not come as far as it should [ns]
        self._published = 0
        self._published_at = -math.inf
        self._documents: dict[int, dict[str, Any]] = {}
        self._orders: deque[tuple[str, Any]] = deque()
        self._wake = threading.Event()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._guard, name="player", daemon=True)

    def start(self) -> None:
        """Shows the beginning and waits for orders."""
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def do(self, action: Any, value: Any = None) -> None:
        """Orders one of ACTIONS. Raises InputError for what is not possible."""
        self._orders.append(self._checked(action, value))
        self._wake.set()

    def status(self) -> dict[str, Any]:
        """Where the cursor is; times [s] since the session's beginning."""
        begin = self._session.begin
        headers = self._session.headers
        loop = self._loop
        return {
            "time": (self._cursor - begin) / 1e9,
            "duration": (self._session.end - begin) / 1e9,
            "wall": self._cursor / 1e9,
            "playing": self._playing,
            "speed": self._speed,
            "source": self._source,
            "sources": list(self.sources),
            "loop": None if loop is None else [(t - begin) / 1e9 for t in loop],
            "catching_up": self._playing and self._clock() - self._late < 0.5,
            "title": self._session.title,
            "note": headers[0].note if headers else "",
        }

    def recorded(self, cycle: int) -> Mapping[str, Any] | None:
        """The recorded document of the snapshot that was published with this number."""
        return self._documents.get(cycle)

    def _checked(self, action: Any, value: Any) -> tuple[str, Any]:
        if action not in ACTIONS:
            raise InputError(f"playback: do is {action!r}; allowed are {', '.join(ACTIONS)}.")
        duration = (self._session.end - self._session.begin) / 1e9
        if action == "seek":
            return action, self._time(_number(value, action, -math.inf, math.inf))
        if action == "speed":
            return action, _number(value, action, SLOWEST, FASTEST)
        if action == "source" and value not in self.sources:
            allowed = ", ".join(self.sources)
            raise InputError(f"playback: source is {value!r}; allowed are {allowed}.")
        if action == "loop" and value is not None:
            if not isinstance(value, list | tuple) or len(value) != 2:
                raise InputError(f"playback: loop is {value!r}; allowed is null or [begin, end].")
            first, last = sorted(_number(v, action, 0.0, duration) for v in value)
            if last - first < 0.1:
                raise InputError("playback: loop is shorter than 0.1 s; allowed is a longer one.")
            return action, (self._time(first), self._time(last))
        return action, value

    def _time(self, since: float) -> int:
        """[ns] on the session's line, within it."""
        at = self._session.begin + round(min(max(since, -1e9), 1e9) * 1e9)
        return min(max(at, self._session.begin), self._session.end)

    def _guard(self) -> None:
        try:
            self._run()
        except Exception as error:
            # A dead loop must be seen: without new snapshots every view goes stale, and says so.
            self.failure = f"playback stopped: {error!r}"
            log.exception("%s", self.failure)

    def _run(self) -> None:
        self._track = track(self._source, self._session, self._topics, self._config)
        self._seek(self._cursor)
        last = self._clock()
        while not self._stopping.is_set():
            began = self._clock()
            elapsed, last = min(began - last, STALL), began
            self._obey()
            if self._playing:
                self._play(elapsed, began + BUDGET)
            if self._clock() - self._published_at > AGAIN:
                self._publish(self._shown)
            tick = FAST_TICK if self._speed > FAST else TICK
            # An order is obeyed at once; a turn that took long is followed by the next.
            self._wake.wait(max(0.001, began + tick - self._clock()))
            self._wake.clear()

    def _obey(self) -> None:
        """All orders so far; of seeks that follow each other only the last, as by dragging."""
        orders = [self._orders.popleft() for _ in range(len(self._orders))]
        for k, (action, value) in enumerate(orders):
            if action == "seek" and k + 1 < len(orders) and orders[k + 1][0] == "seek":
                continue
            self._order(action, value)

    def _order(self, action: str, value: Any) -> None:
        match action:
            case "play" | "pause" | "toggle":
                self._playing = not self._playing if action == "toggle" else action == "play"
                self._owed = 0
                if self._playing and self._cursor >= self._session.end:
                    self._seek(self._loop[0] if self._loop else self._session.begin)
            case "speed":
                self._speed, self._owed = value, 0
            case "loop":
                self._loop = value
            case "seek":
                self._seek(value)
            case "source":
                self._wait()
                self._source = value
                self._track = track(value, self._session, self._topics, self._config)
                self._seek(self._cursor)
            case "step":
                self._playing = False
                self._move(self._track.step())
            case "back":
                self._playing = False
                self._seek((self._shown.time if self._shown else self._cursor) - 1, exact=False)
            case "next":
                later = [t for t in self._events() if t > self._cursor + NEAR]
                if later:
                    self._seek(min(later))
            case "previous":
                near = RETURN if self._playing else NEAR
                earlier = [t for t in self._events() if t < self._cursor - near]
                self._seek(max(earlier, default=self._session.begin))
        self._publish(self._shown)

    def _play(self, elapsed: float, deadline: float) -> None:
        loop = self._loop
        if loop is not None and not loop[0] <= self._cursor < loop[1]:
            self._seek(loop[0])
        end = loop[1] if loop is not None else self._session.end
        due = min(elapsed * self._speed * 1e9 + self._owed, STALL * self._speed * 1e9)
        wanted = min(self._cursor + round(due), end)
        start = self._clock()
        shown, reached = self._track.advance(wanted, self._speed > 1.0, deadline)
        if reached < wanted - SECOND // 50:
            self._late = self._clock()
        self._cursor, self._owed = reached, max(wanted - reached, 0)
        if shown is not None:
            self._publish(shown)
            self.timing.add(start, self._clock())
        if reached >= self._session.end and loop is None:
            self._playing = False

    def _seek(self, time: int, exact: bool = True) -> None:
        """exact: the cursor stands at `time` itself, else at the cycle that is shown."""
        time, self._owed = max(time, self._session.begin), 0
        shown = self._track.seek(time)
        if shown is None and (shown := self._track.step()) is not None:
            exact = False  # there is nothing before the first cycle: show it
        self._cursor = time if exact or shown is None else min(shown.time, self._session.end)
        if shown is not None:
            self._shown = shown
        self._publish(self._shown)

    def _move(self, shown: Shown | None) -> None:
        if shown is not None:
            self._shown = shown
            self._cursor = min(shown.time, self._session.end)

    def _publish(self, shown: Shown | None) -> None:
        """The cycle number counts publications, so that pages see that the link lives."""
        if shown is None:
            return
        self._shown = shown
        self._published += 1
        self._published_at = self._clock()
        if shown.document is not None:
            self._documents[self._published] = shown.document
        for old in [cycle for cycle in self._documents if cycle <= self._published - DOCUMENTS]:
            del self._documents[old]
        self._hub.publish(replace(shown.snapshot, cycle=self._published, mode=MODE))


def _number(value: Any, action: str, low: float, high: float) -> float:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not good or not low <= value <= high or not math.isfinite(value):
        allowed = f"{low:g} to {high:g}" if math.isfinite(low) else "seconds since the beginning"
        raise InputError(f"playback: {action} is {value!r}; allowed is {allowed}.")
    return float(value)
