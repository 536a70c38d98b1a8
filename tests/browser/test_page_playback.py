"""Playback of a recorded session on the page alone, with a made-up player."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from exact_frames import exact, margins, zone
from playback_frames import DURATION, EVENTS, NOTE, PERIOD, Player
from playwright.sync_api import Browser, Route, WebSocketRoute
from test_page_exact import CLIPPED, OUTSIDE, ExactFeed
from test_page_offline import machine, site, snapshot, sun

SIZES = [(1920, 1080), (1366, 768), (1366, 700)]
LOW = {
    "level": "SLOW",
    "name": "partner",
    "machine": "left",
    "line": "SLOW · LEFT bucket ↔ RIGHT boom · 0.62 m",
    "detail": "Swing left limited to 40 %. Free: swing right.",
    "since": 100.0,
    "active": True,
}


PROBLEM = "/right/fix: 12 messages could not be decoded"


def scene(route: Route) -> None:
    """As dark as the real one."""
    body = "<!doctype html><body bgcolor='#39434b'><title>scene</title>"
    route.fulfill(body=body, content_type="text/html")


class PlaybackFeed(ExactFeed):
    """The player's frames: the time of the snapshot is the cursor's, paused ones come again."""

    def __init__(
        self, browser: Browser, width: int, height: int, problems: list[str] | None = None
    ) -> None:
        self.player = Player(problems)
        super().__init__(browser, width, height)

    def more_routes(self) -> None:
        self.page.route("**/view/**", scene)
        self.page.route("**/api/session", self.player.answer)
        self.page.route("**/api/session/**", self.player.answer)

    def accept(self, socket: WebSocketRoute) -> None:
        self.socket = socket
        socket.on_message(self.hear)
        socket.send(site())

    def hear(self, text: str | bytes) -> None:
        message = json.loads(text)
        self.sent.append(message)
        self.player.on_message(message)

    def send(self, until: Callable[[], bool], **changes: Any) -> None:
        end = time.monotonic() + 20
        last = time.monotonic()
        while time.monotonic() < end:
            self.cycle += 1
            assert self.socket is not None
            self.player.advance(time.monotonic() - last)
            last = time.monotonic()
            now = 1000.0 + self.player.time
            frame = {
                "mode": "PLAYBACK",
                "time": now,
                "state_time": now - 0.05,
                "playback": self.player.document(),
                "margins": margins(),
                **changes,
            }
            self.socket.send(snapshot(self.cycle, **frame))
            if self.images and self.cycle % 3 == 0:
                self.socket.send(sun(self.cycle))
                self.socket.send(exact(now - 0.1))
                self.socket.send(zone(now - 0.1))
            self.page.wait_for_timeout(40)
            if self.cycle % 3 == 0 and until():
                return
        pytest.fail(f"the page did not get there: {self.track()}, {self.said()[-5:]}")

    def track(self) -> dict[str, Any]:
        return self.shown("timeline")

    def said(self, do: str | None = None) -> list[dict[str, Any]]:
        return [m for m in self.of("playback") if do is None or m["do"] == do]

    def playing(self) -> bool:
        return self.track().get("duration") == DURATION and self.exact_ready()

    def ready_to_play(self) -> bool:
        """Events are there and the series are drawn."""
        series = self.shown("trends")
        return (
            self.playing() and self.track()["events"] == len(EVENTS) and bool(series.get("points"))
        )

    def x_of(self, seconds: float) -> tuple[float, float]:
        """Page coordinates of a time on the timeline."""
        box = self.page.locator("#timeline").bounding_box()
        assert box is not None
        share = seconds / DURATION
        return box["x"] + 12 + share * (box["width"] - 24), box["y"] + 0.6 * box["height"]

    def drag(self, start: float, end: float, steps: int = 12) -> None:
        self.page.mouse.move(*self.x_of(start))
        self.page.mouse.down()
        for k in range(1, steps + 1):
            self.page.mouse.move(*self.x_of(start + (end - start) * k / steps))


@pytest.fixture
def feed(browser: Browser) -> Iterator[PlaybackFeed]:
    opened = PlaybackFeed(browser, 1920, 1080)
    opened.send(opened.ready_to_play)
    yield opened
    assert opened.errors == []
    opened.page.close()


def whole(feed: PlaybackFeed, size: tuple[int, int]) -> None:
    """Nothing is clipped and nothing scrolls."""
    assert feed.page.evaluate(CLIPPED) == []
    assert feed.page.evaluate(OUTSIDE) == []
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_playback_fits_and_says_so(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = PlaybackFeed(browser, *size, [PROBLEM])
    low = size[1] < 740  # no room for trends
    feed.send(feed.playing if low else feed.ready_to_play)
    assert feed.page.inner_text("#mode") == "PLAYBACK"
    assert feed.page.is_visible("#watermark")
    assert "as it was" in feed.page.inner_text("#watermark-what")
    assert feed.page.inner_text("#watermark-note") == NOTE
    assert feed.shown("plan")["playback"] is True
    assert feed.page.inner_text("#stop-place").endswith("not a safety-rated stop")
    assert feed.page.is_hidden("#rec")
    assert feed.page.get_attribute("body", "data-sound") == "off"
    for name in ("t-play", "t-loop", "t-report", "t-session", "timeline"):
        assert feed.page.is_visible(f"#{name}")
    assert feed.page.is_visible("#trends") is not low
    whole(feed, size)
    where = f"playback-{size[0]}x{size[1]}"
    feed.page.screenshot(path=artifacts / f"{where}.png")
    feed.player.time = 246.0
    feed.player.loop = [230.0, 262.0]
    feed.page.keyboard.press("Space")
    feed.page.click("#t-session")
    stop = {**LOW, "level": "STOP", "line": "STOP · LEFT bucket ↔ RIGHT boom · 0.08 m"}
    feed.send(
        lambda: feed.level() == "STOP" and feed.page.is_visible("#sheet-session"), alarms=[stop]
    )
    assert PROBLEM in feed.page.inner_text("#sheet-session")
    assert feed.page.inner_text("#t-session") == "▲ 1 problem"
    assert feed.page.is_hidden("#demo-card")
    assert feed.page.is_hidden("#callout")
    assert "paused" in feed.page.inner_text("#watermark-what")
    whole(feed, size)
    feed.page.screenshot(path=artifacts / f"{where}-stop.png")
    feed.page.click("#t-session")
    feed.page.keyboard.press("?")
    feed.send(lambda: feed.page.is_hidden("#sheet-session") and feed.page.is_visible("#help"))
    assert feed.page.is_visible("#help-playback")
    if not low:
        assert feed.page.evaluate(OUTSIDE) == []
        panel, line = (feed.page.locator(name).bounding_box() for name in ("#help", "#alarm"))
        assert panel is not None
        assert line is not None
        assert panel["y"] + panel["height"] <= line["y"]  # the alarm line stays in sight
        assert feed.page.evaluate("document.getElementById('help').scrollHeight") <= (
            feed.page.evaluate("document.getElementById('help').clientHeight")
        )
    feed.page.screenshot(path=artifacts / f"{where}-help.png")
    assert feed.errors == []
    feed.page.close()


def test_dragging_the_timeline_seeks_and_shows_the_target(feed: PlaybackFeed) -> None:
    feed.sent.clear()
    begun = time.monotonic()
    feed.drag(200, 500, steps=50)
    feed.wait(lambda: feed.track()["dragging"])
    feed.wait(lambda: feed.page.inner_text("#t-time").startswith(("→ 8:19", "→ 8:20")))
    assert feed.page.inner_text("#hover").startswith(("8:19", "8:20"))
    seeks = feed.said("seek")
    assert 1 <= len(seeks) <= 10 * (time.monotonic() - begun) + 2  # not one for every pixel
    assert feed.track()["time"] == pytest.approx(500, abs=1)
    feed.page.mouse.up()
    feed.send(lambda: not feed.track()["seeking"])
    assert feed.said("seek")[-1]["value"] == pytest.approx(500, abs=1)
    assert feed.track()["time"] == pytest.approx(feed.player.time, abs=1)
    # A click beside an event's mark goes to its beginning.
    feed.page.mouse.click(*feed.x_of(241.2))
    feed.send(lambda: feed.said("seek")[-1]["value"] == 240.0)
    assert {m["type"] for m in feed.sent} <= {"ack", "ghost", "playback"}


def test_keys_play_step_and_jump(feed: PlaybackFeed) -> None:
    def press(key: str, do: str, value: float | None = None) -> None:
        feed.sent.clear()
        feed.page.keyboard.press(key)
        feed.send(lambda: bool(feed.said()))
        said = feed.said()[-1]
        assert said["do"] == do, key
        if value is not None:
            assert said["value"] == pytest.approx(value, abs=0.6), key

    press("Space", "pause")
    assert feed.player.playing is False
    feed.send(lambda: feed.page.get_attribute("#t-play", "data-playing") == "0")
    feed.player.time = 100.0
    feed.send(lambda: feed.track()["time"] == 100.0)
    press("ArrowRight", "step")
    assert feed.player.time == pytest.approx(100.0 + PERIOD)
    press("ArrowLeft", "back")
    feed.send(lambda: feed.track()["time"] == pytest.approx(100.0))
    press("Shift+ArrowRight", "seek", 105.0)
    feed.send(lambda: feed.track()["time"] == 105.0)
    press("Shift+ArrowLeft", "seek", 100.0)
    press("]", "next")
    assert feed.player.time == 120.0
    press("PageDown", "next")
    press("[", "previous")
    press("PageUp", "previous")
    press("End", "seek", DURATION)
    press("Home", "seek", 0.0)
    press("+", "speed", 2.0)
    press("-", "speed", 1.0)
    press("Space", "play")
    # A click leaves the keys with the player; the keyboard's focus keeps Space for the button.
    feed.page.click("#t-loop")
    press("Space", "pause")
    feed.page.focus("#t-next")
    press("Space", "next")
    assert feed.errors == []


def test_buttons_play_step_and_change_speed(feed: PlaybackFeed) -> None:
    for button, do in (
        ("t-play", "pause"),
        ("t-step", "step"),
        ("t-back", "back"),
        ("t-next", "next"),
        ("t-previous", "previous"),
    ):
        feed.page.click(f"#{button}")
        feed.send(lambda do=do: bool(feed.said()) and feed.said()[-1]["do"] == do)
    for _ in range(7):  # clicks that are quicker than the player
        feed.page.click("#t-faster", force=True)
    feed.send(lambda: feed.player.speed == 50 and feed.page.is_disabled("#t-faster"))
    assert feed.page.inner_text("#t-speed") == "50×"
    for _ in range(9):
        feed.page.click("#t-slower", force=True)
    feed.send(lambda: feed.player.speed == 0.1 and feed.page.is_disabled("#t-slower"))
    assert feed.page.inner_text("#t-speed") == "0.1×"
    feed.page.click("#t-speed")
    feed.send(lambda: feed.player.speed == 1)


def test_a_section_is_looped_by_shift_handles_and_key(feed: PlaybackFeed) -> None:
    feed.page.keyboard.down("Shift")
    feed.drag(230, 270)
    feed.page.keyboard.up("Shift")
    feed.page.mouse.up()
    feed.send(lambda: feed.player.loop == pytest.approx([230, 270], abs=1))
    assert feed.said("seek") == []
    feed.send(lambda: feed.page.get_attribute("#t-loop", "aria-pressed") == "true")
    assert feed.track()["loop"] == pytest.approx([230, 270], abs=1)
    feed.drag(270, 300)  # its right handle
    feed.page.mouse.up()
    feed.send(lambda: feed.player.loop == pytest.approx([230, 300], abs=1))
    feed.page.keyboard.press("l")
    feed.send(lambda: feed.player.loop is None and feed.track()["loop"] is None)
    feed.page.keyboard.press("l")
    feed.send(lambda: feed.player.loop == pytest.approx([230, 300], abs=1))
    assert feed.said("seek") == []


def test_events_are_marked_and_named(feed: PlaybackFeed) -> None:
    assert feed.track()["kinds"] == {
        "alarm": 3,
        "note": 1,
        "near miss": 1,
        "pin": 1,
        "action": 1,
        "gap": 1,
    }
    for at, words in (
        (45, "note: bucket teeth changed"),
        (124, "SLOW · LEFT bucket"),
        (247, "NEAR MISS"),
        (390, "nothing was recorded"),
        (460, "UNKNOWN"),
    ):
        feed.page.mouse.move(*feed.x_of(at))
        feed.send(lambda words=words: words in feed.page.inner_text("#hover"))
    feed.page.mouse.move(*feed.x_of(200))
    feed.send(lambda: feed.page.inner_text("#hover").startswith("3:20"))
    assert len(feed.page.inner_text("#hover").splitlines()) == 1


def test_the_source_is_switched_and_said(feed: PlaybackFeed) -> None:
    feed.page.click("#t-sources [data-source=evaluated]")
    feed.send(
        lambda: (
            feed.player.source == "evaluated"
            and "judged now" in feed.page.inner_text("#watermark-what")
            and feed.shown("trends").get("sources") == ["evaluated"]
        )
    )
    feed.player.changes = {"sources": ["recorded"], "source": "recorded"}
    feed.send(lambda: feed.page.is_disabled("#t-sources [data-source=evaluated]"))
    assert feed.page.is_disabled("#t-compare")


def test_series_follow_the_cursor_and_seek(feed: PlaybackFeed, artifacts: Path) -> None:
    shown = feed.shown("trends")
    assert shown["kind"] == "session"
    assert shown["points"] == 600
    assert shown["window"] == [0, DURATION]
    assert shown["least"] == pytest.approx(0.08, abs=0.05)
    assert set(shown["levels"]) == {"CLEAR", "SLOW", "STOP", "UNKNOWN"}
    feed.send(
        lambda: feed.shown("trends").get("cursor") == pytest.approx(feed.player.time, abs=0.7)
    )
    feed.page.mouse.click(*feed.at("trends", 0.3, 0.5))
    feed.send(lambda: bool(feed.said("seek")))
    aimed = feed.said("seek")[-1]["value"]
    assert 300 < aimed < 400
    feed.send(lambda: feed.track()["time"] == pytest.approx(feed.player.time, abs=0.7))
    feed.page.mouse.move(*feed.at("trends", 0.21, 0.5))
    feed.send(lambda: "as it was: " in feed.page.inner_text("#hover"))
    assert " m, LEFT " in feed.page.inner_text("#hover")
    feed.page.click("#trends-what")
    feed.send(lambda: feed.shown("trends").get("right") == "angles")
    feed.page.mouse.move(*feed.at("trends", 0.75, 0.5))
    feed.send(lambda: "boom" in feed.page.inner_text("#hover"))
    feed.page.screenshot(path=artifacts / "playback-angles-1920x1080.png")
    feed.page.click("#trends-span")  # a minute around the cursor
    feed.send(lambda: feed.shown("trends")["window"][1] - feed.shown("trends")["window"][0] == 60)
    start, end = feed.shown("trends")["window"]
    assert start <= feed.player.time <= end
    asked = [path for method, path in feed.player.asked if "start=" in path]
    assert f"start={start:.3f}&end={end:.3f}&points=600&source=recorded" in asked[-1]
    feed.player.time = end + 5  # leaves the window: it pages on
    feed.send(lambda: feed.shown("trends")["window"][0] > start)
    feed.page.mouse.move(*feed.at("trends", 0.2, 0.5))
    feed.page.mouse.wheel(0, 100)
    feed.send(lambda: feed.shown("trends")["window"][1] - feed.shown("trends")["window"][0] > 70)


def test_comparing_shows_progress_then_a_table_that_jumps(
    feed: PlaybackFeed, artifacts: Path
) -> None:
    assert feed.shown("trends").get("sources") == ["recorded"]
    feed.page.click("#t-compare")
    feed.page.click("#diff-start")
    sheet = feed.page.locator("#sheet-compare")
    feed.send(lambda: "40 %" in sheet.inner_text())
    feed.send(lambda: "Levels agree 99.8 %" in sheet.inner_text())
    assert ("POST", "/diff") in feed.player.asked
    text = sheet.inner_text()
    for words in ("LEFT ↔ RIGHT", "42 mm", "4:06.3", "1.4 s earlier", "never", "1 stretch"):
        assert words in text, words
    feed.send(lambda: feed.shown("trends").get("sources") == ["recorded", "evaluated"])
    feed.page.screenshot(path=artifacts / "playback-compare-1920x1080.png")
    whole(feed, (1920, 1080))
    feed.page.click("#sheet-compare td button >> text=1:58.6")
    feed.send(lambda: bool(feed.said("seek")))
    assert feed.said("seek")[-1]["value"] == pytest.approx(118.6)
    feed.page.keyboard.press("Escape")
    feed.send(lambda: sheet.is_hidden())


def test_a_comparison_that_fails_says_why(feed: PlaybackFeed) -> None:
    feed.player.files["/diff"] = (409, "the site file has changed")
    feed.page.click("#t-compare")
    feed.page.click("#diff-start")
    sheet = feed.page.locator("#sheet-compare")
    feed.send(lambda: "the site file has changed" in sheet.inner_text())
    feed.errors[:] = [e for e in feed.errors if "409" not in e]


def test_report_and_export_are_saved_or_say_why_not(feed: PlaybackFeed) -> None:
    feed.player.files["/report"] = (200, "<!doctype html><title>report</title>")
    with feed.page.expect_download() as saved:
        feed.page.click("#t-report")
    assert saved.value.suggested_filename == "trench.html"
    assert Path(saved.value.path()).read_text() == feed.player.files["/report"][1]
    status = feed.page.locator("#t-status")
    feed.send(lambda: status.inner_text() == "saved trench.html")
    feed.player.files["/export"] = (507, "no room on the disk")
    feed.page.click("#t-export")
    feed.page.click("#sheet-export [data-format=parquet]")
    feed.send(lambda: status.inner_text() == "export Parquet failed: no room on the disk")
    assert ("POST", "/export?format=parquet") in feed.player.asked
    whole(feed, (1920, 1080))
    feed.errors[:] = [e for e in feed.errors if "507" not in e]


def test_an_unfinished_index_and_a_slow_player_are_told(browser: Browser) -> None:
    feed = PlaybackFeed(browser, 1366, 768)
    feed.player.session.update(index={"state": "building", "progress": 0.37}, events=EVENTS[:2])
    status = feed.page.locator("#t-status")
    feed.send(lambda: status.inner_text() == "indexing 37 %" and feed.track()["events"] == 2)
    whole(feed, (1366, 768))
    feed.player.session.update(index={"state": "ready", "progress": 1.0}, events=EVENTS)
    feed.send(lambda: status.inner_text() == "" and feed.track()["events"] == len(EVENTS))
    feed.player.changes = {"catching_up": True}
    feed.send(lambda: status.inner_text().startswith("catching up"))
    feed.player.changes = {}
    assert feed.errors == []
    feed.page.close()


def test_paused_data_grow_no_older_and_silence_is_a_lost_link(feed: PlaybackFeed) -> None:
    feed.page.keyboard.press("Space")
    feed.send(lambda: feed.page.get_attribute("#t-play", "data-playing") == "0")
    begun = time.monotonic()
    ages: list[float] = []

    def look() -> bool:
        feed.page.wait_for_timeout(250)  # frames come again four times a second
        ages.append(feed.page.evaluate("cockpit.ages.snapshot"))
        return time.monotonic() - begun > 3

    feed.send(look)
    assert ages == pytest.approx([0.05] * len(ages), abs=0.001)
    assert feed.level() == "CLEAR"
    feed.page.wait_for_selector('body[data-link="lost"]')
    assert "player does not answer" in feed.page.inner_text("#alarm-detail")
    feed.send(lambda: feed.level() == "CLEAR")


def test_a_jump_back_forgets_what_is_yet_to_come(feed: PlaybackFeed) -> None:
    feed.send(lambda: feed.page.evaluate("cockpit.state.history.length") > 3)
    feed.images = False
    feed.player.playing = False
    feed.player.time -= 40
    feed.send(
        lambda: (
            feed.page.evaluate("cockpit.state.history.length") == 1
            and feed.shown("slice-0")["hollow"] is True  # a picture of 40 s later
        )
    )
    feed.images = True
    feed.send(lambda: feed.shown("slice-0")["hollow"] is False)


def test_ages_of_recorded_streams_are_as_recorded(feed: PlaybackFeed) -> None:
    machines = {"left": machine("LEFT", 0.0), "right": machine("RIGHT", 7.0, age=0.6)}
    feed.send(
        lambda: (
            "STALE" in feed.page.inner_text("#machines")
            and "0.60 s" in feed.page.inner_text("#machines")
        ),
        machines=machines,
    )


def test_sound_that_was_on_is_off_in_playback(feed: PlaybackFeed) -> None:
    said = feed.page.locator("#sound")
    feed.send(lambda: feed.page.inner_text("#mode") == "LIVE", mode="LIVE")
    assert feed.page.is_hidden("#transport")
    assert feed.page.is_hidden("#watermark")
    feed.page.keyboard.press("m")
    feed.send(lambda: "SOUND ON" in said.inner_text(), mode="LIVE")
    feed.send(lambda: "SOUND OFF" in said.inner_text() and "in playback" in said.inner_text())
    assert feed.page.get_attribute("body", "data-sound") == "off"


def test_no_key_or_click_reaches_anything_but_the_player(feed: PlaybackFeed) -> None:
    feed.sent.clear()
    for key in "abcdefghijklmnopqrstuvwxyz0123456789":
        feed.page.keyboard.press(key)
    feed.page.keyboard.press("Escape")
    for canvas in ("plan", "limits", "timeline", "trends"):
        feed.page.mouse.click(*feed.at(canvas, 0.4, 0.6))
    feed.send(lambda: bool(feed.said("seek")))
    assert {m["type"] for m in feed.sent} <= {"ack", "own", "ghost", "playback"}
