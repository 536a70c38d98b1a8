"""Tipping over on the page alone, with made-up frames: meter, polygon and ZMP on the plan."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser
from test_page_exact import SIZES, ExactFeed
from test_page_offline import FREE

TIP_OVER = (0x79, 0xE0, 0xB6)


def stability(**changes: Any) -> dict[str, Any]:
    return {
        "reason": "",
        "payload": 150.0,
        "percent": 62.4,
        "share": 0.624,
        "margin": 0.39,
        "sigma": 0.02,
        "edge": "front-left",
        "zmp": [0.25, 0.2],
        "polygon": [[0.8, -0.625], [0.8, 0.625], [-0.8, 0.625], [-0.8, -0.625]],
        "edges": ["front", "left", "rear", "right"],
        "critical_lift": None,
        "critical_swing": 2.1,
        "holds": [None, *np.linspace(2.0, 4.0, 35).round(3).tolist()],
        **changes,
    }


def concern(level: str) -> dict[str, Any]:
    reason = "LEFT tips over front-left · margin 12 %"
    told = {"name": "tip-over", "machine": "left", "level": level, "reason": reason}
    return {**told, "allowed": FREE, "travel": [1, 1]}


@pytest.fixture
def feed(browser: Browser) -> Iterator[ExactFeed]:
    opened = ExactFeed(browser, 1920, 1080)
    yield opened
    assert opened.errors == []
    opened.page.close()


def shown(feed: ExactFeed) -> dict[str, Any]:
    found: dict[str, Any] = feed.shown("plan").get("stability") or {}
    return found


def label(feed: ExactFeed) -> str:
    return feed.page.get_attribute("#plan", "aria-label") or ""


def picture(feed: ExactFeed) -> np.ndarray:
    png = feed.page.locator("#plan").screenshot()
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def test_the_meter_says_how_firmly_the_own_machine_stands(feed: ExactFeed) -> None:
    feed.send(feed.exact_ready)
    assert feed.shown("plan")["stability"] is None
    green = (np.abs(picture(feed) - TIP_OVER).max(axis=2) < 12).sum()
    firm = {"left": stability(), "right": stability(reason="the masses of mini are not trusted")}
    feed.send(lambda: bool(shown(feed)), stability=firm)
    assert shown(feed)["percent"] == 62
    assert shown(feed)["level"] == "CLEAR"
    assert shown(feed)["holds"] == 35
    assert "62 %" in shown(feed)["words"]
    feed.send(lambda: "LEFT stands · margin 62 %" in label(feed), stability=firm)
    assert (np.abs(picture(feed) - TIP_OVER).max(axis=2) < 12).sum() > green + 100

    near = {"left": stability(percent=12.8, share=0.128, zmp=[0.7, 0.5])}
    slow = {"stability": near, "concerns": [concern("SLOW")]}
    feed.send(lambda: shown(feed).get("level") == "SLOW", **slow)
    assert shown(feed)["words"].startswith("▲ ")
    assert "front-left" in shown(feed)["words"]
    assert shown(feed)["percent"] == 12

    unknown = {"left": stability(reason="the slope is not measured", zmp=None, polygon=None)}
    feed.send(lambda: shown(feed).get("level") == "UNKNOWN", stability=unknown)
    assert shown(feed)["percent"] is None
    assert shown(feed)["words"].startswith("? ")
    said = "tip-over unknown: the slope is not measured"
    feed.send(lambda: said in label(feed), stability=unknown)


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_screenshots_of_the_meter(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    opened = ExactFeed(browser, *size)
    near = {"left": stability(percent=12.8, zmp=[0.7, 0.5]), "right": stability()}
    told = {"stability": near, "concerns": [concern("SLOW")]}
    opened.send(lambda: opened.exact_ready() and bool(shown(opened)), **told)
    assert "12 %" in shown(opened)["words"]
    opened.page.screenshot(path=artifacts / f"page-stability-{size[0]}x{size[1]}.png")
    assert opened.errors == []
    opened.page.close()
