"""Driving on the page alone: devices, dead-man, leases and what is shown, with a made-up server."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from driving_frames import (
    CAUSE,
    JOINTS,
    ZERO,
    DriveFeed,
    console,
    decision,
    limited,
    method,
    remote,
    seat,
)
from playwright.sync_api import Browser
from test_page_exact import CLIPPED, OUTSIDE, ExactFeed
from test_page_recording import ON

SIZES = [(1920, 1080), (1366, 768)]
LB, LT, RT, DOWN = 4, 6, 7, 13


@pytest.fixture
def feed(browser: Browser) -> Iterator[DriveFeed]:
    opened = DriveFeed(browser)
    opened.send(opened.driving)
    yield opened
    assert opened.errors == []
    opened.page.close()


def moves(message: dict[str, Any]) -> bool:
    return any(message[name] for name in ZERO)


def drive_by_pad(feed: DriveFeed) -> None:
    """LB held, swing to the left: the page says so."""
    feed.connect()
    feed.until(lambda m: m["source"] == "")
    feed.press(LB)
    feed.until(lambda m: m["enable"] and m["source"] == "gamepad")
    feed.axes(-1.0)
    feed.until(lambda m: m["enable"] and m["left_x"] == -1)


def only_zero_until_released(feed: DriveFeed, lost: str) -> None:
    """From the fault on nothing but zeros, though the stick and the dead-man are held as before."""
    sent = feed.of("sticks")
    first = next(i for i, m in enumerate(sent) if not m[lost])
    assert all(m["left_x"] == -1 for m in sent[:first])
    feed.send(lambda: True)
    after = feed.of("sticks")[first:]
    assert len(after) > 3
    assert not any(m["enable"] or moves(m) for m in after)


def test_without_driving_the_page_only_monitors(browser: Browser) -> None:
    plain = ExactFeed(browser, 1366, 768)
    plain.send(plain.exact_ready)
    assert plain.page.is_hidden("#stop")
    assert plain.page.is_hidden("#drive-tools")
    assert "Monitoring only" in plain.page.inner_text("#stop-place")
    assert plain.page.inner_text("#limits-note") == "not enforced"
    for key in (" ", "w", "r", "p", "o", "Backspace"):
        plain.page.keyboard.press(key)
    plain.send(lambda: True)
    assert {m["type"] for m in plain.sent} <= {"hello", "ack", "own", "ghost"}
    plain.page.close()


def test_in_playback_nothing_drives(feed: DriveFeed) -> None:
    feed.send(lambda: feed.page.is_hidden("#stop"), mode="PLAYBACK")
    feed.sent.clear()
    feed.page.keyboard.down(" ")
    feed.page.keyboard.down("w")
    feed.page.keyboard.press("Backspace")
    feed.send(lambda: True, mode="PLAYBACK")
    assert not {"sticks", "stop", "lease"} & {m["type"] for m in feed.sent}


def test_sticks_are_sent_40_times_a_second_and_idle_says_zero(feed: DriveFeed) -> None:
    feed.sent.clear()
    begun = time.monotonic()
    feed.page.wait_for_timeout(900)
    sent = feed.of("sticks")
    rate = len(sent) / (time.monotonic() - begun)
    assert 20 <= rate <= 44
    assert [m["seq"] for m in sent] == list(range(sent[0]["seq"], sent[0]["seq"] + len(sent)))
    idle = {"enable": False, "focus": True, "gamepad": True, "source": "", "override": False}
    assert {k: v for k, v in sent[-1].items() if k != "seq"} == {"type": "sticks", **ZERO, **idle}


def test_gamepad_with_dead_zone_and_inverted_forwards(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.axes(0.1, -1.0, 0.56, 1.0)
    feed.until(
        lambda m: (
            m["left_x"] == 0
            and m["left_y"] == 1
            and m["right_x"] == pytest.approx(0.5)
            and m["right_y"] == -1
        )
    )
    feed.press(LT, 1.0)
    feed.press(RT, 0.3)
    feed.until(lambda m: m["track_left"] == 1 and 0 < m["track_right"] < 0.3)
    feed.press(LT, 0.0)
    feed.press(DOWN)
    feed.until(lambda m: m["track_left"] == -1)
    assert feed.shown("limits")["sent"]["left_y"] == 1


def test_a_value_that_is_no_number_is_no_input(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.page.evaluate("() => Object.assign(window.made.pads[0].axes, [NaN, Infinity, null, 7])")
    feed.until(lambda m: m["enable"] and m["left_x"] == 0 and m["right_y"] == -1)
    assert feed.last["left_y"] == 0
    assert feed.last["right_x"] == 0


def test_two_joysticks(feed: DriveFeed) -> None:
    feed.connect("Stick", 2, "")
    feed.connect("Stick", 2, "")
    feed.until(lambda m: True)
    feed.press(0)
    feed.until(lambda m: m["enable"])
    feed.axes(1.0, 0.0)
    feed.axes(0.0, -1.0, index=1)
    feed.until(lambda m: m["left_x"] == 1 and m["right_y"] == 1)
    # The first vanishes: the second must not move up into its place.
    feed.sent.clear()
    feed.page.evaluate("() => { window.made.pads[0] = null; }")
    feed.send(lambda: not feed.last["gamepad"])
    feed.send(lambda: True)
    assert not any(moves(m) or m["enable"] for m in feed.of("sticks") if not m["gamepad"])


def test_dead_man_released_is_told_within_100_ms(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.sent.clear()
    begun = time.monotonic()
    feed.press(LB, 0)
    while not any(not m["enable"] for m in feed.of("sticks")):
        assert time.monotonic() - begun < 0.1
        feed.page.wait_for_timeout(5)


def test_keyboard_acts_only_while_space_is_held(feed: DriveFeed) -> None:
    keyboard = feed.page.keyboard
    feed.sent.clear()
    keyboard.down("w")  # without the dead-man
    feed.send(lambda: True)
    assert not any(moves(m) for m in feed.of("sticks"))
    keyboard.down(" ")
    feed.until(lambda m: m["enable"] and m["source"] == "keyboard")
    keyboard.down("w")  # held from before: the browser repeats it, nobody pressed it anew
    feed.send(lambda: True)
    assert not any(moves(m) for m in feed.of("sticks"))
    keyboard.up("w")
    for key, name, value in (
        ("w", "left_y", 1), ("s", "left_y", -1), ("a", "left_x", -1), ("d", "left_x", 1),
        ("i", "right_y", 1), ("ArrowDown", "right_y", -1), ("j", "right_x", -1),
        ("ArrowRight", "right_x", 1), ("r", "track_left", 1), ("f", "track_left", -1),
        ("t", "track_right", 1), ("g", "track_right", -1),
    ):  # fmt: skip
        keyboard.down(key)
        feed.until(lambda m, name=name, value=value: m == {**m, **ZERO, name: value})
        keyboard.up(key)
    keyboard.down("Shift")
    keyboard.down("d")
    feed.until(lambda m: m["left_x"] == pytest.approx(1 / 3))
    keyboard.up("d")
    keyboard.up("Shift")
    assert not feed.of("lease")  # R was a lever
    feed.sent.clear()
    keyboard.down("d")
    feed.until(lambda m: m["left_x"] == 1)
    feed.freeze()
    keyboard.up(" ")
    feed.page.wait_for_timeout(30)
    assert len(feed.of("sticks")) == 1
    assert feed.last == {**feed.last, **ZERO, "enable": False}
    feed.freeze(False)
    keyboard.up("d")
    # Without the dead-man the keys are the page's own again.
    feed.send(lambda: True)
    feed.page.keyboard.press("m")
    feed.send(lambda: "SOUND ON" in feed.page.inner_text("#sound"))


def test_space_presses_no_button_while_driving(feed: DriveFeed) -> None:
    feed.page.focus("#lease")
    feed.sent.clear()
    feed.page.keyboard.press(" ")
    feed.send(lambda: True)
    assert not feed.of("lease")
    feed.page.keyboard.press("Enter")
    feed.send(lambda: feed.of("lease")[-1]["do"] == "release")


@pytest.mark.parametrize("loss", ["blur", "hidden"])
def test_a_window_without_attention_sends_zero_until_released(feed: DriveFeed, loss: str) -> None:
    drive_by_pad(feed)
    feed.freeze()
    feed.page.evaluate(
        """(loss) => { if (loss === "blur") return void dispatchEvent(new Event("blur"));
          Object.defineProperty(document, "visibilityState", {value: "hidden", configurable: true});
          document.dispatchEvent(new Event("visibilitychange")); }""",
        loss,
    )
    feed.page.wait_for_timeout(30)
    assert len(feed.of("sticks")) == 1
    assert feed.last == {**feed.last, **ZERO, "enable": False, "focus": False}
    feed.freeze(False)
    feed.send(lambda: bool(feed.of("sticks")))
    only_zero_until_released(feed, "focus")
    feed.page.evaluate(
        """(loss) => { if (loss === "blur") return void dispatchEvent(new Event("focus"));
          delete document.visibilityState;
          document.dispatchEvent(new Event("visibilitychange")); }""",
        loss,
    )
    feed.until(lambda m: m["focus"])
    only_zero_until_released_again(feed)


def only_zero_until_released_again(feed: DriveFeed) -> None:
    """What was held through the fault counts for nothing; let go and held anew it drives."""
    feed.sent.clear()
    feed.send(lambda: True)
    assert not any(m["enable"] or moves(m) for m in feed.of("sticks"))
    assert "elease" in feed.page.inner_text("#drive-line")
    feed.press(LB, 0)
    feed.send(lambda: True)
    feed.press(LB)  # the stick is still out
    feed.send(lambda: True)
    assert not any(m["enable"] or moves(m) for m in feed.of("sticks"))
    feed.press(LB, 0)
    feed.axes(0.0)
    feed.send(lambda: True)
    feed.press(LB)
    feed.until(lambda m: m["enable"])
    feed.axes(-1.0)
    feed.until(lambda m: m["left_x"] == -1)


def test_an_unplugged_gamepad_sends_zero_until_it_is_back_and_released(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.freeze()
    feed.page.evaluate(
        """() => { window.made.kept = window.made.pads; window.made.pads = [null];
          dispatchEvent(new Event("gamepaddisconnected")); }"""
    )
    feed.page.wait_for_timeout(30)
    assert len(feed.of("sticks")) == 1
    assert feed.last == {**feed.last, **ZERO, "enable": False, "gamepad": False}
    feed.freeze(False)
    feed.send(lambda: bool(feed.of("sticks")))
    only_zero_until_released(feed, "gamepad")
    assert "gamepad is gone" in (feed.page.get_attribute("#drive-line", "title") or "").lower()
    feed.page.evaluate("() => { window.made.pads = window.made.kept; }")
    feed.until(lambda m: m["gamepad"])
    only_zero_until_released_again(feed)


def test_after_the_gamepad_is_gone_the_keyboard_can_be_taken(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.page.evaluate("() => { window.made.pads = []; }")
    feed.until(lambda m: not m["gamepad"])
    feed.page.keyboard.down(" ")
    feed.until(lambda m: m["enable"] and m["gamepad"] and m["source"] == "keyboard")


def test_only_one_device_counts_and_it_is_told(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.page.keyboard.down(" ")
    feed.page.keyboard.down("w")
    feed.until(lambda m: m["source"] == "gamepad" and m["left_y"] == 0)
    feed.still("Active")
    feed.send(lambda: "Only the gamepad" in feed.page.inner_text("#drive-line"))
    # Let go of the pad: Space held meanwhile takes nothing over.
    feed.page.keyboard.up("w")
    feed.sent.clear()
    feed.press(LB, 0)
    feed.axes(0.0)
    feed.send(lambda: True)
    assert not any(m["source"] == "keyboard" for m in feed.of("sticks"))


def test_a_page_without_data_drives_nothing(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.page.wait_for_timeout(1300)
    assert feed.last == {**feed.last, **ZERO, "enable": False}
    feed.send(lambda: True)
    only_zero_until_released_again(feed)


def test_sticks_on_the_screen_by_mouse_and_space(feed: DriveFeed) -> None:
    page = feed.page
    page.click("#sticks-open")
    feed.send(lambda: page.is_visible("#screen-sticks"))
    box = page.locator("#screen-sticks .pad").first.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.keyboard.down(" ")
    feed.until(lambda m: m["enable"] and m["source"] == "screen")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + box["width"] / 4, y - box["height"])
    feed.until(lambda m: m["left_x"] == pytest.approx(0.457, abs=0.02) and m["left_y"] == 1)
    page.mouse.up()  # springs back
    feed.until(lambda m: m["enable"] and not moves(m))
    page.keyboard.up(" ")
    feed.until(lambda m: not m["enable"])
    page.click("#sticks-open")
    feed.send(lambda: page.is_hidden("#screen-sticks"))


def test_sticks_on_the_screen_by_fingers_and_a_touch_cut_off(feed: DriveFeed) -> None:
    page = feed.page
    page.click("#sticks-open")
    feed.send(lambda: page.is_visible("#screen-sticks"))
    touch = page.context.new_cdp_session(page)

    def middle(selector: str, index: int = 0) -> tuple[float, float]:
        box = page.locator(selector).nth(index).bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    enable, right = middle("#screen-enable"), middle("#screen-sticks .pad", 3)
    points = [{"x": enable[0], "y": enable[1], "id": 1}]

    def fingers(kind: str, *given: dict[str, float]) -> None:
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(given)})

    fingers("touchStart", *points)
    feed.until(lambda m: m["enable"] and m["source"] == "screen")
    second = {"x": right[0], "y": right[1], "id": 2}
    fingers("touchStart", *points, second)
    fingers("touchMove", *points, {**second, "y": right[1] - 300})
    feed.until(lambda m: m["right_y"] == 1 and m["enable"])
    feed.sent.clear()
    fingers("touchCancel")
    feed.page.wait_for_timeout(60)
    assert feed.last == {**feed.last, **ZERO, "enable": False}


def test_sticks_on_the_screen_that_are_cut_off_need_a_new_start(feed: DriveFeed) -> None:
    """One finger's pointer is cancelled while ENABLE is still held."""
    feed.page.click("#sticks-open")
    feed.send(lambda: feed.page.is_visible("#screen-sticks"))
    say = """([selector, type, id]) => { const n = document.querySelector(selector);
      const b = n.getBoundingClientRect(); n.setPointerCapture = () => {};
      n.dispatchEvent(new PointerEvent(type, {pointerId: id, bubbles: true,
        clientX: b.left + b.width, clientY: b.top + b.height / 2})); }"""
    feed.page.evaluate(say, ["#screen-enable", "pointerdown", 11])
    feed.until(lambda m: m["enable"])
    feed.page.evaluate(say, ["#screen-sticks .pad", "pointerdown", 12])
    feed.until(lambda m: m["enable"] and m["left_x"] == 1)
    feed.sent.clear()
    feed.page.evaluate(say, ["#screen-sticks .pad", "pointercancel", 12])
    feed.send(lambda: True)
    assert not feed.last["enable"]  # though ENABLE is still held
    feed.page.evaluate(say, ["#screen-enable", "pointerup", 11])
    feed.send(lambda: True)
    feed.page.evaluate(say, ["#screen-enable", "pointerdown", 13])
    feed.until(lambda m: m["enable"])


