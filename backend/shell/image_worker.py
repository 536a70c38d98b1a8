"""A process that makes images, so that they never hold up the interpreter of the fast loop."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from multiprocessing.connection import Connection
from typing import Any

from backend.pipeline.records import Snapshot
from backend.shell.kinds import Made, Recipe, Wishes, make_images
from backend.shell.priority import set_niceness

NICENESS = 2
"""The fast loop goes before the images when processors are short."""


class WorkerGone(Exception):  # noqa: N818 - a fact about a process, not a fault of the caller
    """The process ended by itself; the next call starts another one."""


class ImageWorker:
    """Asks a process of its own for the images of a recipe. One caller at a time."""

    def __init__(self, recipe: Recipe) -> None:
        self._recipe = recipe
        self._process: Any = None
        self._connection: Connection | None = None

    def make(self, snapshot: Snapshot, wishes: Wishes) -> list[Made]:
        """Blocks until all images are made. Raises WorkerGone, or RuntimeError with what failed."""
        connection = self._connection or self._start()
        try:
            connection.send((snapshot, wishes))
            answer = connection.recv()
        except (EOFError, OSError) as error:
            self.close()
            raise WorkerGone(f"the process that makes images ended: {error!r}") from error
        if isinstance(answer, str):
            raise RuntimeError(answer)
        made: list[Made] = answer
        return made

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
        self._process = context.Process(target=_work, args=(theirs, self._recipe), daemon=True)
        self._process.start()
        theirs.close()
        self._connection = ours
        return ours


def _work(connection: Connection, recipe: Recipe) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    set_niceness(NICENESS)
    while True:
        try:
            snapshot, wishes = connection.recv()
        except (EOFError, OSError):
            return
        try:
            answer: Any = make_images(recipe, snapshot, wishes)
        # Whatever fails here must be told to the parent, who shows it, and the next image tried.
        except Exception as error:
            answer = f"{type(error).__name__}: {error}"
        with contextlib.suppress(OSError):
            connection.send(answer)
