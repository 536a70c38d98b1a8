"""An operator's tasks, scripted: how many actions they take, and how long the page takes to answer.

The counts are checked; times depend on the computer and are written to artifacts/tasks.json.
`test_live_driving.py` has the way from a closed browser to a moving machine.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from driving_frames import DriveFeed, decision, limited
from playwright.sync_api import Browser
from test_page_driving import drive_by_pad
from test_page_exact import COLLIDING, answer
from test_page_playback import PlaybackFeed
from test_page_ten_checks import ALARMED, DETAIL

SIZE = (1366, 768)
FAR_TOO_LONG = 10.0  # [s]; the limits themselves are tenths


@pytest.fixture
def feed(browser: Browser) -> Iterator[DriveFeed]:
    opened = DriveFeed(browser, *SIZE)
    yield opened
    assert opened.errors == []
    opened.page.close()


@pytest.fixture(scope="module")
def measured(artifacts: Path) -> Iterator[dict[str, float]]:
    times: dict[str, float] = {}
    yield times
    (artifacts / "tasks.json").write_text(json.dumps(times, indent=2) + "\n")


class Clock:
    """Actions counted, and the time from the last of them to what the page makes of it."""

    def __init__(self) -> None:
        self.actions, self.begun = 0, 0.0

    def act(self, action: Callable[[], object]) -> None:
        self.actions += 1
        self.begun = time.monotonic()
        action()

    def taken(self) -> float:
        return time.monotonic() - self.begun


def test_switching_the_machine_is_one_action(feed: DriveFeed, measured: dict[str, float]) -> None:
    feed.send(lambda: feed.exact_ready() and feed.driving())
    clock = Clock()
    clock.act(lambda: feed.page.keyboard.press("2"))
    feed.send(lambda: feed.shown("bars")["own"] == "right")
    measured["switch machine"] = clock.taken()
    assert clock.actions == 1
    assert clock.taken() < FAR_TOO_LONG


def test_why_blocked_is_one_click_on_the_cell(feed: DriveFeed, measured: dict[str, float]) -> None:
    answer(feed, COLLIDING)
    feed.send(feed.exact_ready)
    clock = Clock()
    clock.act(lambda: feed.page.mouse.click(*feed.at("slice-0", 0.7, 0.4)))
    feed.wait(lambda: feed.page.get_attribute("#pin", "data-verdict") == "COLLIDING")
    measured["why blocked"] = clock.taken()
    assert clock.actions == 1
    assert clock.taken() < FAR_TOO_LONG


def test_the_freeing_lever_is_read_and_pushed(feed: DriveFeed, measured: dict[str, float]) -> None:
    """Two actions: read it, push it. The stick that is read is the one that is sent."""
    feed.send(lambda: feed.exact_ready() and feed.driving())
    drive_by_pad(feed)
    clock = Clock()

    def alarm() -> None:
        feed.seat = {**feed.seat, "decision": {"left": limited(0.0)}}
        feed.still("Active")

    clock.act(alarm)  # what the operator does is to read
    feed.send(lambda: feed.level() == "STOP", **ALARMED)
    measured["alarm on the page"] = clock.taken()
    assert feed.page.inner_text("#alarm-detail") == DETAIL
    freeing = DETAIL.split("Free: ")[1].rstrip(".")
    assert freeing == "swing right"
    clock.act(lambda: feed.axes(1.0, 0.0, 0.0, 0.0))  # left stick to the right, as it says
    feed.until(lambda sticks: sticks["left_x"] > 0.9, **ALARMED)
    measured["freeing lever sent"] = clock.taken()
    feed.seat = {**feed.seat, "decision": {"left": decision()}}
    feed.send(lambda: feed.level() == "CLEAR")
    assert clock.actions == 2


def test_the_near_miss_is_two_actions_away(browser: Browser, measured: dict[str, float]) -> None:
    feed = PlaybackFeed(browser, *SIZE)
    feed.send(feed.ready_to_play)
    clock = Clock()
    clock.act(lambda: feed.page.keyboard.press("Space"))  # pause
    feed.send(lambda: feed.page.get_attribute("#t-play", "data-playing") == "0")
    clock.act(lambda: feed.page.mouse.click(*feed.x_of(246.0)))  # on its mark
    feed.send(lambda: feed.track()["time"] == pytest.approx(246.0, abs=1.0))
    measured["near miss"] = clock.taken()
    assert clock.actions == 2
    assert clock.taken() < FAR_TOO_LONG
    assert feed.errors == []
    feed.page.close()
