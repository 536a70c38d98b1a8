"""The recorder's indicator and notices on the live page alone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Route
from test_page_exact import CLIPPED, OUTSIDE
from test_page_offline import Feed
from test_page_playback import LOW

SIZES = [(1920, 1080), (1366, 768)]
ON = {"state": "on", "text": "Everything is recorded."}
TROUBLE = {"state": "trouble", "text": "Disk full: not recorded since 14:02."}
NOTICE = {
    "key": "recording",
    "line": "RECORDING · disk full: not recorded since 14:02",
    "since": 100.0,
}
CALM = "CLEAR · LEFT bucket ↔ RIGHT boom · 3.4 m"


@pytest.fixture
def feed(browser: Browser) -> Iterator[Feed]:
    opened = Feed(browser, 1366, 768)
    opened.send(opened.ready)
    yield opened
    opened.page.close()


def answer(feed: Feed, path: str, document: dict[str, Any], status: int = 200) -> list[Any]:
    asked: list[Any] = []

    def reply(route: Route) -> None:
        asked.append(json.loads(route.request.post_data or "null"))
        body = "" if status == 204 else json.dumps(document)
        route.fulfill(status=status, body=body, content_type="application/json")

    feed.page.route(f"**/api/recording{path}", reply)
    return asked


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_the_recorder_s_state_is_told_in_words(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = Feed(browser, *size)
    rec = feed.page.locator("#rec")
    feed.send(feed.ready)
    assert rec.is_hidden()  # this server says nothing of it
    for document, words in (
        (ON, "● REC"),
        ({"state": "off", "text": ""}, "not recorded"),
        (TROUBLE, "✕ REC"),
    ):
        feed.send(
            lambda words=words: rec.is_visible() and words in rec.inner_text(), recording=document
        )
        assert feed.page.evaluate(CLIPPED) == []
        assert feed.page.evaluate(OUTSIDE) == []
    assert "Disk full" in (rec.get_attribute("title") or "")
    answer(feed, "", {"folder": "/data/site", "bytes": 4.2e8, "oldest": 1.79e9})
    rec.click()
    feed.send(lambda: "420.0 MB" in feed.page.inner_text("#rec-details"), recording=TROUBLE)
    assert feed.page.inner_text("#rec-text") == TROUBLE["text"]
    feed.send(
        lambda: feed.page.get_attribute("#alarm", "data-level") == "NOTICE",
        recording=TROUBLE,
        notices=[NOTICE],
    )
    feed.page.screenshot(path=artifacts / f"recording-{size[0]}x{size[1]}.png")
    assert feed.errors == []
    feed.page.close()


def test_a_note_by_key_and_the_last_minutes_kept(feed: Feed) -> None:
    noted = answer(feed, "/marker", {}, status=204)
    pinned = answer(feed, "/pin", {"folder": "pinned/2026-11-25"})
    answer(feed, "", {})
    feed.send(lambda: feed.page.is_visible("#rec"), recording=ON)
    feed.page.keyboard.press("n")
    feed.page.keyboard.type("2 stones near the pipe")  # digits and letters are text here
    feed.page.keyboard.press("Enter")
    said = feed.page.locator("#rec-answer")
    feed.send(lambda: "2 stones near the pipe" in said.inner_text(), recording=ON)
    assert noted == [{"text": "2 stones near the pipe"}]
    assert feed.page.input_value("#rec-note") == ""
    feed.page.click("#rec-pin")
    feed.send(lambda: "pinned/2026-11-25" in said.inner_text(), recording=ON)
    assert pinned == [{"name": "", "minutes": 10}]
    feed.page.keyboard.press("Escape")
    feed.send(lambda: feed.page.is_hidden("#rec-dialog"), recording=ON)
    assert feed.page.evaluate("cockpit.state.own") == "left"
    assert feed.errors == []


def test_a_note_that_is_not_taken_stays_and_says_why(feed: Feed) -> None:
    answer(feed, "/marker", {"detail": "nothing is being recorded"}, status=409)
    answer(feed, "", {})
    feed.send(lambda: feed.page.is_visible("#rec"), recording=ON)
    feed.page.keyboard.press("n")
    feed.page.keyboard.type("stones")
    feed.page.keyboard.press("Enter")
    said = feed.page.locator("#rec-answer")
    feed.send(lambda: said.inner_text() == "nothing is being recorded", recording=ON)
    assert feed.page.input_value("#rec-note") == "stones"


def test_a_notice_never_hides_an_alarm(feed: Feed) -> None:
    line, detail = feed.page.locator("#alarm-line"), feed.page.locator("#alarm-detail")
    feed.send(
        lambda: line.inner_text() == NOTICE["line"] and detail.inner_text() == CALM,
        notices=[NOTICE],
    )
    feed.send(
        lambda: feed.level() == "SLOW" and feed.page.inner_text("#alarm-more") == "+1",
        notices=[NOTICE],
        alarms=[LOW],
    )
    assert line.inner_text() == LOW["line"]
    feed.page.click("#alarm-more")
    feed.send(
        lambda: NOTICE["line"] in feed.page.inner_text("#alarm-list"),
        notices=[NOTICE],
        alarms=[LOW],
    )
    # Unknown is worse, too.
    unknown = {"a": "left", "b": "right", "body_a": "", "body_b": "", "distance": None}
    feed.send(
        lambda: feed.level() == "UNKNOWN" and feed.page.inner_text("#alarm-more") == "+1",
        notices=[NOTICE],
        pairs=[{**unknown, "points": None, "reason": "RIGHT is silent", "approach": 0.0}],
    )
    feed.send(lambda: feed.level() == "CLEAR" and line.inner_text() == CALM)
    assert feed.page.inner_text("#alarm-more") == "List"  # calm: what ended is behind it
