"""The scene through the page's own origin: over real sockets, and in a real browser."""

from __future__ import annotations

import asyncio
import io
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import msgspec
import numpy as np
import pytest
import toy_site as toy
import uvicorn
import viser
from fastapi import FastAPI
from PIL import Image
from playwright.sync_api import Browser
from starlette.requests import HTTPConnection
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from backend.fusion.pose import Validity
from backend.shell.app.viewer_proxy import Hooks, viewer_router, views_only
from cockpit.views.client_head import HEAD
from cockpit.views.server import View, start

PROTOCOL = f"viser-v{viser.__version__}"


@dataclass
class Front:
    """The page's server with the scene behind it."""

    port: int
    view: View
    source: toy.Source
    starting: bool = False
    refused: set[str] = field(default_factory=set)  # paths that `allow` turns away

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"


@pytest.fixture(scope="module")
def front() -> Iterator[Front]:
    source = toy.Source()
    source.put(toy.snapshot(1))
    source.images[("sun", "left<-right")] = toy.Zone(toy.ring_zone())
    view = start(toy.site(), source)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        made = Front(probe.getsockname()[1], view, source)

    def allow(request: HTTPConnection) -> bool:
        return request.url.path not in made.refused

    app = FastAPI()
    hooks = Hooks(allow=allow, opened=view.attach, closed=view.detach)
    app.include_router(viewer_router(lambda: None if made.starting else view.port, hooks, HEAD))
    server = uvicorn.Server(
        uvicorn.Config(app, "127.0.0.1", made.port, log_level="error", lifespan="off")
    )
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    end = time.monotonic() + 10
    while not server.started and time.monotonic() < end:
        time.sleep(0.02)
    yield made
    server.should_exit = True
    thread.join(timeout=5)
    view.stop()


@pytest.fixture(autouse=True)
def _allow_all(front: Front) -> Iterator[None]:
    yield
    front.refused.clear()


def get(front: Front, path: str, **headers: str) -> httpx.Response:
    return httpx.get(f"http://{front.host}{path}", headers=headers, trust_env=False)


def shake(
    front: Front, path: str = "/view", origin: str | None = "same", protocol: str | None = PROTOCOL
) -> bytes | None:
    """The first message from the scene, or None when the handshake is refused."""

    async def try_it() -> bytes | None:
        headers = {} if origin is None else {"Origin": origin}
        if origin == "same":
            headers = {"Origin": f"http://{front.host}"}
        try:
            async with connect(
                f"ws://{front.host}{path}",
                subprotocols=[protocol] if protocol else None,  # type: ignore[list-item]
                additional_headers=headers,
                max_size=None,
                proxy=None,
            ) as socket_:
                assert socket_.subprotocol == protocol
                first = await asyncio.wait_for(socket_.recv(), 5.0)
                assert isinstance(first, bytes)
                return first
        except (InvalidHandshake, ConnectionClosed):
            return None

    return asyncio.run(try_it())


def test_while_the_scene_starts_a_page_stands_there_that_asks_again(front: Front) -> None:
    front.starting = True
    answer = get(front, "/view/abc/?darkMode")
    assert answer.status_code == 202
    assert 'http-equiv="refresh"' in answer.text
    assert answer.headers["cache-control"] == "no-store"
    assert shake(front) is None
    front.starting = False
    assert get(front, "/view/abc/?darkMode").status_code == 200
    assert shake(front) is not None


def test_the_client_page_comes_with_the_head_and_a_policy(front: Front) -> None:
    answer = get(front, "/view/")
    assert answer.status_code == 200
    assert answer.text.index(HEAD) < answer.text.index("</head>")
    assert "frame-ancestors 'self'" in answer.headers["content-security-policy"]
    again = get(front, "/view/w1/", **{"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304
    assert get(front, "/view").headers["location"].endswith("/view/")


def test_paths_that_are_no_page_are_not_found(front: Front) -> None:
    assert get(front, "/view/a%20b/").status_code == 404
    assert get(front, "/view/..%2F..%2Fetc/passwd").status_code == 404
    assert shake(front, "/view/a%20b") is None


def test_who_is_not_allowed_sees_nothing(front: Front) -> None:
    front.refused |= {"/view/", "/view"}
    assert get(front, "/view/").status_code == 403
    assert shake(front) is None


def test_the_own_page_gets_the_scene(front: Front) -> None:
    assert len(shake(front) or b"") > 1000
    assert shake(front, "/view/w1") is not None


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "http://evil.example",
        "null",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        "ftp://same",
        "http://evil.example/127.0.0.1",
    ],
)
def test_a_foreign_origin_is_refused(front: Front, origin: str | None) -> None:
    assert shake(front, origin=origin) is None


