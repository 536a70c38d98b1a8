"""One camera for all who watch it: one connection to it, open while there is anybody.

Only the newest picture is kept. A viewer that is slow gets the one that is newest when it is ready;
none waits for another, and none makes anything queue. Everything runs in one event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncGenerator, Callable, Iterator

from backend.shell.camera.age import Picture, Stamps, taken
from backend.shell.camera.multipart import Part

log = logging.getLogger(__name__)

FIRST_WAIT, LONGEST_WAIT = 0.5, 8.0  # between two attempts [s]
READY = 0.02  # how often viewers that are not ready are looked at [s]
STEADY = 5.0  # a connection that held for so long begins again with the first wait [s]

Pictures = AsyncGenerator[Part, None]


class CameraGoneError(Exception):
    """A camera that cannot be seen now; the words say why."""


class Viewer:
    """Somebody who watches. changed: set when there is a newer picture or something else to say;
    ready: whether there is room for another picture.
    """

    def __init__(self) -> None:
        self.ready = True
        self.changed = asyncio.Event()
        self.changed.set()


class SharedCamera:
    """source: opens a connection and yields its pictures; raises CameraGoneError at its end.

    patient: each picture costs the other end something, so the next is taken when a viewer is
    ready for it. A stream that is not read would only grow old on the way.
    """

    def __init__(
        self,
        source: Callable[[], Pictures],
        patient: bool = False,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self._source, self._patient = source, patient
        self._clock, self._wall = clock, wall
        self._viewers: set[Viewer] = set()
        self._task: asyncio.Task[None] | None = None
        self.picture: Picture | None = None
        self.trouble = ""

    @property
    def viewers(self) -> int:
        return len(self._viewers)

    @contextlib.contextmanager
    def watching(self) -> Iterator[Viewer]:
        """A viewer for as long as the context lasts. Call it in a running event loop."""
        viewer = Viewer()
        self._viewers.add(viewer)
        if self._task is None:
            self.picture, self.trouble = None, ""
            self._task = asyncio.create_task(self._run())
        try:
            yield viewer
        finally:
            self._viewers.discard(viewer)
            if not self._viewers:
                self._task.cancel()
                self._task = None
                self.picture = None

    async def _run(self) -> None:
        wait = FIRST_WAIT
        while True:
            began = self._clock()
            try:
                await self._follow()
                why = "the stream ended"
            except CameraGoneError as gone:
                why = str(gone)
            if self._clock() - began > STEADY:
                wait = FIRST_WAIT
            log.info("camera: %s", why)
            self._tell(why)
            await asyncio.sleep(wait)
            wait = min(2.0 * wait, LONGEST_WAIT)

    async def _follow(self) -> None:
        stamps = Stamps()
        async with contextlib.aclosing(self._source()) as pictures:
            async for part in pictures:
                now = self._clock()
                stamps, when = taken(stamps, part.stamp, part.jpeg, now, self._wall())
                if when is not None:
                    serial = 1 if self.picture is None else self.picture.serial + 1
                    self.picture = Picture(part.jpeg, when, stamps.by, serial)
                    self._tell("")
                while self._patient and not any(viewer.ready for viewer in self._viewers):
                    await asyncio.sleep(READY)

    def _tell(self, trouble: str) -> None:
        self.trouble = trouble
        for viewer in self._viewers:
            viewer.changed.set()