def test_stop_by_button_by_key_and_by_pad(feed: DriveFeed) -> None:
    page = feed.page
    assert page.is_hidden("#reset")
    assert page.get_attribute("#stop", "data-latched") == "0"
    assert "not a safety-rated stop" in page.inner_text("#stop")
    feed.connect()
    page.click("#stop")
    feed.send(lambda: len(feed.of("stop")) == 1)
    page.keyboard.press("Backspace")
    feed.send(lambda: len(feed.of("stop")) == 2)
    feed.press(1)
    feed.send(lambda: len(feed.of("stop")) == 3)
    feed.still("Stop", why="stopped by anna")
    feed.machines["left"] = remote("anna", mode="stopped")
    feed.send(lambda: page.is_visible("#reset"))
    assert page.get_attribute("#stop", "data-latched") == "1"
    assert "STOPPED" in page.inner_text("#stop")
    page.click("#reset")
    feed.send(lambda: bool(feed.of("reset")))


def test_pause(feed: DriveFeed) -> None:
    feed.page.keyboard.press("p")
    feed.send(lambda: bool(feed.of("pause")))
    feed.page.click("#controls-open")
    feed.page.click("#pause")
    feed.send(lambda: len(feed.of("pause")) == 2)


@pytest.mark.parametrize("stop_by", ["click", "key"])
def test_a_viewer_sees_who_drives_and_can_only_stop(browser: Browser, stop_by: str) -> None:
    feed = DriveFeed(browser, role="viewer")
    feed.seat = seat({}, role="viewer")
    other = seat({"left": console("Active")}, who="bob")
    feed.more = {"8": other}
    feed.machines["left"] = remote("bob")
    feed.send(lambda: feed.exact_ready() and "R bob" in feed.page.inner_text("#machines"))
    page = feed.page
    assert page.is_hidden("#drive-tools")
    assert page.inner_text("#limits-note") == "not enforced"
    assert "M manual" in page.inner_text("#machines")
    assert page.locator(".machine").first.get_attribute("data-active") == "1"
    feed.connect()
    feed.press(LB)
    for key in (" ", "w", "r", "p", "o"):
        page.keyboard.down(key)
    feed.send(lambda: True)
    assert not {"sticks", "lease", "pause"} & {m["type"] for m in feed.sent}
    # Even if the server said that the seat had it.
    feed.seat = seat({"left": console()}, role="viewer")
    feed.send(lambda: True)
    assert not feed.of("sticks")
    page.click("#stop") if stop_by == "click" else page.keyboard.press("Backspace")
    feed.send(lambda: bool(feed.of("stop")))
    assert feed.errors == []
    page.close()


