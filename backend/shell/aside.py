"""A process of its own for work that must never hold up the interpreter of the fast loop."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

from backend.shell.priority import set_niceness

NICENESS = 2
"""The fast loop goes before images when processors are short."""
SLOW = 4
"""And images made many times a second before those that take longer and are made less often."""

Question = TypeVar("Question")
Answer = TypeVar("Answer")


class WorkerGone(Exception):  # noqa: N818 - a fact about a process, not a fault of the caller
    """The process ended by itself; the next call starts another one."""


class Aside(Generic[Question, Answer]):
    """Asks a process of its own. One caller at a time.

    begin: called once in the process, it makes what answers; it can be pickled, as functions of
    modules and `partial`s of them can. work: what the process does, in words ("makes images");
    niceness: of the process.
    """

    def __init__(
        self,
        begin: Callable[[], Callable[[Question], Answer]],
        work: str,
        niceness: int = NICENESS,
    ) -> None:
        self._begin = begin
        self._work = work
        self._niceness = niceness
        self._process: Any = None
        self._connection: Connection | None = None

    def ask(self, question: Question) -> Answer:
        """Blocks until answered. Raises WorkerGone, or RuntimeError with what failed."""
        connection = self._connection or self._start()
        try:
            connection.send(question)
            failed, answer = connection.recv()
        except (EOFError, OSError) as error:
            self.close()
            raise WorkerGone(f"the process that {self._work} ended: {error!r}") from error
        if failed:
            raise RuntimeError(answer)
        found: Answer = answer
        return found

    @property
    def pid(self) -> int | None:
        return None if self._process is None else self._process.pid

    def close(self) -> None:
        """End the process."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._process is not None:
            self._process.join(timeout=1.0)
            if self._process.is_alive():
                self._process.kill()
            self._process = None

    def _start(self) -> Connection:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        # Daemonic: it ends with this process; killed outright, it meets the end of the pipe.
        self._process = context.Process(
            target=_answer, args=(theirs, self._begin, self._niceness), daemon=True
        )
        self._process.start()
        theirs.close()
        self._connection = ours
        return ours


def _answer(
    connection: Connection, begin: Callable[[], Callable[[Any], Any]], niceness: int
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    set_niceness(niceness)
    answer = begin()
    while True:
        try:
            question = connection.recv()
        except (EOFError, OSError):
            return
        try:
            told: tuple[bool, Any] = (False, answer(question))
        # Whatever fails here must be told to the parent, who shows it, and the next one tried.
        except Exception as error:
            told = (True, f"{type(error).__name__}: {error}")
        with contextlib.suppress(OSError):
            connection.send(told)