@pytest.mark.parametrize("protocol", [None, "chat", "viser-v" + "9" * 80])
def test_other_protocols_are_refused(front: Front, protocol: str | None) -> None:
    assert shake(front, protocol=protocol) is None


def test_what_a_window_that_looks_may_send() -> None:
    def message(kind: object) -> bytes:
        return msgspec.msgpack.encode({"type": kind, "position": [0, 0, 0]})

    assert views_only(message("ViewerCameraMessage"))
    for kind in ("ShareUrlRequest", "FileTransferStartUpload", "CommandTriggerMessage", "", 7):
        assert not views_only(message(kind))
    for broken in (b"", b"\xc1", b"\x93\x01\x02", b"{}", message("ViewerCameraMessage")[:-4]):
        assert not views_only(broken)


def test_malformed_messages_do_not_reach_the_scene(front: Front) -> None:
    """The scene's own server ends a connection on malformed input; through here it lives on."""

    async def talk() -> None:
        async with connect(
            f"ws://{front.host}/view",
            subprotocols=[PROTOCOL],  # type: ignore[list-item]
            additional_headers={"Origin": f"http://{front.host}"},
            max_size=None,
            proxy=None,
        ) as socket_:
            await socket_.recv()
            await socket_.send(b"\xc1 nonsense")
            await socket_.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
            await socket_.send(b"\x00" * 200_000)
            await asyncio.sleep(0.3)
            await asyncio.wait_for(await socket_.ping(), 2.0)

    asyncio.run(talk())


@pytest.mark.browser
def test_a_browser_draws_the_scene(front: Front, browser: Browser, artifacts: Path) -> None:
    stop = threading.Event()
    stale = threading.Event()

    def feed() -> None:
        cycle = 1000
        while not stop.wait(0.04):
            cycle += 1
            validity = Validity.STALE if stale.is_set() else Validity.VALID
            front.source.put(toy.snapshot(cycle, validity=validity))

    feeding = threading.Thread(target=feed)
    feeding.start()
    try:
        page = browser.new_page(viewport={"width": 808, "height": 436})
        errors: list[str] = []
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"http://{front.host}/view/w1/?hideViserLogo&darkMode")

        def picture(name: str) -> np.ndarray:
            data = page.screenshot(path=artifacts / f"scene-{name}.png")
            return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)

        def wait_for(name: str, true: object, seconds: float = 40.0) -> np.ndarray:
            end = time.monotonic() + seconds
            while True:
                shot = picture(name)
                if true(shot):  # type: ignore[operator]
                    return shot
                assert time.monotonic() < end, f"scene-{name}.png does not show it"
                time.sleep(0.5)

        def sand(shot: np.ndarray) -> int:  # LEFT's tint
            r, g, b = np.moveaxis(shot, 2, 0)
            return int(((r > 120) & (r > b + 30) & (abs(r - g) < 40)).sum())

        def slate(shot: np.ndarray) -> int:  # RIGHT's tint, lit from above
            r, g, b = np.moveaxis(shot, 2, 0)
            return int(((r > 140) & (b < 205) & (abs(r - b) < 28) & (g >= r)).sum())

        def purple(shot: np.ndarray) -> int:  # the zone
            r, g, b = np.moveaxis(shot, 2, 0)
            return int(((b > g + 12) & (r > g + 6)).sum())

        first = wait_for("site", lambda s: sand(s) > 1500 and slate(s) > 800 and purple(s) > 6000)
        front.view.set_camera("plan", "nobody")
        time.sleep(1.0)
        assert purple(picture("site")) == pytest.approx(purple(first), rel=0.05)
        front.view.set_camera("plan", "w1")
        plan = wait_for("plan", lambda s: np.abs(s - first).mean() > 3.0 and sand(s) > 800)
        stale.set()
        wait_for("stale", lambda s: slate(s) < slate(plan) / 2 and sand(s) > 800)
        assert not errors
        assert not page.locator("[data-floating-window]").is_visible()
        page.close()
    finally:
        stop.set()
        feeding.join()
