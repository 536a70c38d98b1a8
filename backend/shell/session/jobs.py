"""Long work on a session in a process of its own, so that playback never waits for it."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from backend.errors import InputError
from backend.shell.priority import set_niceness

NICENESS = 5

Tell = Callable[[str, Any], None]
"""("progress", share) or ("part", what is known so far)."""


class Job:
    """work(tell, *args) in another process, at most once. state: none, running, done or failed.

    part: called with what the work tells of before it is done. All is plain data, for pickling.
    """

    def __init__(
        self, work: Callable[..., Any], *args: Any, part: Callable[[Any], None] = lambda _: None
    ) -> None:
        self.state = "none"
        self.progress = 0.0
        self.result: Any = None
        self.error = ""
        self._work, self._args, self._part = work, args, part
        self._lock = threading.Lock()
        self._process: Any = None

    def start(self) -> None:
        """Begin, unless it has begun already."""
        with self._lock:
            if self.state != "none":
                return
            self.state = "running"
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_child, args=(theirs, self._work, self._args), daemon=True
        )
        self._process.start()
        theirs.close()
        threading.Thread(target=self._listen, args=(ours,), name="job", daemon=True).start()

    def close(self) -> None:
        """End the process, done or not."""
        process = self._process
        if process is not None and process.is_alive():
            process.terminate()
            process.join(timeout=1.0)
            if process.is_alive():
                process.kill()

    def _listen(self, connection: Connection) -> None:
        try:
            while self.state == "running":
                kind, value = connection.recv()
                if kind == "progress":
                    self.progress = max(self.progress, min(float(value), 1.0))
                elif kind == "part":
                    self._part(value)
                elif kind == "done":
                    self.result = value
                    self._part(value)
                    self.progress, self.state = 1.0, "done"
                else:
                    self.error, self.state = str(value), "failed"
        except (EOFError, OSError):
            self.error, self.state = "the process that did the work ended", "failed"
        finally:
            connection.close()


def _child(connection: Connection, work: Callable[..., Any], args: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    set_niceness(NICENESS)

    def tell(kind: str, value: Any) -> None:
        connection.send((kind, value))

    try:
        answer = ("done", work(tell, *args))
    except InputError as error:
        answer = ("failed", str(error))
    except (BrokenPipeError, ConnectionError):
        return
    # Whatever fails here must be told to the parent, who shows it.
    except Exception as error:
        answer = ("failed", f"{type(error).__name__}: {error}")
    with contextlib.suppress(OSError):
        connection.send(answer)
