"""A bounded queue, and the thread that hands it to the process that writes to disk.

Nobody who puts something into the queue ever waits for the disk. The thread keeps what is not known
to be on disk, and sends it again when a write fails or the process dies: then nothing is lost while
the queue has room. What goes wrong is told in words.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import multiprocessing
import signal
import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from backend.shell.session.keeper import SIGNALS, Answer, Order, Plan, Record, run

log = logging.getLogger(__name__)

PERIOD = 0.1  # between two orders [s]
QUEUE_BYTES = 48 * 2**20  # not known to be on disk: minutes of two machines
ORDER_BYTES = 2**20
OVERHEAD = 120  # of one message in the queue [bytes], about
SLOW = 0.6  # an order that takes longer is told [s]
STARTING = 20.0  # the process may take this long to begin [s]
RESTART = 2.0  # between two attempts to start a process that ends at once [s]
TOLD = 10.0  # how long a restart is told [s]
LOST_TOLD = 60.0  # how long a loss is told [s]
PATIENCE = 6.0  # with the disk at the end [s]

Entry = tuple[str, str, int, bytes]
"""Topic, ROS 2 type or "", log_time [ns], data."""


class Feeder:
    """Feeds a plan's process from `start` until `close`. target: the process's body, for tests."""

    def __init__(
        self,
        plan: Plan,
        clock: Callable[[], float] = time.monotonic,
        target: Callable[[Connection, Plan], None] = run,
    ) -> None:
        self._plan = plan
        self._clock = clock
        self._target = target
        self._lock = threading.Lock()  # held for microseconds only
        self._inbox: list[tuple[int, list[Entry]]] = []  # with the first one's sequence number
        self._bytes = 0  # of inbox and pending
        self._sequence = 0
        self._lost, self._lost_at = 0, -LOST_TOLD
        self._pending: deque[Record] = deque()  # the thread's own: not known to be on disk
        self._sent = 0  # how many of them the present process got
        self._trouble, self._waiting, self._restarted = "", 0.0, -TOLD
        self._recorded_at = clock()
        self._ready = False
        self._rotate = False
        self._stopping = threading.Event()
        self._process: Any = None
        self._connection: Connection | None = None
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    def put(self, entries: list[Entry]) -> None:
        """All of them, or none when the queue is full. Lost ones leave a gap in the sequence.

        The list must not be changed afterwards.
        """
        size = sum(len(entry[3]) + OVERHEAD for entry in entries)
        with self._lock:
            first = self._sequence
            self._sequence += len(entries)
            if self._bytes + size > QUEUE_BYTES:
                self._lost += len(entries)
                self._lost_at = self._clock()
                return
            self._bytes += size
            self._inbox.append((first, entries))

    def line(self) -> str:
        """What is wrong, in words; empty while all is well."""
        now = self._clock()
        lost = f"; {self._lost} messages lost" if self._lost else ""
        if self._trouble:
            return f"{self._trouble}: {self._since(now)}{lost}"
        waiting = now - self._waiting if self._waiting else 0.0
        if waiting > (SLOW if self._ready else STARTING):
            what = "disk slow" if self._ready else "its process does not start"
            return f"{what}: {self._since(now)}{lost}"
        if now - self._restarted < TOLD:
            return f"its process ended and was started again{lost}"
        if now - self._lost_at < LOST_TOLD:
            return f"{self._lost} messages lost, the last at {self._hours(now, self._lost_at)}"
        return ""

    def rotate(self, timeout: float) -> None:
        """Finish the part being written, and wait for it at most `timeout` seconds."""
        self._rotate = True
        deadline = time.monotonic() + timeout
        while self._rotate and time.monotonic() < deadline:
            time.sleep(0.02)

    @property
    def ready(self) -> bool:
        """Whether the process takes orders."""
        return self._ready

    @property
    def pid(self) -> int | None:
        """Of the process that writes."""
        process = self._process
        return None if process is None else process.pid

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Writes what waits, finishes the file and ends the process."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(PATIENCE + 1.0)
        self._end(kill=self._thread.is_alive())

    def _since(self, now: float) -> str:
        return f"not recorded since {self._hours(now, self._recorded_at)}"

    @staticmethod
    def _hours(now: float, then: float) -> str:
        return time.strftime("%H:%M:%S", time.localtime(time.time() - now + then))

    def _run(self) -> None:
        while not self._stopping.wait(PERIOD):
            self._turn()
        deadline = time.monotonic() + PATIENCE  # what waits goes to disk, unless there is trouble
        while time.monotonic() < deadline and not self._trouble and self._turn():
            pass

    def _turn(self) -> bool:
        """One order to the process, and its answer. Whether there was one."""
        try:
            if self._connection is None:
                self._begin()
            order = self._order()
            if order.records or order.rotate:
                self._exchange(order)
                return True
        except (EOFError, OSError) as error:
            log.warning("the recorder's process ended: %r", error)
            self._end(kill=True)
            again = self._clock() - self._restarted < TOLD and not self._ready
            self._waiting, self._ready = 0.0, False
            self._restarted = self._clock()
            if again:
                self._stopping.wait(RESTART)
        return False

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=self._target, args=(theirs, self._plan), daemon=True)
        self._ready, self._waiting, self._sent = False, self._clock(), 0
        # A Ctrl-C for all must not meet it before it has its own answer: it inherits the mask.
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        process.start()
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        theirs.close()
        self._process, self._connection = process, ours
        self._hear_answer(ours)
        self._ready = True

    def _order(self) -> Order:
        rotate = self._rotate  # before the inbox: what was put before it is in this part
        with self._lock:
            news, self._inbox = self._inbox, []
        for first, entries in news:
            self._pending.extend(Record(first + k, *entry) for k, entry in enumerate(entries))
        size, records = 0, []
        for record in itertools.islice(self._pending, self._sent, None):
            size += len(record.data)
            records.append(record)
            if size > ORDER_BYTES:
                rotate = False  # not all of it is in this order
                break
        return Order(records, rotate)

    def _exchange(self, order: Order) -> None:
        assert self._connection is not None
        self._waiting = self._clock()
        self._connection.send(order)
        self._sent += len(order.records)
        answer = self._hear_answer(self._connection)
        if answer.trouble:
            self._sent = 0  # all that is not on disk goes again
            self._stopping.wait(PERIOD)
            return
        self._recorded_at = self._clock()
        if order.rotate:
            self._rotate = False

    def _hear_answer(self, connection: Connection) -> Answer:
        while not connection.poll(0.25):
            if self._stopping.is_set() and self._clock() - self._waiting > PATIENCE:
                raise EOFError("no answer at the end")
        answer: Answer = connection.recv()
        self._waiting = 0.0
        self._trouble = answer.trouble
        freed = 0
        while self._pending and answer.durable is not None:
            first = self._pending[0]
            if (answer.durable - first.sequence) % 2**32 >= 2**31:
                break
            freed += len(first.data) + OVERHEAD
            self._pending.popleft()
            self._sent = max(0, self._sent - 1)
        with self._lock:
            self._bytes -= freed
        return answer

    def _end(self, kill: bool) -> None:
        connection, self._connection = self._connection, None
        process, self._process = self._process, None
        if connection is not None:
            with contextlib.suppress(OSError):
                if not kill:
                    connection.send(None)
            connection.close()
        if process is not None:
            if kill:
                process.kill()
            process.join(timeout=3.0)
            if process.is_alive():
                process.kill()
