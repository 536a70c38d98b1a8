"""The operators' page alone: files from static/, frames made here, no backend."""

from __future__ import annotations

import json
import math
import mimetypes
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Route, WebSocketRoute

STATIC = Path(__file__).resolve().parents[2] / "static"
LIMITS = {"boom": (-0.5, 1.2), "stick": (-2.6, -0.3), "bucket": (-2.0, 0.9)}
FREE = [[1, 1]] * 4


def frame(header: dict[str, Any], arrays: dict[str, np.ndarray] | None = None) -> bytes:
    """uint32 header length, JSON header, zeros to a multiple of 8, little-endian float32 arrays."""
    payload, listed = b"", {}
    for name, array in (arrays or {}).items():
        listed[name] = {"dtype": "f4", "shape": list(array.shape), "offset": len(payload)}
        payload += array.astype("<f4").tobytes()
    text = json.dumps({**header, "arrays": listed}).encode()
    head = struct.pack("<I", len(text)) + text
    return head + bytes(-len(head) % 8) + payload


def site(**changes: Any) -> bytes:
    joints = [
        {"role": "swing", "lower": None, "upper": None, "continuous": True, "max_velocity": 0.9}
    ]
    joints += [
        {"role": role, "lower": low, "upper": high, "continuous": False, "max_velocity": 0.5}
        for role, (low, high) in LIMITS.items()
    ]
    machine = {"model": "mini", "title": "Mini", "max_reach": 4.371, "joints": joints}
    return frame(
        {
            "type": "site",
            "name": "test",
            "title": "Test site",
            "mode": "LIVE",
            "frame": {"epsg": 32652, "origin": [308600.0, 4129950.0, 0.0]},
            "own": ["left"],
            "safety": {"slow_below": 0.8, "stop_below": 0.2, "eta": 0.1},
            "machines": {
                "left": {**machine, "label": "LEFT"},
                "right": {**machine, "label": "RIGHT"},
            },
            "obstacles": [],
            **changes,
        }
    )


def machine(label: str, x: float, age: float = 0.02) -> dict[str, Any]:
    joints = {"swing": math.radians(30), "boom": 0.5, "stick": -1.0, "bucket": 0.2}
    square = [[x - 1, -1], [x + 1, -1], [x + 1, 1], [x - 1, 1]]
    return {
        "label": label,
        "model": "mini",
        "validity": "VALID" if age < 0.2 else "STALE",
        "reasons": [],
        "position": [x, 0.0, 0.0],
        "position_projected": [308600 + x, 4129950.0, 0.0],
        "yaw": 0.0,
        "joints": joints,
        "joint_velocities": dict.fromkeys(joints, 0.0),
        "ages": {"joints": age, "position": 0.04, "heading": 0.04},
        "rates": {"joints": 200.0, "position": 20.0, "heading": 20.0},
        "fix": "RTK_FIXED",
        "swing_center": [x, 0.0, 0.6],
        "end_point": [x + 3.0, 1.0, 0.2],
        "azimuth": math.radians(30),
        "reach": 3.2,
        "max_reach": 4.371,
        "sun": {"pitch": 0.0, "boom": 0.5, "stick": -1.0, "bucket": 0.2},
        "outlines": {"tracks": square},
    }


def snapshot(cycle: int, **changes: Any) -> bytes:
    now = 100.0 + 0.04 * cycle
    concern = {
        "name": "partner",
        "machine": "left",
        "level": "CLEAR",
        "reason": "",
        "allowed": FREE,
        "travel": [1, 1],
    }
    pair = {"a": "left", "b": "right", "body_a": "bucket/0", "body_b": "boom/0", "distance": 3.42}
    header: dict[str, Any] = {
        "type": "snapshot",
        "time": now,
        "state_time": now - 0.05,
        "cycle": cycle,
        "mode": "LIVE",
        "wall": time.time(),
        "machines": {"left": machine("LEFT", 0.0), "right": machine("RIGHT", 7.0)},
        "pairs": [{**pair, "points": [[3, 1, 0.2], [5, 1, 0.2]], "reason": "", "approach": 0.0}],
        "concerns": [concern],
        "alarms": [],
        "backend": {"cycle_ms": {"p50": 2.0, "p95": 4.0, "p99": 6.0}, "rate_hz": 50.0},
    }
    return frame({**header, **changes})


