"""The strip along a track, with made-up frames: asked for, drawn, and nothing clipped."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, WebSocketRoute
from test_page_exact import CLIPPED, OUTSIDE, ExactFeed
from test_page_offline import frame, site

from backend.pipeline.along import AlongImage
from backend.pipeline.along_track import Placement, Stretch
from backend.shell.app.image_frames import along_frame
from backend.shell.app.wire import decode

SQUARE = [[-500.0, -500.0], [500.0, -500.0], [500.0, 500.0], [-500.0, 500.0]]
TRACK = {
    "name": "T1",
    "kind": "track",
    "state": "existing",
    "rule": "",
    "idle": "is switched off",
    "plan": [{"exterior": SQUARE, "holes": []}],
    "boxes": [],
    "hulls": [],
}


def strip(state_time: float) -> bytes:
    """Clear, then into T2, then undecided, and unknown at the end."""
    kinds = ("clear",) * 40 + ("violates",) * 12 + ("undecided",) * 4 + ("clear",) * 30
    kinds += ("unknown",) * 14
    items = []
    for k, kind in enumerate(kinds):
        value = {"violates": -0.3, "undecided": 0.1}.get(kind, 0.4 + 0.02 * k)
        if kind == "unknown":
            value = float("nan")
        body, limit = ("", "") if kind == "unknown" else ("stick/0", "gauge:T2/3")
        items.append(Stretch(k, k + 1.0, kind, value, value - 0.02, body, limit))  # type: ignore[arg-type]
    place = Placement(50.0, 0.0, 0.0, 0.0)
    rest = (state_time, 100.0, place, 0.1, 3.0, 20.0, 43, "", tuple(items))
    return along_frame(AlongImage("left", "T1", *rest))


class AlongFeed(ExactFeed):
    def accept(self, socket: WebSocketRoute) -> None:
        super().accept(socket)
        header, _ = decode(site())
        socket.send(frame({**header, "gauge": [TRACK]}))


def test_the_strip_is_asked_for_drawn_and_fits(browser: Browser, artifacts: Path) -> None:
    feed = AlongFeed(browser, 1366, 768)
    feed.send(feed.exact_ready)
    assert feed.of("along") == []
    assert feed.page.inner_text("#along-show") == "Along T1"
    feed.page.click("#along-show")
    feed.send(lambda: len(feed.of("along")) > 0)
    assert feed.of("along")[0]["machine"] == "left"
    assert feed.socket is not None
    feed.socket.send(strip(100.0 + 0.04 * feed.cycle))
    feed.send(lambda: len(feed.shown("trends").get("bands", [])) == 5)
    shown = feed.shown("trends")
    assert (shown["kind"], shown["track"], shown["station"]) == ("along", "T1", 50.0)
    assert shown["bands"][1] == ["violates", 40.0, 52.0]
    assert (shown["least"], shown["limit"]) == (-0.3, "T2")
    assert feed.page.inner_text("#trends-title") == "Along T1"
    assert feed.page.evaluate(CLIPPED) == []
    assert feed.page.evaluate(OUTSIDE) == []
    feed.page.screenshot(path=artifacts / "along-1366x768.png")
    feed.page.mouse.move(*feed.at("trends", 0.3, 0.5))
    feed.send(lambda: "clear" in feed.page.inner_text("#hover"))
    assert "stick ↔ T2" in feed.page.inner_text("#hover")
    feed.page.click("#along-show")
    feed.send(lambda: "clearance" in feed.shown("trends"))
    assert feed.page.inner_text("#trends-title") == "Last 60 s"
    assert feed.errors == []
    feed.page.close()