def test_request_release_hand_over_and_take_over(feed: DriveFeed) -> None:
    page = feed.page
    lease = {"type": "lease", "machine": "left", "to": "", "reason": ""}
    feed.seat = seat({})
    feed.machines["left"] = remote()
    feed.send(lambda: page.inner_text("#lease") == "Request (R)")
    feed.sent.clear()
    feed.send(lambda: True)
    assert not feed.of("sticks")  # this seat has no console
    assert page.inner_text("#limits-note") == "not enforced"
    page.click("#lease")
    page.keyboard.press("r")
    feed.send(lambda: feed.of("lease") == [{**lease, "do": "request"}] * 2)
    feed.more = {"8": seat({}, who="bob")}
    feed.machines["left"] = remote("bob")
    refused = console("Reserved", held=False, refused="bob is in control")
    feed.seat = seat({"left": refused})
    feed.send(lambda: "bob is in control" in page.inner_text("#drive-line"))
    assert page.inner_text("#console-state") == "bob drives"
    page.click("#controls-open")
    page.keyboard.press("Enter")  # without a reason
    feed.send(lambda: "reason" in page.inner_text("#controls-answer"))
    page.keyboard.type("R 0 site manager")  # letters and digits are text here
    page.keyboard.press("Backspace")
    page.keyboard.press("Enter")
    taken = {**lease, "do": "take_over", "reason": "R 0 site manage"}
    feed.send(lambda: feed.of("lease")[-1] == taken)
    assert not feed.of("stop")
    page.keyboard.press("Escape")
    feed.send(lambda: page.is_hidden("#controls"))
    feed.machines["left"] = remote("bob", offered_to="anna")
    feed.send(lambda: page.inner_text("#lease") == "Accept (R)")
    feed.machines["left"] = remote("anna")
    feed.still()
    feed.send(lambda: page.inner_text("#lease") == "Release")
    assert page.inner_text("#limits-note") == "enforced"
    page.click("#controls-open")
    page.keyboard.type("bob")
    page.keyboard.press("Enter")
    feed.send(lambda: feed.of("lease")[-1] == {**lease, "do": "hand_over", "to": "bob"})
    page.click("#controls-close")
    page.click("#lease")
    feed.send(lambda: feed.of("lease")[-1] == {**lease, "do": "release"})
    # Given away by this page: no alarm.
    feed.machines["left"] = remote()
    feed.seat = seat({})
    feed.send(lambda: feed.level() == "CLEAR" and page.inner_text("#lease") == "Request (R)")


