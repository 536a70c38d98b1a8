"""Driving zones of people and the site on the plan: drawn, named, switched, told when unknown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from exact_frames import layer_zone
from people_frames import PeopleFeed
from playwright.sync_api import Browser
from test_page_exact import CLIPPED, OUTSIDE, SIZES


class ZonesFeed(PeopleFeed):
    """`around`: what is sent of people and the site, by layer."""

    def __init__(self, browser: Browser, width: int = 1366, height: int = 768) -> None:
        self.around: dict[str, dict[str, Any]] = {
            "people": {"centre": (-2.0, 2.5), "radius": 1.4},
            "site": {"centre": (-4.0, -6.0), "radius": 2.0},
        }
        super().__init__(browser, width, height)

    def more(self, at: float) -> list[bytes]:
        return [layer_zone(layer, at, **given) for layer, given in self.around.items()]

    def layers(self) -> dict[str, Any]:
        found: dict[str, Any] = self.shown("plan").get("around") or {}
        return found


@pytest.fixture
def feed(browser: Browser) -> Iterator[ZonesFeed]:
    opened = ZonesFeed(browser)
    yield opened
    assert opened.errors == []
    opened.page.close()


def test_the_nearest_zone_is_named_and_the_way_out_leads_into_no_other(feed: ZonesFeed) -> None:
    feed.send(lambda: [one["reason"] for one in feed.layers().values()] == ["", ""])
    assert set(feed.layers()["people"]["variants"]) == {"as_is", "any_swing"}
    feed.send(lambda: feed.shown("plan")["note"] == "base 1.8 m outside as-is zone: people")
    said = "1.8 m outside as-is zone: people"
    feed.send(lambda: said in (feed.page.get_attribute("#plan", "aria-label") or ""))
    feed.around["site"] = {"centre": (-1.0, -1.0), "radius": 2.0}
    feed.send(lambda: "inside as-is zone: site" in (feed.shown("plan")["note"] or ""))
    feed.send(lambda: feed.shown("plan")["exit"] == pytest.approx(2.0 - 2**0.5, abs=1e-3))
    feed.around["people"] = {"centre": (0.4, 0.4), "radius": 0.5}  # at the end of that way
    feed.send(lambda: feed.shown("plan")["exit"] is None)


def test_people_unknown_are_never_free_ground(feed: ZonesFeed) -> None:
    feed.send(lambda: feed.layers().get("people", {}).get("reason") == "")
    feed.around["people"]["reason"] = "no LiDAR data for 1.2 s"
    feed.send(lambda: "people unknown" in (feed.shown("plan")["note"] or ""))
    assert feed.layers()["people"] == {"reason": "no LiDAR data for 1.2 s", "variants": {}}
    # And before a new zone comes: the page knows that nobody is seen.
    del feed.around["people"]["reason"]
    feed.send(lambda: feed.layers()["people"]["reason"] == "")
    feed.said = {"reason": "no LiDAR data for 0.6 s", "age": 0.6}
    feed.send(lambda: feed.layers()["people"]["reason"] == "no LiDAR data for 0.6 s")
    assert "people unknown" in feed.shown("plan")["note"]


def test_layers_are_switched_together(feed: ZonesFeed) -> None:
    feed.send(lambda: set(feed.layers()) == {"people", "site"})
    feed.page.keyboard.press("z")
    feed.send(lambda: feed.layers() == {})
    assert feed.shown("plan")["note"] is None
    feed.page.keyboard.press("z")
    feed.send(lambda: set(feed.layers()) == {"people", "site"})
    feed.page.keyboard.press("x")
    feed.send(lambda: feed.shown("plan")["shown"] == "sun" and feed.layers() == {})
    feed.page.keyboard.press("x")
    feed.send(lambda: set(feed.layers()) == {"people", "site"})
    assert feed.shown("plan")["shown"] == "difference"


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_nothing_is_clipped(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    feed = ZonesFeed(browser, *size)
    feed.send(lambda: [one["reason"] for one in feed.layers().values()] == ["", ""])
    feed.run(10)
    assert feed.page.evaluate(CLIPPED) == []
    assert feed.page.evaluate(OUTSIDE) == []
    feed.page.screenshot(path=artifacts / f"page-zones-around-{size[0]}x{size[1]}.png")
    feed.page.close()
