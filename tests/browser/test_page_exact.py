"""Exact images, zones, margins and the ghost on the page alone, with made-up frames."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from functools import partial
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
        drawn = self.shown("slice-0").get("kind") == "slice"
        return drawn and bool(self.shown("plan").get("zones"))

    def shows(self, mode: str) -> bool:
        return bool(self.shown("reach").get("shown", "sun") == mode)

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
    feed.send(feed.exact_ready)
    for mode in ("exact", "sun", "difference"):
        feed.send(partial(feed.shows, mode))
        feed.page.screenshot(path=artifacts / f"page-{mode}-{size[0]}x{size[1]}.png")
        feed.page.keyboard.press("x")
    assert feed.errors == []
    feed.page.close()


CLIPPED = """() => [...document.querySelectorAll("#top *, #alarm *, .panel > header *, #pin *")]
  .filter(n => n.children.length === 0 && n.checkVisibility()
    && n.scrollWidth > n.clientWidth + 1 && n.clientWidth > 0)
  .map(n => n.id || n.textContent)"""
OUTSIDE = """() => [...document.querySelectorAll("main, section, header, canvas, button, #pin")]
  .filter(n => n.checkVisibility()).filter(n => { const r = n.getBoundingClientRect();
    const p = n.closest(".panel")?.getBoundingClientRect() ?? {left: 0, top: 0, right: innerWidth,
      bottom: innerHeight};
    return r.left < p.left - 1 || r.top < p.top - 1 || r.right > p.right + 1
      || r.bottom > p.bottom + 1; }).map(n => n.id || n.textContent)"""


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_nothing_is_clipped_in_any_way_of_showing(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = ExactFeed(browser, *size)
    answer(feed, COLLIDING)
    feed.send(feed.exact_ready)
    feed.page.mouse.click(*feed.at("slice-0", 0.7, 0.4))
    for _ in range(3):
        feed.send(lambda: True)
        assert feed.page.evaluate(CLIPPED) == []
        assert feed.page.evaluate(OUTSIDE) == []
        root = "document.documentElement"
        assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
        feed.page.keyboard.press("x")
    feed.send(lambda: feed.page.get_attribute("#pin", "data-verdict") == "COLLIDING")
    feed.page.mouse.move(*feed.at("slice-1", 0.3, 0.3))
    feed.send(lambda: feed.page.is_visible("#hover"))
    feed.page.screenshot(path=artifacts / f"page-pinned-{size[0]}x{size[1]}.png")
    feed.page.keyboard.press("?")
    assert feed.page.evaluate(OUTSIDE) == []
    assert feed.page.evaluate("document.getElementById('help').scrollHeight") <= (
        feed.page.evaluate("document.getElementById('help').clientHeight")
    )
    feed.page.screenshot(path=artifacts / f"page-help-{size[0]}x{size[1]}.png")
    feed.page.close()


COLLIDING = {
    "verdict": "COLLIDING",
    "reason": "",
    "distance": -0.05,
    "closest": {"own": "bucket/0", "other": "right:boom/1"},
    "hits": [
        {"own": "bucket/0", "other": "right:boom/1", "layer": "partner"},
        {"own": "stick/0", "other": "site:wall", "layer": "site"},
    ],
    "checked_by": "python-fcl",
    "state_time": 100.0,
}


def answer(feed: ExactFeed, document: dict[str, Any], status: int = 200) -> list[dict[str, Any]]:
    """What the server says to /api/whatif; returns the list of questions."""
    asked: list[dict[str, Any]] = []

    def reply(route: Route) -> None:
        question = json.loads(route.request.post_data or "{}")
        asked.append(question)
        body = json.dumps({**question, **document})
        route.fulfill(status=status, body=body, content_type="application/json")

    feed.page.route("**/api/whatif", reply)
    return asked


def test_every_class_of_cell_is_drawn_and_counted(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    for index in range(3):
        shown = feed.shown(f"slice-{index}")
        counts = shown["counts"]
        assert shown["cells"] == CELLS**2
        assert counts["free"] + counts["colliding"] + counts["undecided"] == CELLS**2
        assert min(counts.values()) > 0
        assert {"partner", "site", "self"} <= set(counts)
        assert shown["eta"] == pytest.approx(0.17)
        assert (shown["patch"] is not None) == (index == 0)
    shown = feed.shown("slice-0")
    assert shown["star"] == pytest.approx([Q["boom"], Q["stick"]])
    assert shown["fixed"] == pytest.approx({"bucket": Q["bucket"], "swing": Q["swing"]}, abs=1e-4)
    # Down the stick the stop ends in the partner, up the boom it ends in free.
    assert shown["stops"]["stick"]["red"] is True
    assert shown["stops"]["boom"] == {"now": pytest.approx(0.1), "red": False}
    reach = feed.shown("reach")
    assert reach["kind"] == "exact"
    assert reach["certified"] is False
    assert min(reach["counts"].values()) > 0
    assert reach["star"] == pytest.approx([30.0, 3.2], abs=1e-3)
    assert reach["collides"] is False
    assert feed.errors == []


def test_layers_keep_their_colours_and_differ_in_grey(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    pixels = feed.page.evaluate(
        """() => { const c = document.getElementById("slice-0"); const n = {};
          const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
          for (let i = 0; i < d.length; i += 4) {
            const k = (d[i] << 16 | d[i + 1] << 8 | d[i + 2]).toString(16).padStart(6, "0");
            n[k] = (n[k] ?? 0) + 1; }
          return n; }"""
    )
    # free, undecided, and the outlines of partner, site and self
    for colour in ("22303a", "8a949e", "a970f0", "3e8e78", "c0b8d9"):
        assert pixels.get(colour, 0) > 40, colour


def test_the_key_x_switches_between_exact_sun_and_difference(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    feed.page.keyboard.press("x")
    feed.send(
        lambda: (
            feed.shown("slice-0").get("kind") == "projection"
            and feed.shown("plan")["shown"] == "sun"
            and feed.shown("reach").get("blocked") == 5
        )
    )
    feed.page.reload()  # keeps what was chosen
    feed.send(lambda: feed.shown("reach").get("blocked") == 5 and feed.shows("sun"))
    feed.page.keyboard.press("x")
    feed.send(lambda: feed.shown("slice-0").get("shown") == "difference")
    compared = feed.shown("reach")["compared"]
    # Sun's set starts at 3.5 m between 20 and 40 degrees, where the exact image is free.
    assert compared["only_sun"] > 0
    assert compared["only_exact"] > compared["only_exact_partner"] > 0
    assert feed.shown("slice-0")["sun"] == 3 * 4 - 1
    feed.page.click("#reach-panel .switch")
    feed.send(lambda: feed.shown("slice-0").get("shown") == "exact")


def test_pointing_sends_a_ghost_at_most_ten_times_a_second(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    feed.page.mouse.move(*feed.at("slice-0", 0.5, 0.5))
    feed.send(lambda: bool(feed.of("ghost")))
    first = feed.of("ghost")[-1]
    assert first["machine"] == "left"
    assert first["joints"]["swing"] == pytest.approx(Q["swing"])
    assert first["joints"]["bucket"] == pytest.approx(Q["bucket"])
    assert -0.5 <= first["joints"]["boom"] <= 1.2
    feed.sent.clear()
    begun = time.monotonic()
    for k in range(60):
        feed.page.mouse.move(*feed.at("slice-0", 0.4 + 0.004 * k, 0.5))
    feed.page.wait_for_timeout(150)
    assert 1 <= len(feed.of("ghost")) <= 10 * (time.monotonic() - begun) + 2
    feed.page.mouse.move(*feed.at("reach", 0.25, 0.5))
    feed.send(lambda: feed.of("ghost")[-1]["joints"]["boom"] == Q["boom"])
    # The left quarter of the plot is a swing to the left.
    assert math.degrees(feed.of("ghost")[-1]["joints"]["swing"]) == pytest.approx(115, abs=6)
    tip = feed.page.inner_text("#hover")
    assert "not certified" in tip
    feed.page.mouse.move(*feed.at("alarm", 0.5, 0.5))
    feed.send(lambda: feed.of("ghost")[-1]["machine"] is None)
    assert feed.page.is_hidden("#hover")


def test_pointing_names_layers_and_certificate(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    seen: set[str] = set()
    for x in (0.35, 0.5, 0.6, 0.7, 0.8, 0.85):
        for y in (0.2, 0.4, 0.6, 0.75):
            feed.page.mouse.move(*feed.at("slice-0", x, y))
            seen |= set(feed.page.inner_text("#hover").splitlines())
    text = "\n".join(seen)
    for words in ("certified free", "certified colliding", "collides with RIGHT", "itself", "°"):
        assert words in text, words


def test_where_the_machine_would_tip_is_a_layer(feed: ExactFeed) -> None:
    feed.changes = {"tipping": True, "tip_over": {"judged": True, "reason": ""}}
    feed.send(lambda: feed.exact_ready() and "tip-over" in feed.shown("slice-1")["counts"])
    assert feed.shown("reach")["counts"]["tip-over"] == 20 * 24
    words = set()
    for y in (0.5, 0.6, 0.7):
        feed.page.mouse.move(*feed.at("slice-1", 0.9, y))
        words |= set(feed.page.inner_text("#hover").splitlines())
    assert "tips over, at rest" in "\n".join(words)
    assert "certified tipping, whole cell" in words or "certified colliding, whole cell" in words
    feed.changes = {"tip_over": {"judged": False, "reason": "the slope is not measured"}}
    feed.send(lambda: "tip-over" not in feed.shown("slice-1")["counts"])
    feed.page.mouse.move(*feed.at("slice-1", 0.9, 0.5))
    assert "tip-over unknown: the slope is not measured" in feed.page.inner_text("#hover")
    assert feed.errors == []


def test_a_click_pins_the_verdict_and_escape_clears_it(feed: ExactFeed) -> None:
    asked = answer(feed, COLLIDING)
    feed.send(feed.exact_ready)
    feed.page.mouse.click(*feed.at("slice-2", 0.7, 0.4))
    feed.send(lambda: feed.page.get_attribute("#pin", "data-verdict") == "COLLIDING")
    card = feed.page.inner_text("#pin")
    assert "COLLIDING: bucket ↔ RIGHT boom" in card
    assert "stick ↔ wall" in card
    assert "python-fcl" in card
    assert "−0.05 m" in card
    assert asked[0]["machine"] == "left"
    assert asked[0]["joints"]["boom"] == pytest.approx(Q["boom"])
    pinned = [asked[0]["joints"][role] for role in ("stick", "bucket")]
    feed.send(lambda: feed.shown("slice-2")["pinned"] == pytest.approx(pinned, abs=1e-3))
    # The pinned ghost stays where it is, whatever the pointer does.
    feed.page.mouse.move(*feed.at("slice-0", 0.5, 0.5))
    feed.page.mouse.move(*feed.at("alarm", 0.5, 0.5))
    feed.page.wait_for_timeout(250)
    assert feed.of("ghost")[-1]["joints"] == asked[0]["joints"]
    feed.page.keyboard.press("Escape")
    feed.send(lambda: feed.of("ghost")[-1]["machine"] is None)
    assert feed.page.is_hidden("#pin")
    # Nothing else was said to the server: a click moves no machine.
    assert {m["type"] for m in feed.sent} <= {"hello", "ack", "own", "ghost"}
    assert feed.errors == []


def test_a_pin_that_cannot_be_checked_is_unknown(feed: ExactFeed) -> None:
    answer(feed, {}, status=503)
    feed.send(feed.exact_ready)
    feed.page.mouse.click(*feed.at("bars", 0.5, 0.1))
    feed.send(lambda: feed.page.get_attribute("#pin", "data-verdict") == "UNKNOWN")
    assert "503" in feed.page.inner_text("#pin-verdict")


def test_bars_show_intervals_stops_and_margins(feed: ExactFeed) -> None:
    feed.send(lambda: feed.exact_ready() and feed.shown("bars").get("kind") == "exact")
    bars = feed.shown("bars")["bars"]
    assert bars["swing"]["partner"] > 0
    assert bars["swing"]["site"] > 0
    assert bars["bucket"]["self"] > 0
    assert all(bar["undecided"] > 0 and bar["free"] > 0 for bar in bars.values())
    # The left end of the swing bar is the way to the left: positive.
    assert bars["swing"]["margins"][0] == [pytest.approx(0.31), "right:stick/0"]
    assert bars["boom"]["cannot_stop"] == [True, True]
    assert bars["bucket"]["margins"][1] is None
    feed.send(lambda: "RIGHT boom in 1.3 s" in feed.page.inner_text("#motion"))
    feed.send(lambda: "can reach 63 %" in feed.page.inner_text("#regions"))
    feed.send(
        lambda: (
            "unknown" in feed.page.inner_text("#motion")
            and feed.shown("bars")["bars"]["swing"]["margins"] == [None, None]
        ),
        margins={"left": None, "right": None},
    )


def test_zones_with_holes_exit_and_signed_distance(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    zones = feed.shown("plan")["zones"]
    assert zones["as_is"] == {
        "rings": 3,
        "points": 120,
        "signed_distance": pytest.approx(3.8),
    }
    assert set(zones) == {"as_is", "any_swing", "any_posture"}
    assert feed.shown("plan")["exit"] is None
    # The hole of the zone is free: RIGHT is at (7, 0), the hole about (8, 1.6).
    box = feed.page.evaluate(
        "() => { const c = document.getElementById('plan'); return [c.width, c.height]; }"
    )
    scale = (box[0] - 4 - 33) / 20
    east, north = 8 - 4, 1.6
    middle = ((33 + box[0] - 4) / 2, (4 + box[1] - 44) / 2)
    feed.page.hover(
        "#plan", position={"x": middle[0] + scale * east, "y": middle[1] - scale * north}
    )
    lines = feed.page.inner_text("#hover")
    assert "inside the zone as is" not in lines
    assert "inside the zone any swing" in lines
    assert "base 3.8 m outside as is zone" in lines
    feed.page.keyboard.press("t")
    feed.send(lambda: "turning" in feed.shown("plan")["zones"])
    feed.base = (5.0, 0.0)
    machines = {"left": machine("LEFT", 5.0), "right": machine("RIGHT", 7.0)}
    feed.send(lambda: feed.shown("plan")["exit"] == pytest.approx(1.2), machines=machines)


def test_the_tip_height_is_asked_for_and_waited_for(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    feed.page.click("#tip-up")
    asked = feed.of("tip_height")
    assert asked[-1]["machine"] == "left"
    assert asked[-1]["height"] == pytest.approx(0.25)
    reach = {"swing": [-math.pi, math.pi], "reach": [0.0, 4.4], "attitude": -1.2, "elbow": 1}
    feed.changes = {"reach": {**reach, "height": 0.25, "picked": True}}
    feed.send(lambda: feed.shown("reach")["picked"] is True)
    feed.page.click("#tip-now")
    assert feed.of("tip_height")[-1]["height"] is None


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_old_images_are_stale_and_never_look_current(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = ExactFeed(browser, *size)
    feed.send(feed.exact_ready)
    feed.images = False
    feed.send(
        lambda: (
            feed.shown("slice-0")["hollow"] is True
            and feed.shown("reach")["hollow"] is True
            and feed.page.get_attribute("#slice-0-panel", "data-age") == "stale"
            and feed.shown("plan")["zone_stale"] is True
        )
    )
    assert "unknown" in feed.page.inner_text("#regions")
    assert float(feed.page.get_attribute("#slice-0", "data-age") or 0) > 1.0
    assert feed.page.evaluate(CLIPPED) == []
    assert feed.page.evaluate(OUTSIDE) == []
    feed.page.screenshot(path=artifacts / f"page-stale-{size[0]}x{size[1]}.png")
    feed.images = True
    feed.send(lambda: feed.shown("slice-0")["hollow"] is False)
    feed.page.close()


def test_without_exact_images_the_page_is_sun_s(browser: Browser) -> None:
    feed = Feed(browser, *SIZES[1])
    feed.send(feed.ready)
    assert feed.shown("slice-0")["kind"] == "projection"
    assert feed.page.is_hidden("#reach-panel .switch")
    assert feed.page.is_hidden("#tip-up")
    feed.page.keyboard.press("x")
    feed.page.mouse.click(200, 200)
    feed.send(lambda: feed.shown("slice-0")["kind"] == "projection")
    assert feed.errors == []
    feed.page.close()
