"""Exact images, zones, margins and the ghost on the page alone, with made-up frames."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from exact_frames import CELLS, Q, exact, margins, zone
from playwright.sync_api import Browser, Route, WebSocketRoute
from test_page_offline import Feed, machine, site, snapshot, sun

SIZES = [(1920, 1080), (1366, 768)]
CANVASES = ("reach", "bars", "plan", "slice-0", "slice-1", "slice-2")


class ExactFeed(Feed):
    """Sends exact images and zones beside Sun's, and keeps what the page sends."""

    def __init__(self, browser: Browser, width: int, height: int) -> None:
        self.sent: list[dict[str, Any]] = []
        self.images = True
        self.base = (0.0, 0.0)
        self.changes: dict[str, Any] = {}
        super().__init__(browser, width, height)

    def accept(self, socket: WebSocketRoute) -> None:
        self.socket = socket
        socket.on_message(lambda message: self.sent.append(json.loads(message)))
        socket.send(site())

    def send(self, until: Callable[[], bool], **changes: Any) -> None:
        end = time.monotonic() + 20
        changes = {"margins": margins(), **changes}
        while time.monotonic() < end:
            self.cycle += 1
            assert self.socket is not None
            self.socket.send(snapshot(self.cycle, **changes))
            if self.images and self.cycle % 3 == 0:
                at = 100.0 + 0.04 * self.cycle - 0.1
                self.socket.send(sun(self.cycle))
                self.socket.send(exact(at, **self.changes))
                self.socket.send(zone(at, base=self.base))
            self.page.wait_for_timeout(40)
            if self.cycle % 5 == 0 and until():
                return
        pytest.fail(f"the page did not get there: {self.shown('slice-0')}, {self.shown('plan')}")

    def exact_ready(self) -> bool:
        return self.shown("slice-0").get("kind") == "slice" and bool(self.shown("plan").get("zones"))

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [m for m in self.sent if m["type"] == kind]

    def at(self, canvas: str, x: float, y: float) -> tuple[float, float]:
        """Page coordinates of a share of a canvas."""
        box = self.page.locator(f"#{canvas}").bounding_box()
        assert box is not None
        return box["x"] + x * box["width"], box["y"] + y * box["height"]


@pytest.fixture
def feed(browser: Browser) -> Iterator[ExactFeed]:
    opened = ExactFeed(browser, 1920, 1080)
    yield opened
    opened.page.close()


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_screenshots(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    feed = ExactFeed(browser, *size)
    for mode in ("exact", "sun", "difference"):
        feed.send(lambda mode=mode: feed.exact_ready() if mode == "exact" else True)
        feed.send(lambda mode=mode: feed.shown("reach").get("shown", "sun") == mode)
        feed.page.screenshot(path=artifacts / f"page-{mode}-{size[0]}x{size[1]}.png")
        feed.page.keyboard.press("x")
    assert feed.errors == []
    feed.page.close()