def test_only_who_was_offered_the_machine_takes_it_without_an_alarm(feed: DriveFeed) -> None:
    page = feed.page
    page.click("#controls-open")
    page.keyboard.type("bob")
    page.keyboard.press("Enter")
    page.click("#controls-close")
    feed.machines["left"] = remote("bob")
    held, feed.seat = feed.seat, seat({})
    feed.send(lambda: page.inner_text("#console-state") == "bob drives")
    assert feed.level() == "CLEAR"
    feed.seat, feed.machines["left"] = held, remote("anna")
    feed.send(lambda: page.inner_text("#console-state") == "Idle")
    feed.seat, feed.machines["left"] = seat({}), remote("carl")
    feed.send(lambda: feed.level() == "STOP")


def test_control_that_was_taken_away_is_an_alarm(feed: DriveFeed) -> None:
    feed.machines["left"] = remote("bob")
    feed.seat = seat({})
    line, detail = feed.page.locator("#alarm-line"), feed.page.locator("#alarm-detail")
    feed.send(lambda: feed.level() == "STOP" and "control passed on" in line.inner_text())
    assert line.inner_text().startswith("STOP · LEFT control passed on · ")
    assert len(line.inner_text()) <= 50
    assert detail.inner_text() == "Your sticks are off. bob drives LEFT. Request: R."
    assert feed.page.locator(".machine .lamp rect").count() == 1  # LEFT is remote, not stopped
    feed.sent.clear()
    feed.send(lambda: True)
    assert not feed.of("sticks")
    feed.machines["left"] = remote("anna")
    feed.still()
    feed.send(lambda: feed.level() == "CLEAR")


