"""The page's websocket: every client gets the newest snapshot and images, never a queue of them."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from fastapi import WebSocket, WebSocketDisconnect

from backend.control.person import Person
from backend.pipeline.records import Snapshot
from backend.shell.app.wire import encode
from backend.shell.hub import Hub

log = logging.getLogger(__name__)

SNAPSHOT_PERIOD = 0.018  # at least, between two snapshots to one page [s]
MAX_MESSAGE = 4096  # from a page [bytes]
IN_FLIGHT = 2  # snapshots sent to a page and not acknowledged by it


@dataclass
class Frames:
    """Encoded frames, made once for all readers. `document` turns a snapshot into plain JSON."""

    hub: Hub
    document: Callable[[Snapshot], dict[str, Any]]
    clients: int = 0  # on the websocket now
    _snapshot: tuple[int, bytes] = (-1, b"")
    _images: dict[tuple[str, str], tuple[float, bytes]] = field(default_factory=dict)

    def snapshot(self) -> tuple[int, bytes]:
        """(cycle, frame) of the newest snapshot; cycle -1 before the first."""
        newest = self.hub.latest()
        if newest is not None and newest.cycle != self._snapshot[0]:
            frame = encode({"type": "snapshot", "wall": time.time(), **self.document(newest)})
            self._snapshot = (newest.cycle, frame)
        return self._snapshot

    def images(self) -> dict[tuple[str, str], tuple[float, bytes]]:
        """(state_time, frame) of every image, by kind and key."""
        images = self.hub.images()
        if not images:
            return {}
        from backend.shell.app.image_frames import frame_of  # loaded with the images' own modules

        for key, image in images.items():
            known = self._images.get(key)
            if known is not None and known[0] == image.state_time:
                continue
            frame = frame_of(key[0], image, images)
            if frame is not None:
                self._images[key] = (image.state_time, frame)
        return dict(self._images)


class Flow:
    """How far a page is behind. A page that acknowledges gets no more than it can draw.

    Without this, frames would pile up in the browser of a busy page, and it would show the past.
    Programs that never acknowledge are sent everything.
    """

    def __init__(self) -> None:
        self._acknowledges = False
        self._in_flight: deque[int] = deque()

    def sent(self, cycle: int) -> None:
        self._in_flight.append(cycle)

    def acknowledge(self, cycle: int) -> None:
        self._acknowledges = True
        while self._in_flight and self._in_flight[0] <= cycle:
            self._in_flight.popleft()

    @property
    def open(self) -> bool:
        if not self._acknowledges:
            self._in_flight.clear()
        return len(self._in_flight) < IN_FLIGHT


OnMessage = Callable[[dict[str, Any], Person | None], None]
"""Told what a page says, and whose page it is; None where nobody signs in."""


class Seats(Protocol):
    """Where operators sit. open: a seat's name for a person; on_message: whether it was theirs."""

    def open(self, person: Person) -> str: ...

    def on_message(self, name: str, message: dict[str, Any]) -> bool: ...

    def close(self, name: str) -> None: ...


class Feed:
    """Serves one accepted websocket until it closes."""

    def __init__(
        self,
        frames: Frames,
        site: dict[str, Any],
        on_message: OnMessage,
        seats: Seats | None = None,
    ) -> None:
        self._hub = frames.hub
        self._frames = frames
        self._site = encode({"type": "site", **site})
        self._on_message = on_message
        self._seats = seats

    async def serve(self, socket: WebSocket, person: Person | None = None) -> None:
        """person: who opened the page; without one, and without seats, it only looks."""
        if self._seats is None or person is None:
            await self._serve(socket, lambda message: self._on_message(message, person))
            return
        seats, seat = self._seats, self._seats.open(person)
        you = {"type": "you", "seat": seat, "who": person.who, "role": person.role}

        def on_message(message: dict[str, Any]) -> None:
            if not seats.on_message(seat, message):
                self._on_message(message, person)

        try:
            await self._serve(socket, on_message, encode(you))
        finally:
            seats.close(seat)

    async def _serve(
        self,
        socket: WebSocket,
        on_message: Callable[[dict[str, Any]], None],
        greeting: bytes = b"",
    ) -> None:
        self._frames.clients += 1
        fresh = asyncio.Event()
        loop = asyncio.get_running_loop()

        def notify() -> None:
            with contextlib.suppress(RuntimeError):  # the loop has closed
                loop.call_soon_threadsafe(fresh.set)

        stop_listening = self._hub.listen(notify)
        flow = Flow()
        sender = asyncio.create_task(self._send(socket, fresh, flow, greeting))
        receiver = asyncio.create_task(self._receive(socket, flow, on_message))
        try:
            done, _ = await asyncio.wait({sender, receiver}, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                error = task.exception()
                if error is not None and not isinstance(
                    error, (WebSocketDisconnect, RuntimeError, OSError)
                ):
                    log.error("websocket: %r", error)
        finally:
            stop_listening()
            for task in (sender, receiver):
                task.cancel()
            await asyncio.gather(sender, receiver, return_exceptions=True)
            self._frames.clients -= 1

    async def _send(
        self, socket: WebSocket, fresh: asyncio.Event, flow: Flow, greeting: bytes
    ) -> None:
        await socket.send_bytes(self._site)
        if greeting:
            await socket.send_bytes(greeting)
        sent_cycle = -1
        sent_images: dict[tuple[str, str], float] = {}
        while True:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(fresh.wait(), timeout=1.0)
            fresh.clear()
            started = time.monotonic()
            if not flow.open:
                await asyncio.sleep(0.005)
                fresh.set()
                continue
            cycle, frame = self._frames.snapshot()
            if cycle != sent_cycle:
                sent_cycle = cycle
                flow.sent(cycle)
                await socket.send_bytes(frame)
            for key, (stamp, image) in self._frames.images().items():
                if sent_images.get(key) != stamp:
                    sent_images[key] = stamp
                    await socket.send_bytes(image)
            # What arrives meanwhile waits for the next turn: the newest wins, nothing queues.
            await asyncio.sleep(max(0.0, SNAPSHOT_PERIOD - (time.monotonic() - started)))

    async def _receive(
        self, socket: WebSocket, flow: Flow, on_message: Callable[[dict[str, Any]], None]
    ) -> None:
        while True:
            text = await socket.receive_text()
            if len(text) > MAX_MESSAGE:
                continue
            with contextlib.suppress(ValueError):
                message = json.loads(text)
                if not isinstance(message, dict):
                    continue
                if message.get("type") == "ack" and isinstance(message.get("cycle"), int):
                    flow.acknowledge(message["cycle"])
                else:
                    on_message(message)
