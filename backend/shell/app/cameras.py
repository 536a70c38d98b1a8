"""Pictures of the machines' cameras for pages, each with its age, over a websocket of its own.

A page says which picture it has drawn and is sent the next, the newest there is: what is slow gets
fewer pictures, never old ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Mapping

import numpy as np
from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from backend.shell.app.gate import from_here
from backend.shell.app.wire import encode
from backend.shell.camera.age import Picture
from backend.shell.camera.sharing import SharedCamera, Viewer

log = logging.getLogger(__name__)

REFUSED, FULL = 1008, 1013  # websocket close codes
IN_FLIGHT = 2  # pictures sent to a page and not yet drawn by it
MOST_VIEWERS = 32  # of one camera
MAX_MESSAGE = 256  # from a page [bytes]


def camera_router(cameras: Mapping[str, SharedCamera]) -> APIRouter:
    """The websocket /api/camera/{machine}/{index}. cameras: by "machine/index".

    Sent are frames as those of the page's own websocket: {"type": "picture", "serial", "age" [s],
    "by": "capture" or "arrival", "wall"} with the array `jpeg`, and {"type": "trouble", "text"},
    why there is none. Received is {"drawn": serial}.
    """
    router = APIRouter(include_in_schema=False)

    @router.websocket("/api/camera/{machine}/{index}")
    async def camera(websocket: WebSocket, machine: str, index: str) -> None:
        shared = cameras.get(f"{machine}/{index}")
        if shared is None or not from_here(websocket):
            await websocket.close(REFUSED)
            return
        if shared.viewers >= MOST_VIEWERS:
            await websocket.close(FULL)
            return
        await websocket.accept()
        with shared.watching() as viewer:
            await _show(websocket, shared, viewer)

    return router


async def _show(websocket: WebSocket, shared: SharedCamera, viewer: Viewer) -> None:
    """Until either side ends."""
    window = _Window()
    ways = {
        asyncio.create_task(_send(websocket, shared, viewer, window)),
        asyncio.create_task(_receive(websocket, viewer, window)),
    }
    try:
        done, _ = await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            error = task.exception()
            if not isinstance(error, (WebSocketDisconnect, RuntimeError, OSError, type(None))):
                log.error("camera websocket: %r", error)
    finally:
        for task in ways:
            task.cancel()
        await asyncio.gather(*ways, return_exceptions=True)


class _Window:
    """Pictures sent to a page that it has not said it is done with."""

    def __init__(self) -> None:
        self.serials: list[int] = []

    @property
    def open(self) -> bool:
        return len(self.serials) < IN_FLIGHT

    def drawn(self, serial: int) -> None:
        self.serials = [one for one in self.serials if one > serial]


async def _send(
    websocket: WebSocket, shared: SharedCamera, viewer: Viewer, window: _Window
) -> None:
    shown, said = 0, ""
    while True:
        await viewer.changed.wait()
        viewer.changed.clear()
        if shared.trouble != said:
            said = shared.trouble
            await websocket.send_bytes(encode({"type": "trouble", "text": said}))
        picture = shared.picture
        if picture is not None and picture.serial != shown and window.open:
            shown = picture.serial
            window.serials.append(shown)
            viewer.ready = window.open
            await websocket.send_bytes(_frame(picture))


async def _receive(websocket: WebSocket, viewer: Viewer, window: _Window) -> None:
    while True:
        text = await websocket.receive_text()
        if len(text) > MAX_MESSAGE:
            continue
        with contextlib.suppress(ValueError):
            message = json.loads(text)
            if isinstance(message, dict) and isinstance(message.get("drawn"), int):
                window.drawn(message["drawn"])
                viewer.ready = window.open
                viewer.changed.set()


def _frame(picture: Picture) -> bytes:
    header = {
        "type": "picture",
        "serial": picture.serial,
        "age": max(0.0, time.monotonic() - picture.taken),
        "by": picture.by,
        "wall": time.time(),
    }
    return encode(header, {"jpeg": np.frombuffer(picture.jpeg, dtype=np.uint8)})