def test_a_locked_machine_is_an_alarm_and_the_delay_has_a_shape(feed: DriveFeed) -> None:
    why = "round trip 430 ms: motion is locked above 400 ms"
    feed.machines["left"] = remote("anna", round_trip=0.43, level="locked", locked=why)
    line = feed.page.locator("#alarm-line")
    feed.send(lambda: line.inner_text() == "STOP · LEFT locked · round trip 430 ms")
    button = feed.page.locator(".machine").first
    feed.send(lambda: "430 ms" in button.inner_text())
    assert button.get_attribute("data-delay") == "locked"
    seen = set()
    for level in ("ok", "slow", "bad", "locked", "unknown"):
        feed.machines["left"] = remote("anna", level=level)
        feed.send(lambda level=level: button.get_attribute("data-delay") == level)
        seen.add(button.locator(".delay").inner_html())
    assert len(seen) == 5


def test_round_trips_are_a_curve_of_the_last_minute(feed: DriveFeed) -> None:
    feed.machines["left"] = remote("anna", round_trip=0.18, level="slow")
    feed.send(lambda: feed.shown("trends").get("trip") == 0.18)
    feed.machines["left"] = remote("anna", round_trip=None, level="unknown")
    feed.send(lambda: feed.shown("trends").get("trip") is None)


SETTING = {"type": "setting", "pattern": "ISO", "fine": False, "method": "braking"}


