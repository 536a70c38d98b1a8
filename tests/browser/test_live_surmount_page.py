"""A step picked on the page, manoeuvres looked for, one previewed, accepted and followed to the
top, through the real processes.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from live import Backend, all_valid, serve, simulated
from playwright.sync_api import Browser
from test_live_driving import Pad
from watched import SIZES

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(900)]
LONG = 400.0  # [s] an operator waits for what takes 70 s on a computer of its own
SITE = "step"
HEIGHT = 0.3


@pytest.fixture(scope="module")
def station() -> Iterator[Backend]:
    with (
        serve(SITE, "--no-record") as running,
        simulated(SITE, running.endpoint, "left", "right"),
    ):
        running.wait_for(all_valid)
        yield running


class Climber(Pad):
    """An operator with a pad who takes LEFT over the step."""

    def open(self) -> None:
        self.page.keyboard.press("u")
        self.wait(lambda: self.page.is_visible("#surmount"))
        if self.state() in ("", "Reserved"):
            self.page.keyboard.press("r")
            self.wait(lambda: self.state() not in ("", "Reserved"))

    def shown(self, canvas: str) -> dict[str, Any]:
        text = self.page.get_attribute(f"#{canvas}", "data-state")
        return dict(json.loads(text or "{}"))

    def offer(self) -> dict[str, Any]:
        found = self.page.evaluate("() => window.cockpit.state.snapshot.surmounts.left ?? {}")
        return dict(found)

    def follow(self) -> dict[str, Any]:
        found = self.page.evaluate(
            """() => { const {you, snapshot} = window.cockpit.state;
              return snapshot.driving.seats[you?.seat]?.follow?.left ?? {}; }"""
        )
        return dict(found)

    def machine(self) -> dict[str, Any]:
        found: dict[str, Any] = self.watched.snapshot()["machines"]["left"]
        return found

    def word(self) -> str:
        return self.page.inner_text("#so-state")

    def find(self) -> dict[str, Any]:
        """Until one is on offer: a machine may not yet stand still, or its data be late."""
        end = time.monotonic() + LONG
        while self.offer().get("state") != "offered":
            why = json.dumps(self.offer())[:1500] + self.page.inner_text("#so-line")
            assert time.monotonic() < end, why
            assert self.offer().get("state") != "none", why
            if self.page.is_visible("#so-find") and self.page.is_enabled("#so-find"):
                self.page.click("#so-find")
            time.sleep(0.5)
        return self.offer()

    def accept(self) -> None:
        end = time.monotonic() + LONG
        while not self.follow() or self.follow()["ended"]:
            assert time.monotonic() < end, json.dumps(self.offer())[:1500]
            if self.page.is_enabled("#so-accept"):
                self.page.click("#so-accept")
            time.sleep(0.3)

    def hold(self, until: Callable[[], bool]) -> None:
        """The dead-man, pressed anew whenever a busy computer paused it, until something is so."""
        end = time.monotonic() + LONG
        while not until():
            assert time.monotonic() < end, json.dumps([self.follow(), self.offer()])[:2500]
            if self.state() not in ("Enabled", "Active") or self.shut():
                self.dead_man(False)
                time.sleep(0.3)
                self.dead_man(True)
                time.sleep(0.7)
            time.sleep(0.1)


def test_from_the_list_to_the_top(browser: Browser, station: Backend, artifacts: Path) -> None:
    climber = Climber(browser, station.url, SIZES[1])
    climber.open()
    climber.wait(lambda: climber.page.input_value("#so-obstacle") == "step")
    before = climber.machine()
    offer = climber.find()
    assert offer["obstacle"]["height"] == pytest.approx(HEIGHT, abs=0.05)
    climber.wait(lambda: climber.word() == "READY")
    climber.wait(lambda: climber.page.locator("#so-rows tr").count() > 1)
    # Previewed: the slider moves the machine in the side view. The machine itself stands.
    document = station.get(f"/api/surmount/left/{offer['plan']}")
    climbs = next(one for one in document["phases"] if one["name"] == "sequence 1")
    climber.page.evaluate(
        """t => { const slider = document.getElementById("so-time");
          slider.value = t; slider.dispatchEvent(new Event("input")); }""",
        round(0.7 * climbs["end"] + 0.3 * climbs["start"]),
    )
    climber.wait(lambda: "sequence 1" in climber.page.inner_text("#so-at"))
    climber.wait(lambda: climber.shown("so-plot-side").get("com") is not None)
    time.sleep(2.0)  # the ghost in the 3D scene
    climber.page.screenshot(path=artifacts / "surmount-live-preview-1366x768.png")
    assert math.dist(climber.machine()["position"], before["position"]) < 0.05

    # Another candidate, as a whole; what is accepted is what is shown.
    other = climber.page.locator("#so-rows tr[data-shown='0'] button").first
    other.click()
    climber.wait(lambda: "." in climber.offer().get("plan", ""))
    end = time.monotonic() + LONG
    while climber.offer()["state"] in ("planning", "unknown"):  # late, too, on a busy computer
        assert time.monotonic() < end, climber.offer()
        time.sleep(0.3)
    # What a busy computer is late with makes it unknown for a moment, which passes.
    assert climber.offer()["state"] in ("offered", "unknown"), climber.offer()
    climber.accept()
    assert climber.follow()["plan"] == climber.offer()["plan"]
    seen: set[str] = set()
    highest = [0.0]

    def over() -> bool:
        words = climber.page.inner_text("#so-line").split(" · ")[0]
        seen.add(words)
        highest[0] = max(highest[0], climber.machine()["pitch"])
        if words == "sequence 2-1" and "shot" not in seen:
            seen.add("shot")
            climber.page.screenshot(path=artifacts / "surmount-live-following-1366x768.png")
        return bool(climber.follow().get("ended"))

    climber.hold(over)
    assert climber.follow()["arrived"], (climber.follow(), climber.offer())
    climber.dead_man(False)
    climber.wait(lambda: climber.word() == "ARRIVED")
    assert {"sequence 1", "turn", "sequence 2-1", "sequence 2-2"} <= seen
    assert highest[0] > math.radians(8.0)
    after = climber.machine()
    assert after["position"][2] - before["position"][2] == pytest.approx(HEIGHT, abs=0.06)
    assert abs(after["pitch"]) < math.radians(1.5)
    climber.page.screenshot(path=artifacts / "surmount-live-arrived-1366x768.png")
    assert [error for error in climber.watched.errors if "409" not in error] == []
    climber.page.context.close()