def sun(cycle: int) -> bytes:
    """theta 20..40 degrees from 3.5 m on; a mesh of 4 x 5 samples, one corner out of reach."""
    boom = np.linspace(0.2, 0.8, 4)[:, None] + np.zeros((1, 5))
    stick = np.linspace(-1.4, -0.6, 5)[None, :] + np.zeros((4, 1))
    stick[0, 0] = np.nan
    arrays = {
        "zone": np.array([[2.0, -3.0], [9.0, -3.0], [9.0, 3.0], [2.0, 3.0]]),
        "theta": np.radians(np.linspace(20, 40, 5)),
        "d": np.full(5, 3.5),
        "boom": boom,
        "stick": stick,
        "bucket": -boom - stick,
    }
    current = {
        "theta": math.radians(30),
        "d": 3.2,
        "boom": 0.5,
        "stick": -1.0,
        "bucket": 0.2,
        "collides": False,
    }
    times = {"state_time": 100.0 + 0.04 * cycle - 0.05, "eta": 0.1, "m": 3, "n": 4}
    return frame(
        {
            "type": "sun",
            "key": "left<-right",
            "own": "left",
            "partner": "right",
            **times,
            "current": current,
        },
        arrays,
    )


class Feed:
    """The page and the server's end of its websocket."""

    def __init__(self, browser: Browser, width: int, height: int) -> None:
        self.page: Page = browser.new_page(viewport={"width": width, "height": height})
        self.errors: list[str] = []
        self.cycle = 0
        self.socket: WebSocketRoute | None = None
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.route("**/*", serve)
        self.more_routes()
        self.page.route_web_socket("**/ws", self.accept)
        self.page.goto("http://page.test/")
        self.wait(lambda: self.socket is not None)

    def more_routes(self) -> None:
        """What else the server answers; stands before the page is opened, so that nothing it
        asks for early is missed."""

    def accept(self, socket: WebSocketRoute) -> None:
        self.socket = socket
        socket.on_message(lambda message: None)
        socket.send(site())

    def send(self, until: Callable[[], bool], **changes: Any) -> None:
        """25 Hz frames, 12.5 Hz images, until the page shows what is expected; fails after 15 s."""
        end = time.monotonic() + 15
        while time.monotonic() < end:
            self.cycle += 1
            assert self.socket is not None
            self.socket.send(snapshot(self.cycle, **changes))
            if self.cycle % 2:
                self.socket.send(sun(self.cycle))
            self.page.wait_for_timeout(40)
            if self.cycle % 5 == 0 and until():
                return
        pytest.fail(f"the page did not get there: {self.page.inner_text('#alarm-line')!r}")

    def wait(self, until: Callable[[], bool]) -> None:
        """Polled from here: the page's policy forbids evaluating strings in it."""
        end = time.monotonic() + 15
        while not until():
            assert time.monotonic() < end, "the page did not get there"
            self.page.wait_for_timeout(50)

    def ready(self) -> bool:
        drawn = self.page.get_attribute("body", "data-ready") == "1"
        return drawn and all(
            self.shown(name) for name in ("reach", "bars", "slice-0", "slice-2", "limits")
        )

    def shown(self, canvas: str) -> dict[str, Any]:
        shown: dict[str, Any] = json.loads(
            self.page.get_attribute(f"#{canvas}", "data-state") or "{}"
        )
        return shown

    def level(self) -> str | None:
        return self.page.get_attribute("#alarm", "data-level")


def serve(route: Route) -> None:
    path = route.request.url.removeprefix("http://page.test").split("?")[0]
    if path.startswith("/view"):
        route.fulfill(body="<!doctype html><title>scene</title>", content_type="text/html")
        return
    file = STATIC / ("index.html" if path == "/" else path.removeprefix("/static/"))
    policy = {"Content-Security-Policy": "default-src 'self'; connect-src 'self' ws:"}
    kind = "text/javascript" if file.suffix == ".js" else mimetypes.guess_type(file.name)[0]
    route.fulfill(body=file.read_bytes(), content_type=kind or "text/plain", headers=policy)


@pytest.fixture
def feed(browser: Browser) -> Iterator[Feed]:
    opened = Feed(browser, 1366, 768)
    yield opened
    opened.page.close()


SIZES = {
    (1920, 1080): {
        "top": (1904, 64),
        "scene-panel": (1128, 640),
        "plan-panel": (380, 380),
        "alarm": (1904, 88),
        "trends-panel": (768, 200),
    },
    (1366, 768): {
        "top": (1354, 48),
        "scene-panel": (808, 436),
        "plan-panel": (267, 267),
        "alarm": (1354, 64),
        "trends-panel": (540, 156),
    },
}


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_layout_is_exact_and_nothing_scrolls(browser: Browser, size: tuple[int, int]) -> None:
    feed = Feed(browser, *size)
    feed.send(feed.ready)
    for panel, expected in SIZES[size].items():
        box = feed.page.locator(f"#{panel}").bounding_box()
        assert box is not None
        assert (round(box["width"]), round(box["height"])) == expected, panel
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
    assert feed.errors == []
    feed.page.close()