def test_the_method_is_chosen_in_neutral_and_what_it_holds_back_is_said(feed: DriveFeed) -> None:
    page = feed.page
    feed.send(lambda: page.inner_text("#drive-cause").startswith("All free"))
    page.click("#controls-open")
    page.select_option("#method", "constrained")
    feed.send(lambda: feed.of("setting") == [{**SETTING, "method": "constrained"}])
    feed.send(lambda: page.input_value("#method") == "braking")  # until the server says otherwise
    why, warning = "stick to gauge:T1 0.31 m", "swing at full speed needs 3.55 m to stop"
    told = method("constrained", scale=0.42, why=[why], warnings=[warning])
    feed.seat = {
        **feed.seat,
        "method": "constrained",
        "decision": {"left": {**decision(), "method": told}},
    }
    feed.send(lambda: page.input_value("#method") == "constrained")
    assert warning in page.inner_text("#method-note")
    assert page.inner_text("#drive-cause").startswith(f"Method: constrained 42 % - {why}")
    feed.seat = {**feed.seat, "sticks": {**ZERO, "left_x": 0.4}}
    feed.send(lambda: page.is_disabled("#method"))


def test_pattern_and_fine_change_only_as_the_server_says(feed: DriveFeed) -> None:
    page = feed.page
    levers = feed.shown("limits")["levers"]
    assert levers["left up"] == ["stick out", 100]
    assert levers["right down"] == ["boom up", 100]
    page.click("#pattern")
    feed.send(lambda: feed.of("setting") == [{**SETTING, "pattern": "SAE"}])
    assert page.inner_text("#pattern") == "ISO"
    feed.seat = {**feed.seat, "pattern": "SAE"}
    feed.send(lambda: page.inner_text("#pattern") == "SAE")
    levers = feed.shown("limits")["levers"]
    assert levers["left up"] == ["boom down", 100]
    assert levers["right up"] == ["stick out", 100]
    assert levers["left left"] == ["swing left", 100]
    page.click("#fine")
    wanted = {**SETTING, "pattern": "SAE", "fine": True}
    feed.send(lambda: feed.of("setting")[-1] == wanted)
    # Not while the dead-man is held.
    page.keyboard.down(" ")
    feed.send(lambda: page.is_disabled("#pattern"))
    page.keyboard.up(" ")
    feed.send(lambda: page.is_enabled("#pattern"))
    # Nor while the machine is still said to move.
    feed.seat = {**feed.seat, "sticks": {**ZERO, "left_x": 0.4}}
    feed.send(lambda: page.is_disabled("#pattern"))


def test_switching_between_machines_this_seat_has(feed: DriveFeed) -> None:
    feed.machines["right"] = remote("anna")
    feed.seat = seat({"left": console(), "right": console()})
    feed.send(lambda: "R anna" in feed.page.locator(".machine").nth(1).inner_text())
    feed.sent.clear()
    feed.page.keyboard.press("2")
    feed.send(lambda: feed.of("drive") == [{"type": "drive", "machine": "right"}])
    # Until the server agrees the panel says whose the sticks are.
    feed.send(lambda: "LEFT" in feed.page.inner_text("#drive-line"))
    feed.page.keyboard.press("2")
    feed.send(lambda: len(feed.of("drive")) == 2)
    feed.seat = {**feed.seat, "driven": "right"}
    feed.send(lambda: feed.shown("limits")["own"] == "right")
    feed.page.keyboard.press("2")
    feed.send(lambda: True)
    assert len(feed.of("drive")) == 2


def test_override_needs_a_supervisor_a_reason_and_a_held_button(browser: Browser) -> None:
    feed = DriveFeed(browser, role="supervisor")
    page = feed.page
    feed.send(feed.driving)
    page.keyboard.down("o")
    feed.send(lambda: True)
    assert not feed.last["override"]
    page.keyboard.up("o")
    page.click("#controls-open")
    page.fill("#override-why", "lift the bucket off the pipe")
    page.keyboard.press("Enter")
    wanted = {"type": "override", "reason": "lift the bucket off the pipe"}
    feed.send(lambda: feed.of("override") == [wanted])
    page.click("#controls-close")
    feed.seat = {**feed.seat, "override": wanted["reason"]}
    feed.send(lambda: page.is_visible("#drive-override"))
    page.keyboard.down("o")
    feed.until(lambda m: m["override"])
    feed.send(lambda: page.get_attribute("#drive-override", "data-on") == "1")
    page.keyboard.up("o")
    feed.until(lambda m: not m["override"])
    page.hover("#drive-override")
    page.mouse.down()
    feed.until(lambda m: m["override"])
    page.mouse.up()
    feed.until(lambda m: not m["override"])
    # Not for an operator, even with a reason.
    page.keyboard.down("o")
    feed.until(lambda m: m["override"])
    page.evaluate("() => dispatchEvent(new Event('blur'))")
    feed.until(lambda m: not m["override"])
    assert feed.errors == []
    page.close()


