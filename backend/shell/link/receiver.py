"""Everything that arrives from a site's machines, as samples in order of arrival.

Messages are decoded one by one as they come, in Zenoh's callbacks: that is some ten microseconds
each, where a batch of them at the beginning of a cycle would make that cycle late. Callbacks do no
more than that: a slow one would hold up every subscriber of the session.
"""

from __future__ import annotations

import heapq
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from backend.errors import InputError
from backend.fusion.samples import ClockSample, Sample
from backend.shell.link.access import FOREIGN_KEYS
from backend.shell.link.codec import DecodeError, decode, decode_clock
from backend.shell.link.messages import AgentStatus, Command, TrueState
from backend.shell.link.session import zenoh_congestion, zenoh_priority
from backend.shell.link.topics import Direction, Topic, key, match, topic

QUEUE = 8192  # messages: 8 s of four machines at full rate
POLL_PERIOD = 0.5  # [s] between two questions for a machine's clock
POLL_TIMEOUT = 1.0  # [s]
MAX_LABELS = 100
POINTS = "points"
NOT_FOR_FUSION = (POINTS,)  # not decoded here
BESIDE_BYTES = 64 * 2**20  # of messages that are only recorded
CLOUDS = 8  # newest of each machine that wait


@dataclass(frozen=True, slots=True)
class Heard:
    """One message as it came. key: Zenoh's; suffix: below the machine's prefix; arrival [s]."""

    machine: str
    key: str
    suffix: str
    row: Topic
    payload: bytes
    arrival: float


_Waiting: TypeAlias = tuple[Heard | ClockSample, Sample | None]
"""What came, and what the fusion takes of it."""


@dataclass(frozen=True)
class Drained:
    """What arrived since the last `drain`.

    samples: in order of arrival. malformed: (key, messages) that could not be decoded or are on no
    known topic. foreign: messages of machines that the site does not list. lost: messages dropped
    because the queue was full. All are counts since the last `drain`. heard: everything to be
    recorded, as it came, in order of arrival.
    """

    samples: tuple[Sample, ...]
    malformed: tuple[tuple[str, int], ...]
    foreign: tuple[tuple[str, int], ...]
    lost: int
    heard: tuple[Heard | ClockSample, ...] = ()


