"""The legend of the stages of detection: off by default, counted, one alone, old scans told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from people_frames import PeopleFeed
from playwright.sync_api import Browser, Route
from test_page_exact import CLIPPED, OUTSIDE, SIZES

from backend.documents.stages import StagesDocument
from cockpit.views.stage_nodes import SHOWN

TOLD: dict[str, Any] = {
    "reason": "",
    "age": 0.24,
    "points": 30112,
    "drawn": 8000,
    "counts": {"outside": 4512, "machine": 4100, "ground": 21000, "object": 480, "left": 20},
    "objects": 3,
    "slope": 0.021,
}
NONE = dict.fromkeys(("points", "drawn", "counts", "objects", "slope"))


class Stages(PeopleFeed):
    """Answers /api/stages with `answer`, and counts the questions."""

    def __init__(self, browser: Browser, size: tuple[int, int]) -> None:
        self.answer, self.questions = TOLD, 0
        super().__init__(browser, *size)
        self.page.route("**/api/stages", self.reply)

    def reply(self, route: Route) -> None:
        self.questions += 1
        StagesDocument.model_validate(self.answer)
        route.fulfill(content_type="application/json", body=json.dumps(self.answer))

    def words(self) -> str:
        return self.page.inner_text("#stages-words")

    def count(self, name: str) -> str:
        return self.page.inner_text(f'[data-count="{name}"]')

    def asked(self) -> list[str] | None:
        """What the page last said it shows."""
        found = self.of("stages")
        return found[-1]["shown"] if found else None


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_stages_are_switched_counted_and_told_when_old(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = Stages(browser, size)
    feed.send(lambda: feed.page.is_visible("#stages-show"))
    feed.run(40)
    assert (feed.questions, feed.asked()) == (0, None)  # nobody looks
    assert not feed.page.is_visible("#stages")
    feed.page.click("#stages-show")
    feed.send(lambda: feed.words().startswith("30\u202f112 points, 8\u202f000 drawn, 0.2 s old"))
    assert feed.asked() == list(SHOWN)
    assert feed.of("stages")[-1]["page"]
    rows = {name: feed.count(name) for name in SHOWN}
    assert (rows["ground"], rows["machine"], rows["left"]) == ("21\u202f000", "4\u202f100", "20")
    assert (rows["plane"], rows["boxes"]) == ("1.2° steep", "3")
    for _ in range(3):  # every layout, and the first again
        layout = feed.page.evaluate("document.body.dataset.layout")
        feed.page.screenshot(path=artifacts / f"stages-{layout}-{size[0]}x{size[1]}.png")
        for check in (CLIPPED, OUTSIDE):
            assert feed.page.evaluate(check) == [], layout
        legend = feed.page.locator("#stages")
        assert legend.evaluate("s => s.scrollHeight <= s.clientHeight"), layout
        feed.page.keyboard.press("v")
        feed.run(15)
    feed.page.uncheck('[data-stage="outside"]')
    assert feed.asked() == [name for name in SHOWN if name != "outside"]
    feed.page.click('[data-only="object"]')
    assert feed.asked() == ["object"]
    assert not feed.page.is_checked('[data-stage="ground"]')
    feed.page.click('[data-only="object"]')
    assert feed.asked() == list(SHOWN)
    before = len(feed.of("stages"))
    feed.run(60)
    assert len(feed.of("stages")) > before  # it asks again while it looks

    feed.answer = {**NONE, "reason": "no scan for 1.3 s", "age": 1.3}
    feed.send(lambda: feed.words() == "No scan for 1.3 s")
    assert {feed.count(name) for name in SHOWN} == {"—"}
    feed.page.click("#stages-close")
    assert feed.asked() == []
    count = feed.questions
    feed.run(40)
    assert feed.questions == count
    assert not feed.page.is_visible("#stages")

    feed.page.click("#stages-show")
    feed.said = None  # another site, without LiDARs
    feed.send(lambda: not feed.page.is_visible("#stages-tools"))
    assert not feed.page.is_visible("#stages")
    assert feed.asked() == []
    assert feed.errors == []
    feed.page.close()