def test_an_operator_overrides_nothing(feed: DriveFeed) -> None:
    feed.seat = {**feed.seat, "override": "no"}
    feed.page.keyboard.down("o")
    feed.sent.clear()
    feed.send(lambda: True)
    assert not any(m["override"] for m in feed.of("sticks"))


def test_what_is_enforced_is_shown_with_its_cause(feed: DriveFeed) -> None:
    feed.page.click("#sticks-open")
    feed.still("Active")
    feed.seat = {**feed.seat, "decision": {"left": limited(0.4, 0.0)}}
    pad = '#screen-sticks [data-lever="left"] [data-way="left"]'
    feed.send(lambda: feed.page.inner_text(pad) == "swing left 40 %")
    feed.send(lambda: feed.shown("limits")["levers"]["left left"] == ["swing left", 40])
    shown = feed.shown("limits")
    assert shown["enforced"] is True
    assert shown["levers"]["left right"] == ["swing right", 100]
    assert shown["levers"]["right up"] == ["boom down", 0]
    assert shown["levers"]["right down"] == ["boom up", 100]
    assert feed.page.inner_text("#drive-cause") == "Boom down blocked: 25 kV line: 0.20 m left"
    # What is being cut now comes first.
    feed.seat = {**feed.seat, "decision": {"left": {**limited(0.4, 0.0), "cut": {"swing": CAUSE}}}}
    feed.send(lambda: feed.page.inner_text("#drive-cause") == f"Swing left 40 %: {CAUSE}")
    # The words beside the left stick, second row.
    feed.page.hover("#limits", position={"x": 100, "y": 28})
    feed.send(lambda: CAUSE in feed.page.inner_text("#hover"))
    assert "enforced" in feed.page.inner_text("#hover")
    gone = limited(0.4)
    del gone["fraction"]["stick"]
    feed.seat = {**feed.seat, "decision": {"left": gone}}
    feed.send(lambda: feed.shown("limits")["levers"]["left up"] == ["stick out", 0])


def test_every_state_says_what_to_do(feed: DriveFeed) -> None:
    line = feed.page.locator("#drive-line")
    seen = set()
    for state, why, words in (
        ("Idle", "", "hold Space"),
        ("Enabled", "", "Move a stick"),
        ("Pause", "dead-man released", "Release"),
        ("Stop", "stopped by bob", "RESET"),
    ):
        feed.still(state, why=why)
        feed.send(lambda state=state: feed.page.inner_text("#console-state") == state)
        assert words.lower() in line.inner_text().lower()
        assert why in (line.get_attribute("title") or "").lower()
        seen.add(feed.page.locator("#console-lamp").inner_html())
    assert len(seen) == 4


def test_the_mapping_is_edited_kept_and_reset(feed: DriveFeed) -> None:
    page = feed.page
    feed.connect()
    feed.send(lambda: True)

    def editor() -> None:
        page.click("#controls-open")
        page.click("#mapping-more")

    editor()
    feed.send(lambda: "Pad" in page.inner_text("#mapping-devices"))
    feed.axes(0.5)
    feed.press(2)
    feed.send(lambda: "0.50" in page.inner_text("#mapping-live"))
    feed.send(lambda: "pressed: X" in page.inner_text("#mapping-live"))
    feed.press(2, 0)
    page.get_by_label("left stick, right: axis").select_option("3")
    page.get_by_label("left stick, right: inverted").check()
    page.get_by_label("left stick, right: dead zone").fill("0.9")  # more than there is
    page.keyboard.press("Tab")
    page.get_by_label("dead-man (hold): button").select_option("5")
    page.get_by_label("right stick, forwards: axis").select_option("null")
    feed.send(lambda: "Your own mapping" in page.inner_text("#mapping-answer"))
    assert page.get_by_label("left stick, right: dead zone").input_value() == "0.5"
    page.reload()
    feed.send(feed.driving)
    feed.connect()
    feed.send(lambda: True)
    feed.press(5)
    feed.until(lambda m: m["enable"])
    feed.axes(1.0, 0.0, 0.0, 0.75)
    feed.until(lambda m: m["left_x"] == pytest.approx(-0.5) and m["right_y"] == 0)
    feed.press(5, 0)
    feed.axes(0.0, 0.0, 0.0, 0.0)
    editor()
    page.click("#mapping-reset")
    feed.send(lambda: "Default" in page.inner_text("#mapping-answer"))
    page.click("#mapping-close")
    feed.press(LB)
    feed.until(lambda m: m["enable"])


def test_a_mapping_changed_under_a_held_stick_moves_nothing(feed: DriveFeed) -> None:
    drive_by_pad(feed)
    feed.page.click("#controls-open")
    feed.page.click("#mapping-more")
    feed.sent.clear()
    feed.page.get_by_label("right stick, right: axis").select_option("0")
    feed.send(lambda: not feed.last["enable"])
    feed.send(lambda: True)
    assert not any(m["right_x"] for m in feed.of("sticks"))