class Receiver:
    """Subscribes to the machines of a site and asks for their clocks.

    machines: key prefix on the wire -> the site's name of the machine. clock: the local clock that
    arrivals and round trips are told by [s]. everything: also what only a recorder wants, such as
    commands; clouds: it wants clouds of points, too, which are most of all bytes.
    """

    def __init__(
        self,
        session: Any,
        machines: Mapping[str, str],
        clock: Callable[[], float] = time.monotonic,
        poll_period: float = POLL_PERIOD,
        everything: bool = False,
        clouds: bool = True,
    ) -> None:
        for prefix in machines:
            if not prefix or any(c in prefix for c in "*$?#{} ") or prefix.strip("/") != prefix:
                raise InputError(
                    f"prefix: {prefix!r} is not a key prefix; allowed are names joined by '/'"
                )
        self._session = session
        self._machines = dict(machines)
        self._clock = clock
        self._queue: deque[_Waiting] = deque()
        self._everything = everything
        self._record_clouds = clouds
        self._clouds: dict[str, deque[Heard]] = {}
        self._beside: deque[Heard] = deque()
        self._beside_bytes = 0
        self._lock = threading.Lock()
        self._malformed: Counter[str] = Counter()
        self._foreign: Counter[str] = Counter()
        self._labels: set[str] = set()
        self._lost = 0
        self._statuses: dict[str, AgentStatus] = {}
        self._truths: dict[str, TrueState] = {}
        self._closed = threading.Event()
        self._subscribers = [
            session.declare_subscriber(f"{prefix}/**", self._listener(prefix, name))
            for prefix, name in self._machines.items()
        ]
        self._subscribers += [
            session.declare_subscriber(keys, self._on_any) for keys in FOREIGN_KEYS
        ]
        self._poller = threading.Thread(
            target=self._poll, args=(poll_period,), name="clock-poll", daemon=True
        )
        self._poller.start()

    def drain(self) -> Drained:
        """Everything since the last call. Call it from one thread."""
        with self._lock:
            raw, self._queue = self._queue, deque()
            malformed, self._malformed = self._malformed, Counter()
            foreign, self._foreign = self._foreign, Counter()
            lost, self._lost = self._lost, 0
            beside, self._beside, self._beside_bytes = self._beside, deque(), 0
        samples = [sample for _, sample in raw if sample is not None]
        heard = [item for item, _ in raw if isinstance(item, ClockSample) or item.row.recorded]
        if beside:
            heard = list(heapq.merge(heard, beside, key=_arrival))  # keeps the order of either
        counts = tuple(malformed.items()), tuple(foreign.items())
        return Drained(tuple(samples), *counts, lost, tuple(heard))

    def take_clouds(self) -> list[Heard]:
        """The newest clouds of points since the last call, not decoded. From any one thread."""
        with self._lock:
            found = [cloud for waiting in self._clouds.values() for cloud in waiting]
            self._clouds = {}
        return found

    def refuse(self, label: str) -> None:
        """Count a message that turned out to be malformed."""
        self._count(self._malformed, label)

    def statuses(self) -> dict[str, AgentStatus]:
        """The newest status of each machine's agent by the site's names."""
        return dict(self._statuses)

    def truths(self) -> dict[str, TrueState]:
        """The newest true state of each simulated machine."""
        return dict(self._truths)

    def _count(self, counter: Counter[str], label: str) -> None:
        """One more of `label`. Strangers cannot make the set of labels grow without end."""
        text = "".join(c if c.isprintable() else "?" for c in label[:100])
        with self._lock:
            if text not in self._labels and len(self._labels) >= MAX_LABELS:
                text = "others"
            self._labels.add(text)
            counter[text] += 1

    def close(self) -> None:
        """Stops listening and asking. Nothing is enqueued afterwards; calling again is harmless."""
        if self._closed.is_set():
            return
        self._closed.set()
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._poller.join(timeout=1.0)

    def _listener(self, prefix: str, machine: str) -> Callable[[Any], None]:
        skip = len(prefix) + 1

        def on_sample(sample: Any) -> None:
            arrival = self._clock()
            self._enqueue(machine, str(sample.key_expr), skip, sample.payload, arrival)

        return on_sample

    def _enqueue(self, machine: str, key_: str, skip: int, payload: Any, arrival: float) -> None:
        if self._closed.is_set():
            return
        suffix = key_[skip:]
        found = match(suffix)
        if found is None or len(payload) > found[0].max_bytes:  # not worth copying
            if found is None or _for_fusion(found[0]):
                self._count(self._malformed, f"{machine}/{suffix}")
            return
        row = found[0]
        if _for_fusion(row):
            self._take(Heard(machine, key_, suffix, row, payload.to_bytes(), arrival))
        elif row.name == POINTS:
            self._put_cloud(Heard(machine, key_, suffix, row, payload.to_bytes(), arrival))
        elif self._everything and row.recorded:
            self._put_beside(Heard(machine, key_, suffix, row, payload.to_bytes(), arrival))

    def _put_cloud(self, item: Heard) -> None:
        with self._lock:
            self._clouds.setdefault(item.machine, deque(maxlen=CLOUDS)).append(item)
        if self._everything and self._record_clouds:
            self._put_beside(item)

    def _put_beside(self, item: Heard) -> None:
        """Commands of cockpits, ours among them, and clouds of points: nobody waits for them."""
        with self._lock:
            self._beside.append(item)
            self._beside_bytes += len(item.payload)
            while self._beside_bytes > BESIDE_BYTES or len(self._beside) > QUEUE:
                self._beside_bytes -= len(self._beside.popleft().payload)
                self._lost += 1

    def _take(self, item: Heard) -> None:
        sample: Sample | None = None
        try:
            message = decode(item.machine, item.suffix, item.payload, item.arrival)
        except DecodeError:
            self._count(self._malformed, f"{item.machine}/{item.suffix}")
        else:
            if isinstance(message, AgentStatus):
                self._statuses[item.machine] = message
            elif isinstance(message, TrueState):
                self._truths[item.machine] = message
            elif not isinstance(message, Command):
                sample = message
        self._append(item, sample)

    def _append(self, item: Heard | ClockSample, sample: Sample | None) -> None:
        with self._lock:
            self._queue.append((item, sample))
            if len(self._queue) > QUEUE:
                self._queue.popleft()
                self._lost += 1

    def _on_any(self, sample: Any) -> None:
        name = str(sample.key_expr).split("/", 1)[0]
        if name in self._machines or any(p.startswith(f"{name}/") for p in self._machines):
            return
        self._count(self._foreign, name)

    def _poll(self, period: float) -> None:
        # A quarter of a second of loading, which the first message should not have to wait for.
        from backend.shell.link import typestore

        assert typestore.TYPESTORE is not None
        while not self._closed.wait(period):
            for prefix, name in self._machines.items():
                try:
                    self._ask(prefix, name)
                except Exception:  # the session was closed under us
                    if self._closed.is_set():
                        return

    def _ask(self, prefix: str, machine: str) -> None:
        row = topic("clock")
        sent = self._clock()

        def on_reply(reply: Any) -> None:
            received = self._clock()
            if self._closed.is_set() or reply.ok is None:
                return
            try:
                remote = decode_clock(reply.ok.payload.to_bytes()[: row.max_bytes])
            except DecodeError:
                self._count(self._malformed, f"{machine}/clock")
                return
            trip = ClockSample(machine, sent, remote, received)
            self._append(trip, trip)

        self._session.get(
            key("clock", prefix),
            on_reply,
            timeout=POLL_TIMEOUT,
            priority=zenoh_priority(row),
            congestion_control=zenoh_congestion(row),
            express=row.express,
        )


def _for_fusion(row: Topic) -> bool:
    return row.direction is Direction.FROM_MACHINE and row.name not in NOT_FOR_FUSION


def _arrival(item: Heard | ClockSample) -> float:
    return item.received if isinstance(item, ClockSample) else item.arrival
