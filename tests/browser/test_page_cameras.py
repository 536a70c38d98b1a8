"""Camera pictures on the page alone, with made-up pictures and a made-up WHEP server."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driving_frames import DriveFeed
from playwright.sync_api import Browser, Route, WebSocketRoute
from test_page_exact import CLIPPED, OUTSIDE, ExactFeed
from test_page_offline import frame, site

from backend.machine.load import load_machine
from backend.shell.app.wire import decode, encode
from backend.shell.sim.cab import Seen, Surroundings, cab_view
from backend.shell.sim.camera import jpeg_of
from backend.spatial.transform import make

SIZES = [(1920, 1080), (1366, 768)]
CAB = {"kind": "link", "label": "cab", "url": None}
REAR = {"kind": "mjpeg", "label": "rear", "url": None}


def picture() -> bytes:
    """LEFT's view of RIGHT, as in the demo."""
    mini, q = load_machine("mini"), np.radians([-50.0, 40.0, -60.0, -60.0])
    left = make(np.eye(3), np.array([4.0, 4.0, 0.0]))
    right = make(np.diag([-1.0, -1.0, 1.0]), np.array([9.5, -0.5, 0.0]))
    return jpeg_of(cab_view(Seen(mini, q, left), [Seen(mini, q, right, 1)], Surroundings()))


class Cameras:
    """The server's end of the cameras' websockets."""

    cameras: dict[str, list[dict[str, Any]]]
    streams: dict[str, WebSocketRoute]
    drawn: dict[str, list[int]]
    opened: list[str]

    def start(self, cameras: dict[str, list[dict[str, Any]]]) -> None:
        self.cameras, self.streams, self.drawn, self.opened = cameras, {}, {}, []
        self.jpeg, self.serial = picture(), 0

    def site(self) -> bytes:
        header, _ = decode(site())
        for name, listed in self.cameras.items():
            header["machines"][name]["cameras"] = listed
        return frame(header)

    def camera(self, socket: WebSocketRoute) -> None:
        name = socket.url.split("/api/camera/")[1]
        self.streams[name] = socket
        self.opened.append(name)

        def on_message(message: str | bytes) -> None:
            self.drawn.setdefault(name, []).append(json.loads(message)["drawn"])

        socket.on_message(on_message)
        socket.on_close(lambda code, reason: self.streams.pop(name, None))

    def show(self, name: str, age: float = 0.12, by: str = "capture") -> None:
        self.serial += 1
        header = {"type": "picture", "serial": self.serial, "age": age, "by": by}
        jpeg = {"jpeg": np.frombuffer(self.jpeg, dtype=np.uint8)}
        self.streams[name].send(encode({**header, "wall": time.time()}, jpeg))


class CameraFeed(ExactFeed, Cameras):
    def __init__(self, browser: Browser, width: int, height: int, **cameras: Any) -> None:
        self.start(cameras)
        super().__init__(browser, width, height)

    def more_routes(self) -> None:
        self.page.route_web_socket("**/api/camera/**", self.camera)

    def accept(self, socket: WebSocketRoute) -> None:
        self.socket = socket
        socket.on_message(lambda message: self.sent.append(json.loads(message)))
        socket.send(self.site())

    def state(self, side: str = "own") -> str | None:
        return self.page.get_attribute(f"#camera-{side}", "data-state")

    def alive(self, *sides: str) -> bool:
        """Whether a picture is shown that is not too old; on a busy computer it may be amber."""
        return all(self.state(side) in ("fresh", "old") for side in sides or ("own",))

    def play(self, until: Any, *names: str, **how: Any) -> None:
        """Pictures of these cameras, and snapshots, until the page is there."""

        def there() -> bool:
            for name in names:
                if name in self.streams:
                    self.show(name, **how)
            return bool(until())

        self.send(there)


