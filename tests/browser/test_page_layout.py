"""The page's layouts: operating and analysis, each whole at both sizes, and remembered."""

from __future__ import annotations

from pathlib import Path

import pytest
from driving_frames import DriveFeed
from playwright.sync_api import Browser
from test_page_exact import CLIPPED, OUTSIDE, ExactFeed

SIZES = [(1920, 1080), (1366, 768)]


def area(feed: ExactFeed, name: str) -> float:
    box = feed.page.locator(f"#{name}").bounding_box()
    assert box is not None
    return box["width"] * box["height"]


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
@pytest.mark.parametrize("kind", [ExactFeed, DriveFeed])
def test_the_analysis_layout_has_large_images_and_is_remembered(
    browser: Browser, size: tuple[int, int], kind: type[ExactFeed], artifacts: Path
) -> None:
    feed = kind(browser, *size)
    feed.send(feed.exact_ready)
    before = {name: area(feed, name) for name in ("scene", "slice-0", "plan")}
    feed.page.keyboard.press("v")
    feed.send(lambda: area(feed, "slice-0") > 1.2 * before["slice-0"])
    assert area(feed, "plan") > 1.0 * before["plan"]
    assert area(feed, "scene") < before["scene"]
    assert area(feed, "scene") > 0.3 * area(feed, "plan")  # still to be seen
    # Drawn anew at that size, nothing clipped, nothing scrolls.
    feed.send(feed.exact_ready)
    assert feed.page.evaluate(CLIPPED) == []
    assert feed.page.evaluate(OUTSIDE) == []
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
    name = "driving" if kind is DriveFeed else "monitoring"
    feed.page.screenshot(path=artifacts / f"analysis-{name}-{size[0]}x{size[1]}.png")
    feed.page.reload()
    feed.send(feed.exact_ready)
    assert feed.page.get_attribute("body", "data-layout") == "analyse"
    feed.page.click("#layout")
    feed.send(lambda: abs(area(feed, "scene") - before["scene"]) < 1.0)
    assert feed.errors == []
    feed.page.close()