@pytest.mark.parametrize("bad", ["{", json.dumps({"axes": {}}), "null"])
def test_a_bad_stored_mapping_gives_way_to_the_default(feed: DriveFeed, bad: str) -> None:
    feed.page.evaluate("text => localStorage.setItem('drive mapping anna', text)", bad)
    feed.page.reload()
    feed.send(feed.driving)
    drive_by_pad(feed)
    feed.page.click("#controls-open")
    feed.page.click("#mapping-more")
    feed.send(lambda: "cannot be read" in feed.page.inner_text("#mapping-answer"))


def situations(feed: DriveFeed) -> dict[str, Any]:
    """Name -> what the server says then."""

    def idle() -> None:
        slow = "{} at full speed needs 4.36 m to stop and enters the limit: p_u = 0.80 m and p_l = "
        slow += "0.20 m leave 0.60 m; p_u must be at least 4.56 m."
        told = method(warnings=[slow.format(joint) for joint in JOINTS[:3]])
        feed.still()
        feed.seat = {**feed.seat, "decision": {"left": {**decision(), "method": told}}}

    def pause() -> None:
        feed.still("Pause", why="dead-man released")

    def active() -> None:
        feed.still("Active")
        feed.seat = {**feed.seat, "sticks": {**ZERO, "left_x": -0.7, "track_left": 0.5}}

    def limit() -> None:
        told = method("constrained", scale=0.42, why=["stick to gauge:T1 0.31 m"])
        feed.seat = {**feed.seat, "decision": {"left": {**limited(0.4, 0.0), "method": told}}}
        feed.machines["left"] = remote("anna", round_trip=0.18, level="slow")

    def stop() -> None:
        feed.still("Stop", why="stopped by anna")
        feed.machines["left"] = remote("anna", mode="stopped")

    def override() -> None:
        feed.still("Override")
        feed.machines["left"] = remote("anna")
        feed.seat = {**feed.seat, "override": "lift the bucket off the pipe"}

    def request() -> None:
        feed.seat = seat({}, role="supervisor")
        feed.machines["left"] = remote("bernadette", round_trip=0.31, level="bad")

    listed = (idle, pause, active, limit, stop, override, request)
    return {one.__name__: one for one in listed}


def whole(feed: DriveFeed, size: tuple[int, int]) -> None:
    assert feed.page.evaluate(CLIPPED) == []
    assert feed.page.evaluate(OUTSIDE) == []
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_screenshots(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    feed = DriveFeed(browser, *size, role="supervisor")
    feed.send(lambda: feed.exact_ready() and feed.driving())

    def shoot(name: str) -> None:
        feed.page.screenshot(path=artifacts / f"driving-{name}-{size[0]}x{size[1]}.png")

    for name, say in situations(feed).items():
        say()
        for _ in range(2):
            feed.send(lambda: True, recording=ON)
        whole(feed, size)
        shoot(name)
        if name == "idle":
            for opener, dialog in (("#controls-open", "controls"), ("#mapping-more", "mapping")):
                feed.page.click(opener)
                feed.send(lambda: True)
                shoot(dialog)
                inside = "d => d.getBoundingClientRect().bottom <= innerHeight"
                assert feed.page.locator(f"#{dialog}").evaluate(inside)
                fits = "d => d.scrollHeight <= d.clientHeight && d.scrollWidth <= d.clientWidth"
                assert feed.page.locator(f"#{dialog}").evaluate(fits)
            feed.page.keyboard.press("Escape")
        if name == "active":
            feed.page.click("#sticks-open")
            feed.send(partial(feed.page.is_visible, "#screen-sticks"))
            whole(feed, size)
            shoot("screen-sticks")
            feed.page.click("#sticks-open")
            feed.page.mouse.move(5, 5)
    feed.page.keyboard.press("?")
    feed.send(lambda: True)
    shoot("help")
    assert feed.page.evaluate("document.getElementById('help').scrollHeight") <= (
        feed.page.evaluate("document.getElementById('help').clientHeight")
    )
    assert "not a safety-rated" in feed.page.inner_text("#help-driving")
    assert feed.errors == []
    feed.page.close()


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_screenshot_of_a_viewer(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    feed = DriveFeed(browser, *size, role="viewer")
    feed.seat = seat({}, role="viewer")
    feed.more = {"8": seat({"left": console("Active")}, who="bob")}
    feed.machines["left"] = remote("bob")
    feed.send(lambda: feed.exact_ready() and "R bob" in feed.page.inner_text("#machines"))
    whole(feed, size)
    feed.page.screenshot(path=artifacts / f"driving-viewer-{size[0]}x{size[1]}.png")
    feed.page.close()