def test_panels_show_what_the_frames_say(feed: Feed) -> None:
    page = feed.page
    line = "CLEAR · LEFT bucket ↔ RIGHT boom · 3.4 m"
    seen: dict[str, dict[str, Any]] = {}

    def look() -> bool:
        # Read while frames arrive: a second without them and the page rightly shows a lost link.
        seen.update({name: feed.shown(name) for name in ("plan", "reach", "bars", "slice-0")})
        return (
            feed.ready()
            and page.inner_text("#alarm-line") == line
            and bool(seen["plan"].get("nearest"))
        )

    feed.send(look)
    assert seen["reach"]["star"] == pytest.approx([30.0, 3.2], abs=1e-3)
    assert seen["bars"]["joints"]["swing"] == pytest.approx(30.0)
    assert seen["slice-0"]["star"] == pytest.approx([0.5, -1.0], abs=1e-4)
    # The cell with the unreachable corner is left out.
    assert seen["slice-0"]["cells"] == 3 * 4 - 1
    assert seen["plan"]["nearest"] == pytest.approx(3.42)
    page.hover("#slice-0", position={"x": 80, "y": 60})
    page.wait_for_selector("#hover:not([hidden])")
    assert "boom" in page.inner_text("#hover")
    assert "°" in page.inner_text("#hover")
    page.keyboard.press("2")
    feed.send(lambda: feed.shown("bars")["own"] == "right")
    assert feed.errors == []


def test_the_last_drawing_is_the_one_that_is_described(feed: Feed) -> None:
    """A plot is described at most twice a second, and in the end as it was drawn last."""
    described = feed.page.evaluate(
        """async () => {
          const { surface } = await import("/static/js/surface.js");
          const canvas = document.createElement("canvas");
          canvas.style.cssText = "position: fixed; width: 90px; height: 90px";
          document.body.append(canvas);
          let label = "first";
          const plot = surface(canvas, () => ({ state: {}, age: 0, label }));
          while (!plot.width) await new Promise(requestAnimationFrame);
          const seen = [];
          const draw = (now) => {
            plot.draw(now, 0);
            seen.push(canvas.getAttribute("aria-label"));
          };
          draw(1000);
          label = "second";
          plot.dirty = true;
          draw(1100); // drawn, but too early to be described
          draw(1400);
          draw(1600); // nothing new to draw
          canvas.remove();
          return seen;
        }"""
    )
    assert described == ["first", "first", "first", "second"]


def test_alarm_replaces_the_calm_line(feed: Feed) -> None:
    feed.send(feed.ready)
    line = "SLOW · LEFT bucket ↔ RIGHT boom · 0.62 m"
    alarm = {
        "level": "SLOW",
        "name": "partner",
        "machine": "left",
        "line": line,
        "detail": "Swing left limited to 40 %.",
        "since": 100.0,
        "active": True,
    }
    concern = {
        "name": "partner",
        "machine": "left",
        "level": "SLOW",
        "reason": "near",
        "allowed": [[1, 0.4], *FREE[1:]],
        "travel": [1, 1],
    }
    shown = feed.page.locator("#alarm-line")
    feed.send(
        lambda: feed.level() == "SLOW" and shown.inner_text() == line,
        alarms=[alarm],
        concerns=[concern],
    )
    limited = {"left": 40, "right": 100}
    feed.send(
        lambda: feed.shown("limits")["allowed"]["swing"] == limited,
        alarms=[alarm],
        concerns=[concern],
    )


def test_stale_partner_and_lost_link_never_read_clear(feed: Feed) -> None:
    feed.send(feed.ready)
    machines = {"left": machine("LEFT", 0.0), "right": machine("RIGHT", 7.0, age=0.6)}
    unknown = {
        "a": "left",
        "b": "right",
        "body_a": "",
        "body_b": "",
        "distance": None,
        "points": None,
        "reason": "RIGHT joints are 0.6 s old",
        "approach": 0.0,
    }
    feed.send(
        lambda: (
            feed.level() == "UNKNOWN"
            and feed.shown("reach")["hollow"]
            and feed.shown("plan")["nearest"] is None
        ),
        machines=machines,
        pairs=[unknown],
    )
    feed.page.wait_for_selector('body[data-link="lost"]')
    assert feed.page.inner_text("#alarm-line").startswith("LINK LOST")
    feed.wait(lambda: feed.shown("limits")["allowed"]["boom"]["up"] == 0)
    feed.send(lambda: feed.level() == "CLEAR")
