"""A page in a real browser, watched."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

SIZES = [(1920, 1080), (1366, 768)]
CANVASES = ["plan", "reach", "slice-0", "slice-1", "slice-2", "bars", "limits", "trends"]
STATES = """ids => Object.fromEntries(ids.map(id => {
  const c = document.getElementById(id);
  return [id, {state: JSON.parse(c.dataset.state ?? "null"), age: c.dataset.age}];
}))"""


class Watched:
    """A page whose console is kept: an error there is a failure."""

    def __init__(self, browser: Browser | BrowserContext, url: str, size: tuple[int, int]) -> None:
        width, height = size
        self.page: Page = browser.new_page()
        self.page.set_viewport_size({"width": width, "height": height})
        # Drawn by the processor, beside all processes of a site: a picture can take its time.
        self.page.set_default_timeout(120_000)
        self.errors: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.goto(url)
        self.until("document.body.dataset.ready === '1'", 120.0)

    def until(self, condition: str, timeout: float = 30.0) -> None:
        """Waits for a JavaScript condition. (The page's policy forbids Playwright's own wait.)"""
        deadline = time.monotonic() + timeout
        while not self.page.evaluate(f"() => Boolean({condition})"):
            assert time.monotonic() < deadline, f"not within {timeout} s: {condition}"
            time.sleep(0.05)

    def canvases(self) -> dict[str, Any]:
        found: dict[str, Any] = self.page.evaluate(STATES, CANVASES)
        return found

    def both(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Canvases and snapshot of one moment."""
        canvases, snapshot = self.page.evaluate(
            f"ids => [({STATES})(ids), window.cockpit.state.snapshot]", CANVASES
        )
        return canvases, snapshot

    def snapshot(self) -> dict[str, Any]:
        found: dict[str, Any] = self.page.evaluate("window.cockpit.state.snapshot")
        return found


Watch = Callable[[str, tuple[int, int]], Watched]


@pytest.fixture
def watch(browser: Browser) -> Iterator[Watch]:
    """Opens pages and closes them at the end: a page left open goes on drawing."""
    opened: list[Watched] = []

    def open_page(url: str, size: tuple[int, int]) -> Watched:
        opened.append(Watched(browser, url, size))
        return opened[-1]

    yield open_page
    for watched in opened:
        watched.page.close()
