"""What starts after the page can be seen: one step after the other, in a thread of its own."""

from __future__ import annotations

import gc
import logging
import threading
from collections.abc import Callable, Sequence

log = logging.getLogger(__name__)


class Starting:
    """Steps that take long, mostly because they load libraries.

    One thread takes them in order, so that no two threads load modules that need each other.
    steps: what is started, in words, and what starts it.
    """

    def __init__(self, steps: Sequence[tuple[str, Callable[[], None]]]) -> None:
        self.failure = ""
        self._steps = steps
        self._stopping = threading.Event()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, name="starting", daemon=True)

    @property
    def done(self) -> bool:
        """Whether every step has been taken."""
        return self._done.is_set()

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """No further step begins; waits for the one that has begun."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=15.0)

    def wait(self) -> None:
        """Until every step has been taken, or `stop` was called."""
        self._done.wait()

    def _run(self) -> None:
        for name, step in self._steps:
            if self._stopping.is_set():
                break
            try:
                step()
            # The page must be told, whatever it was; the other steps are tried all the same.
            except Exception as error:
                self.failure = f"{name} did not start: {error}"
                log.exception("%s", self.failure)
        gc.enable()
        gc.collect()
        gc.freeze()  # what is loaded by now stays; the collector need not walk through it again
        self._done.set()
