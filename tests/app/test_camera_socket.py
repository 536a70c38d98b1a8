"""The cameras' websocket on a real port: who is slow, who is refused, what the page may reach."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from backend.shell.app import cameras as module
from backend.shell.app.cameras import IN_FLIGHT, camera_router
from backend.shell.app.security import PAGE_POLICY, SecurityHeaders, page_policy
from backend.shell.app.server import WebServer, bind
from backend.shell.app.wire import decode
from backend.shell.camera.multipart import Part
from backend.shell.camera.sharing import CameraGoneError, Pictures, SharedCamera

JPEG = b"\xff\xd8" + bytes(30_000)


class Lens:
    """A camera that shows numbers, 200 a second, until it is broken."""

    def __init__(self) -> None:
        self.shown = self.opened = 0
        self.broken = False

    async def __call__(self) -> Pictures:
        self.opened += 1
        while not self.broken:
            self.shown += 1
            yield Part(JPEG + self.shown.to_bytes(4, "big"), time.time())
            await asyncio.sleep(0.005)
        raise CameraGoneError("the camera does not answer")


class Served:
    def __init__(self, url: str, lens: Lens, camera: SharedCamera) -> None:
        self.url, self.lens, self.camera = url, lens, camera

    def open(self, path: str = "left/0", **more: Any) -> ClientConnection:
        return connect(f"{self.url}/api/camera/{path}", proxy=None, **more)


@pytest.fixture
def served(request: pytest.FixtureRequest) -> Iterator[Served]:
    lens = Lens()
    camera = SharedCamera(lens, patient=getattr(request, "param", False))
    app = FastAPI()
    app.include_router(camera_router({"left/0": camera}))
    server = WebServer(app, bind("127.0.0.1", 0))
    server.start()
    try:
        yield Served(f"ws://127.0.0.1:{server.port}", lens, camera)
    finally:
        server.stop()


def receive(socket: ClientConnection, timeout: float = 10.0) -> tuple[dict[str, Any], Any]:
    message = socket.recv(timeout=timeout)
    assert isinstance(message, bytes)
    return decode(message)


def number(jpeg: Any) -> int:
    return int.from_bytes(np.asarray(jpeg["jpeg"]).tobytes()[-4:], "big")


def test_who_says_nothing_gets_no_more_and_who_is_slow_the_newest(served: Served) -> None:
    with served.open() as slow, served.open() as quick:
        for _ in range(IN_FLIGHT):
            header, _ = receive(slow)
        with pytest.raises(TimeoutError):
            receive(slow, 0.3)
        serials = []
        for _ in range(40):
            header, jpeg = receive(quick)
            serials.append(header["serial"])
            quick.send(json.dumps({"drawn": header["serial"]}))
        assert serials == sorted(set(serials))
        assert served.lens.opened == 1
        # Hundreds of pictures later the slow one goes on with the newest, not where it was.
        newest = serials[-1]
        slow.send(json.dumps({"drawn": IN_FLIGHT}))
        header, jpeg = receive(slow)
        assert header["serial"] >= newest
        assert number(jpeg) >= newest
        assert header["by"] == "capture"
        assert 0.0 <= header["age"] < 5.0


@pytest.mark.parametrize("served", [True], indirect=True)
def test_a_patient_camera_takes_no_picture_that_nobody_is_ready_for(served: Served) -> None:
    with served.open() as page:
        serials = [receive(page)[0]["serial"] for _ in range(IN_FLIGHT)]
        time.sleep(0.3)
        shown = served.lens.shown
        assert shown <= IN_FLIGHT + 1
        time.sleep(0.2)
        assert served.lens.shown == shown
        page.send(json.dumps({"drawn": serials[-1]}))
        assert receive(page)[0]["serial"] > serials[-1]


def test_trouble_is_told_and_its_end_too(served: Served) -> None:
    with served.open() as page:
        assert receive(page)[0]["type"] == "picture"
        served.lens.broken = True
        while (header := receive(page)[0])["type"] == "picture":
            page.send(json.dumps({"drawn": header["serial"]}))
        assert header["text"] == "the camera does not answer"
        served.lens.broken = False
        page.send("nonsense")
        page.send(json.dumps({"drawn": 10**6}))
        while (header := receive(page)[0])["type"] == "trouble":
            assert header["text"] in ("", "the camera does not answer")


def test_nobody_watches_nothing_is_fetched(served: Served) -> None:
    with served.open() as page:
        receive(page)
    end = time.monotonic() + 10.0
    while served.camera.viewers:
        assert time.monotonic() < end
        time.sleep(0.01)
    time.sleep(0.1)
    shown = served.lens.shown
    time.sleep(0.1)
    assert served.lens.shown == shown


def test_unknown_cameras_foreign_pages_and_crowds_are_refused(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in ("left/1", "right/0", "left/-1", "left/x"):
        with pytest.raises(InvalidStatus):
            served.open(path)
    with pytest.raises(InvalidStatus):
        served.open(origin="http://evil.example")
    monkeypatch.setattr(module, "MOST_VIEWERS", 1)
    with served.open() as page:
        receive(page)
        with pytest.raises(InvalidStatus):
            served.open()


def test_the_page_may_reach_the_named_streams_and_no_others() -> None:
    assert "connect-src 'self';" in page_policy()
    policy = page_policy(("https://media.local:8889", "http://10.0.0.7"))
    assert "connect-src 'self' https://media.local:8889 http://10.0.0.7;" in policy
    assert policy.count("media.local") == 1
    assert "{" in PAGE_POLICY
    assert "{" not in policy

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})

    sent: list[Any] = []

    async def ask(path: str) -> bytes:
        async def send(message: Any) -> None:
            sent.append(message)

        with_headers = SecurityHeaders(app, https=False, streams=("https://media.local:8889",))
        scope = {"type": "http", "path": path, "headers": []}
        await with_headers(scope, None, send)  # type: ignore[arg-type]
        return dict(sent[-1]["headers"])[b"content-security-policy"]

    assert b"media.local:8889" in asyncio.run(ask("/"))
    assert b"media.local" not in asyncio.run(ask("/api/site"))