class DriveCameraFeed(CameraFeed, DriveFeed):
    """With the controls of a machine that is driven from here."""

    def __init__(self, browser: Browser, width: int, height: int, **cameras: Any) -> None:
        self.start(cameras)
        DriveFeed.__init__(self, browser, width, height)

    def more_routes(self) -> None:
        DriveFeed.more_routes(self)
        CameraFeed.more_routes(self)

    def accept(self, socket: WebSocketRoute) -> None:
        CameraFeed.accept(self, socket)
        socket.send(frame({"type": "you", "seat": "7", "who": "anna", "role": self.role}))


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_pictures_stand_over_the_scene_and_grow_old_in_words(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = DriveCameraFeed(browser, *size, left=[CAB, REAR], right=[CAB])
    both = ("left/0", "right/0")
    feed.play(lambda: feed.alive("own", "partner"), *both)
    feed.send(feed.exact_ready)
    assert feed.page.evaluate(CLIPPED.replace("#pin *", "#pin *, .camera > header *")) == []
    assert feed.page.evaluate(OUTSIDE) == []
    feed.play(lambda: True, *both)
    assert "LEFT cab" in feed.page.inner_text("#camera-own > header")
    assert feed.page.inner_text("#camera-own .age").endswith(" s old")
    feed.page.screenshot(path=artifacts / f"cameras-{size[0]}x{size[1]}.png")
    # Nothing comes any more: said so, and never a picture that looks alive.
    feed.streams["right/0"].send(encode({"type": "trouble", "text": "the camera sends nothing"}))
    feed.play(lambda: feed.state("partner") == "lost", "left/0")
    veil = feed.page.inner_text("#camera-partner .veil")
    assert "UNKNOWN · no picture for" in veil
    assert "The camera sends nothing" in veil
    feed.page.screenshot(path=artifacts / f"cameras-lost-{size[0]}x{size[1]}.png")
    # Analysis, large, one machine.
    feed.page.keyboard.press("v")
    feed.play(lambda: feed.page.evaluate(CLIPPED) == [], "left/0")
    assert feed.page.evaluate(OUTSIDE) == []
    feed.page.screenshot(path=artifacts / f"cameras-analysis-{size[0]}x{size[1]}.png")
    feed.page.keyboard.press("v")
    feed.page.click("#camera-own .camera-size")
    feed.page.keyboard.press("b")
    feed.play(lambda: feed.alive() and "right/0" not in feed.streams, "left/0")
    assert feed.page.is_hidden("#camera-partner")
    assert feed.page.is_hidden("#machines .machine[aria-pressed=false] .trip")
    assert feed.page.evaluate(OUTSIDE) == []
    feed.page.screenshot(path=artifacts / f"cameras-one-{size[0]}x{size[1]}.png")
    assert feed.errors == []
    feed.page.close()


def test_a_hidden_camera_is_not_fetched_and_choices_are_remembered(browser: Browser) -> None:
    feed = CameraFeed(browser, 1366, 768, left=[CAB, REAR], right=[CAB])
    feed.play(lambda: feed.alive(), "left/0")
    feed.page.click("#camera-own .camera-next")
    feed.play(lambda: feed.alive() and set(feed.streams) == {"left/1", "right/0"}, "left/1")
    assert "rear" in feed.page.inner_text("#camera-own > header")
    feed.page.keyboard.press("c")
    feed.send(lambda: feed.streams == {})
    assert feed.page.is_hidden("#camera-own")
    feed.opened.clear()
    feed.page.reload()
    feed.send(feed.exact_ready)
    assert feed.opened == []
    feed.page.click("#cameras-shown")
    feed.play(lambda: feed.alive(), "left/1")
    # The other machine becomes the own one: cameras change sides.
    feed.page.keyboard.press("2")
    feed.play(lambda: "RIGHT cab" in feed.page.inner_text("#camera-own > header"), "right/0")
    assert feed.errors == []
    feed.page.close()


def test_a_camera_without_stamps_says_what_its_age_counts_from(browser: Browser) -> None:
    feed = CameraFeed(browser, 1366, 768, left=[REAR])
    feed.play(lambda: feed.alive(), "left/0", age=0.0, by="arrival")
    feed.play(
        lambda: "ago" in feed.page.inner_text("#camera-own .age"), "left/0", age=0.0, by="arrival"
    )
    assert feed.page.is_hidden("#camera-partner")
    # Old on arrival is old, however recently it came.
    feed.play(lambda: feed.state() == "lost", "left/0", age=1.5)
    # What is drawn is said, so that the next can be sent.
    assert feed.drawn["left/0"][-1] > 3
    feed.streams["left/0"].close()
    feed.send(lambda: len(feed.opened) > 1)
    feed.page.close()


def test_sites_without_cameras_and_playback_have_none(browser: Browser) -> None:
    feed = CameraFeed(browser, 1366, 768)
    feed.send(feed.exact_ready)
    feed.page.keyboard.press("c")
    assert feed.page.is_hidden("#cameras-shown")
    assert feed.page.is_hidden("#camera-own")
    feed.page.close()


ANSWERER = """async offer => {
  const peer = new RTCPeerConnection();
  window.answerer = peer;
  const canvas = Object.assign(document.createElement("canvas"), {width: 64, height: 36});
  const g = canvas.getContext("2d");
  window.moving = setInterval(() => { g.fillStyle = `hsl(${Date.now() % 360} 50% 50%)`;
    g.fillRect(0, 0, 64, 36); }, 50);
  await peer.setRemoteDescription({type: "offer", sdp: offer});
  for (const track of canvas.captureStream(20).getTracks()) peer.addTrack(track);
  await peer.setLocalDescription(await peer.createAnswer());
  await new Promise(done => { if (peer.iceGatheringState === "complete") done();
    peer.onicegatheringstatechange = () => peer.iceGatheringState === "complete" && done();
    setTimeout(done, 1500); });
  return peer.localDescription.sdp; }"""


def test_a_whep_stream_is_opened_by_the_page_and_its_freezing_is_seen(browser: Browser) -> None:
    """The server is another page of the same browser, behind a made-up HTTP endpoint."""
    server = browser.new_page()
    server.goto("about:blank")
    asked: list[tuple[str, str]] = []
    feed: Any = None

    def whep(route: Route) -> None:
        request = route.request
        asked.append((request.method, request.headers.get("content-type", "")))
        headers = {"Access-Control-Allow-Origin": "*", "Access-Control-Expose-Headers": "Location"}
        if request.method != "POST":
            headers |= {"Access-Control-Allow-Methods": "*", "Access-Control-Allow-Headers": "*"}
            route.fulfill(status=200, headers=headers)
            return
        answer = server.evaluate(ANSWERER, request.post_data)
        headers |= {"Content-Type": "application/sdp", "Location": "/session/1"}
        route.fulfill(status=201, headers=headers, body=answer)

    url = "http://page.test/whep"
    camera = {"kind": "whep", "label": "front", "url": url}

    class WhepFeed(CameraFeed):
        def more_routes(self) -> None:
            super().more_routes()
            self.page.route("**/whep", whep)
            self.page.route("**/session/1", whep)

    feed = WhepFeed(browser, 1366, 768, left=[camera])
    feed.send(lambda: ("POST", "application/sdp") in asked)
    feed.send(lambda: feed.alive())
    assert feed.opened == []  # nothing goes through the cockpit
    server.evaluate("clearInterval(window.moving)")
    feed.send(lambda: feed.state() == "lost")
    feed.page.keyboard.press("c")
    feed.send(lambda: any(method == "DELETE" for method, _ in asked))
    feed.page.close()
    server.close()
