"""People on the page alone, with made-up frames: plan, Figs. 12 and 14, words when blind."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from people_frames import PERIOD, PeopleFeed, risk
from PIL import Image
from playwright.sync_api import Browser
from test_page_exact import CLIPPED, OUTSIDE, SIZES
from test_page_offline import machine

ALARM = {
    "level": "STOP",
    "name": "people",
    "machine": "left",
    "line": "STOP · LEFT counterweight ↔ person P7 · 1.1 m",
    "detail": "Swing left blocked. Free: swing right. Wait for P7.",
    "since": 100.0,
    "active": True,
}


@pytest.fixture
def feed(browser: Browser) -> Iterator[PeopleFeed]:
    opened = PeopleFeed(browser)
    yield opened
    assert opened.errors == []
    opened.page.close()


def seen(feed: PeopleFeed) -> dict[str, Any]:
    found: dict[str, Any] = feed.shown("plan").get("people") or {}
    return found


def words(feed: PeopleFeed) -> str:
    return feed.page.get_attribute("#people-words", "title") or ""


def test_a_site_without_lidar_says_nothing_of_people(feed: PeopleFeed) -> None:
    feed.said = None
    feed.send(feed.exact_ready)
    assert feed.shown("plan")["people"] is None
    assert not feed.page.is_visible("#people-words")
    assert not feed.page.is_visible("#people-show")


def test_the_plan_shows_who_is_where_and_who_was_lost(feed: PeopleFeed) -> None:
    feed.send(lambda: bool(seen(feed)))
    assert seen(feed)["tracks"] == [
        ["P7", "confirmed", "EMERGENCY"],
        ["P8", "coasting", "SAFE"],
        ["O9", "confirmed", "SAFE"],
        ["P12", "tentative", "WARNING"],
    ]
    assert seen(feed)["lost"] == ["P3 last seen 12 s ago"]
    feed.send(lambda: words(feed) == "People: 2 seen, 1 object, 1 lost, 0.1 s old")
    assert feed.page.get_attribute("#people-words", "data-level") == "EMERGENCY"
    # O9 does not move: its mark is where the plan's own scale says.
    plan = feed.shown("plan")
    canvas = feed.page.locator("#plan").bounding_box()
    assert canvas is not None
    tick = 13
    left, bottom = round(2.2 * tick), canvas["height"] - round(2.9 * tick)
    width, height = canvas["width"] - 4 - left, bottom - 4
    scale = min(width, height) / plan["width"]
    x = left + width / 2 + scale * (-3.0 - plan["centre"][0])
    y = 4 + height / 2 - scale * (3.0 - plan["centre"][1])
    feed.page.mouse.move(canvas["x"] + x, canvas["y"] + y)
    feed.send(lambda: "O9 object" in feed.page.inner_text("#hover"))
    told = feed.page.inner_text("#hover")
    assert "1.6 × 1.0 × 1.2 m" in told
    assert "SAFE · LEFT bucket 1.1 m" in told
    assert "TTC 5.0 s, x 3.1; in 1 s TTC none, x no braking" in told


def area(reach: float, start: float, end: float) -> dict[str, float]:
    return {"body": 1.1, "reach": reach, "start": start, "end": end}


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_the_plan_shows_working_areas_and_who_is_in_them(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = PeopleFeed(browser, *size)
    known = {
        "reason": "",
        "tail": 1.1,
        "center": [0.0, 0.0],
        "current": area(3.3, 0.35, 0.7),
        "predicted": area(3.9, -0.3, 0.9),
        "maximum": area(4.4, -np.pi, np.pi),
    }
    nothing = dict.fromkeys(("center", "current", "predicted", "maximum"))
    old = {"reason": "position is 0.6 s old", "tail": 1.1, **nothing}
    machines = {
        "left": {**machine("LEFT", 0.0), "working_area": known},
        "right": {**machine("RIGHT", 7.0), "working_area": old},
    }
    one = {"id": 7, "machine": "left", "area": "predicted", "area_ahead": "current"}
    far = {"id": 8, "machine": "left", "area": "none", "area_ahead": "maximum"}
    feed.said = {"inside": [one, far]}
    said = "P7 in LEFT's predicted working area, in 1 s in its working area"
    feed.send(lambda: words(feed).endswith(f"s old; {said}"), machines=machines)
    assert feed.shown("plan")["areas"] == {"left": "", "right": "position is 0.6 s old"}
    feed.page.locator("#plan").screenshot(path=artifacts / f"people-areas-{size[0]}.png")
    assert feed.page.evaluate(CLIPPED) == []
    feed.said = {"inside": [one], "reason": "no LiDAR data for 0.8 s", "age": 0.8}
    feed.send(lambda: "unknown" in words(feed), machines=machines)
    assert "working area" not in words(feed)
    feed.said = None
    feed.send(lambda: feed.shown("plan")["areas"] is None, machines=machines)
    assert feed.errors == []
    feed.page.close()


def test_time_and_plane_show_what_the_snapshot_says(feed: PeopleFeed) -> None:
    feed.send(feed.exact_ready)
    feed.page.click("#people-show")
    feed.run(75)
    shown = feed.shown("trends")
    assert (shown["kind"], shown["own"]) == ("people", "left")
    assert feed.page.inner_text("#trends-title") == "People"
    first = shown["tracks"][0]
    assert first["code"] == "P7"
    assert first["ahead"][0] - first["place"][0] == pytest.approx(-0.6)
    # Ten a second at most, over as long as it has been followed.
    assert 0.6 * feed.cycle * PERIOD * 10 < first["points"] < 1.1 * feed.cycle * PERIOD * 10
    plane = {one["code"]: one for one in shown["plane"]}
    assert (plane["P7"]["now"], plane["P7"]["later"]) == ("WARNING", "EMERGENCY")
    assert (plane["P8"]["ttc"], plane["P8"]["index"]) == (None, None)  # infinite
    assert plane["P8"]["now"] == "SAFE"
    # Beyond the axes' ends nothing is left out.
    feed.said = {"level": "SAFE"}
    feed.send(lambda: any(one["index"] == -1000 for one in feed.shown("trends")["plane"]))
    feed.page.click("#people-show")
    feed.send(lambda: "clearance" in feed.shown("trends"))
    assert feed.page.inner_text("#trends-title") == "Last 60 s"


def test_the_plane_is_of_the_chosen_machine(feed: PeopleFeed) -> None:
    feed.send(feed.exact_ready)
    feed.page.click("#people-show")
    feed.said = {"risks": [{**risk(7, "WARNING", (2.0, 1.5), (1.5, 1.2)), "machine": "right"}]}
    feed.send(lambda: feed.shown("trends").get("plane") == [])
    feed.page.keyboard.press("2")
    feed.send(lambda: [one["code"] for one in feed.shown("trends")["plane"]] == ["P7"])
    # On the plan a level is that against any machine.
    assert ["P7", "confirmed", "WARNING"] in seen(feed)["tracks"]


def test_without_data_nobody_is_shown_as_known(feed: PeopleFeed) -> None:
    feed.send(lambda: bool(seen(feed)))
    feed.page.click("#people-show")
    why = "no LiDAR data for 0.8 s"
    feed.said = {"reason": why, "age": 0.8}
    feed.send(lambda: seen(feed)["unknown"] == why and feed.shown("trends").get("unknown") == why)
    assert seen(feed)["tracks"][0] == ["P7", "confirmed", ""]
    assert seen(feed)["lost"]
    assert feed.shown("trends")["plane"] == []
    assert words(feed) == f"People: unknown, {why}"
    assert feed.level() == "UNKNOWN"  # even before the backend raises an alarm
    # Its digits change twice a second at most.
    feed.send(lambda: why in feed.page.inner_text("#alarm-detail"))
    assert feed.page.get_attribute("#people-words", "data-level") == "UNKNOWN"
    feed.said = {"age": None}  # before the first scan
    feed.send(lambda: seen(feed)["unknown"] == "no LiDAR data yet")


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_nothing_is_clipped_and_the_levels_are_told_apart(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = PeopleFeed(browser, *size)
    feed.send(feed.exact_ready)
    feed.page.click("#people-show")
    alarm = {"alarms": [ALARM]}
    feed.send(lambda: feed.level() == "STOP" and feed.cycle > 60, **alarm)
    assert feed.page.inner_text("#alarm-line") == ALARM["line"]
    name = f"people-{size[0]}x{size[1]}"
    feed.page.screenshot(path=artifacts / f"{name}.png")
    for check in (CLIPPED, OUTSIDE):
        assert feed.page.evaluate(check) == []
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
    picture = Image.open(io.BytesIO(feed.page.locator("#trends").screenshot())).convert("RGB")
    pixels = np.asarray(picture).astype(float)
    warm = np.flatnonzero((pixels[..., 0] - pixels[..., 2]).mean(axis=0) > 0.0)
    assert 0.25 < len(warm) / pixels.shape[1] < 0.42  # the plane's regions, and nothing else
    assert warm.min() > 0.55 * pixels.shape[1]
    feed.said = {"reason": "no LiDAR data for 0.8 s", "age": 0.8}
    feed.send(lambda: bool(feed.shown("trends").get("unknown")))
    feed.page.screenshot(path=artifacts / f"{name}-unknown.png")
    for check in (CLIPPED, OUTSIDE):
        assert feed.page.evaluate(check) == []
    assert feed.errors == []
    feed.page.close()
