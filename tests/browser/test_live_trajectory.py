"""A goal clicked behind the partner, previewed, accepted and followed, through the real processes;
and one into which the partner moves.
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
from operators import Operator
from playwright.sync_api import Browser
from test_live_driving import Pad
from watched import SIZES

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(900)]
LONG = 240.0  # [s] an operator waits for what a busy computer does in a few

# LEFT at the origin of the plan's words, RIGHT in front of it with its bucket in LEFT's ring.
MACHINE = """
[[machine]]
name = "{name}"
label = "{label}"
model = "mini"
payload = 0.0

[machine.start]
position = [{east}, 4129955.0, 0.0]
yaw_deg = {yaw}
joints_deg = {{ swing = {swing}, boom = 40.0, stick = -70.0, bucket = -30.0 }}

[machine.sim]
program = "hold"
seed = {seed}
"""
SITE = """
name = "two-in-front"
title = "Two excavators in front of each other"

[frame]
epsg = 32652
origin = [308600.0, 4129950.0, 0.0]
geoid_offset = 0.0
heading_reference = "grid"

[safety]
eta = 0.10
slow_below = 0.8
stop_below = 0.2

[sim]
joint_period = 0.005
position_period = 0.05
heading_period = 0.05
position_noise = 0.01
heading_noise_deg = 0.05
joint_noise_deg = 0.02
radio_period = 0.020
latency = 0.050
"""
BASE = (5.0, 5.0)  # LEFT's, site frame [m]
ASIDE = math.radians(55.0)  # how far LEFT's arm is from the line to RIGHT


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Backend]:
    path = tmp_path_factory.mktemp("site") / "two-in-front.toml"
    left = MACHINE.format(
        name="left", label="LEFT", east=308605.0, yaw=0.0, swing=math.degrees(ASIDE), seed=1
    )
    right = MACHINE.format(name="right", label="RIGHT", east=308611.4, yaw=180.0, swing=0.0, seed=2)
    path.write_text(SITE + left + right)
    site = str(path)
    with serve(site, "--no-record") as running, simulated(site, running.endpoint, "left", "right"):
        running.wait_for(all_valid)
        yield running


class Planner(Pad):
    """An operator with a pad who plans."""

    def open(self) -> None:
        self.page.click("#trajectory-open")
        self.wait(lambda: bool(self.watched.canvases()["plan"]["state"].get("trajectory")))
        if self.state() in ("", "Reserved"):
            self.page.keyboard.press("r")
            self.wait(lambda: self.state() not in ("", "Reserved"))

    def plan_state(self) -> dict[str, Any]:
        found: dict[str, Any] = self.watched.canvases()["plan"]["state"]
        return found

    def offer(self) -> dict[str, Any]:
        found = self.page.evaluate("() => window.cockpit.state.snapshot.plans.left ?? {}")
        return dict(found)

    def follow(self) -> dict[str, Any]:
        found = self.page.evaluate(
            """() => { const {you, snapshot} = window.cockpit.state;
              return snapshot.driving.seats[you?.seat]?.follow?.left ?? {}; }"""
        )
        return dict(found)

    def word(self) -> str:
        return self.page.inner_text("#tj-state")

    def click(self, east: float, north: float) -> None:
        """On the plan, until the goal is there: the view may have moved meanwhile."""

        def there() -> bool:
            goal = (self.plan_state().get("trajectory") or {}).get("goal")
            return bool(goal) and math.dist(goal[:2], (east, north)) < 0.15

        end = time.monotonic() + LONG
        while not there():
            assert time.monotonic() < end, self.plan_state()
            state = self.plan_state()
            view, drawn = state["centre"], state["trajectory"]
            box = self.page.locator("#plan").bounding_box()
            assert box is not None
            x = drawn["middle"][0] + drawn["px"] * (east - view[0])
            y = drawn["middle"][1] - drawn["px"] * (north - view[1])
            self.page.mouse.click(box["x"] + x, box["y"] + y)
            time.sleep(0.5)

    def plan(self, **fields: float) -> dict[str, Any]:
        """Until one is on offer: a machine may not yet stand still, or its data be late."""
        for name, value in fields.items():
            self.page.fill(f"#tj-{name}", str(value))
        before, end = self.offer().get("plan"), time.monotonic() + LONG
        while True:
            offer = self.offer()
            if offer.get("plan") != before and offer.get("state") == "offered":
                return offer
            why = json.dumps(offer)[:1500] + self.page.inner_text("#tj-line")
            assert time.monotonic() < end, why
            assert offer.get("plan") == before or offer.get("state") != "none", why
            if self.page.is_enabled("#tj-plan"):
                self.page.click("#tj-plan")
            time.sleep(0.5)

    def accept(self) -> None:
        end = time.monotonic() + LONG
        while not self.follow() or self.follow()["ended"]:
            assert time.monotonic() < end, json.dumps(self.offer())[:1500]
            if self.page.is_enabled("#tj-accept"):
                self.page.click("#tj-accept")
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


def around(theta: float, reach: float) -> tuple[float, float]:
    return BASE[0] + reach * math.cos(theta), BASE[1] + reach * math.sin(theta)


def reach_of(pad: Planner) -> float:
    machine = pad.watched.snapshot()["machines"]["left"]
    tip, axis = machine["end_point"], machine["swing_center"]
    return math.dist(tip[:2], axis[:2])


def clearance(pad: Planner) -> float:
    (pair,) = pad.watched.snapshot()["pairs"]
    return float(pair["distance"] if pair["distance"] is not None else pair["at_least"])


def test_to_a_goal_behind_the_partner(browser: Browser, station: Backend, artifacts: Path) -> None:
    pad = Planner(browser, station.url, SIZES[1])
    pad.open()
    reach = reach_of(pad)
    pad.click(*around(-ASIDE, reach))
    begun = pad.joints()["swing"]
    offer = pad.plan(height=1.0, clearance=0.1)
    assert offer["checks"]["min_clearance"] >= 0.8 * offer["clearance"]
    pad.wait(lambda: pad.word() == "READY")
    # Previewed: the path is on the plan, and the slider moves along it. Nothing moves by that.
    pad.wait(lambda: pad.plan_state()["trajectory"]["path"] > 20)
    pad.page.evaluate(
        """() => { const t = document.getElementById("tj-time");
          t.value = t.max / 2; t.dispatchEvent(new Event("input")); }"""
    )
    pad.wait(lambda: pad.plan_state()["trajectory"]["at"] is not None)
    pad.page.screenshot(path=artifacts / "trajectory-live-preview-1366x768.png")
    assert abs(pad.joints()["swing"] - begun) < 0.02
    pad.accept()
    nearest = [math.inf]

    def over() -> bool:
        nearest[0] = min(nearest[0], clearance(pad))
        return bool(pad.follow().get("ended"))

    pad.hold(over)
    assert pad.follow()["arrived"], (pad.follow()["ended"], pad.follow()["error"], pad.offer())
    pad.dead_man(False)
    pad.wait(lambda: pad.word() == "ARRIVED")
    machine = pad.watched.snapshot()["machines"]["left"]
    assert math.dist(machine["end_point"], offer["goal"]) < 0.12
    assert abs(pad.joints()["swing"] - begun) > ASIDE
    assert nearest[0] > station.get("/api/site")["safety"]["stop_below"]
    pad.page.screenshot(path=artifacts / "trajectory-live-arrived-1366x768.png")
    assert [error for error in pad.watched.errors if "409" not in error] == []
    pad.page.context.close()


def test_the_partner_moves_in_and_it_stops_with_a_reason(
    browser: Browser, station: Backend, artifacts: Path
) -> None:
    partner = Operator(station)

    def swung(goal: float) -> None:
        """RIGHT's arm, by its operator."""

        def left() -> float:
            return goal - partner.joints("right")["swing"]

        def there() -> bool:
            return abs(left()) < 0.15

        end = time.monotonic() + LONG
        while not there():
            assert time.monotonic() < end, partner.snapshot.get("driving")
            way = -0.5 * math.copysign(1.0, left())
            partner.drive("right", there, left_x=way)
            partner.move(left_x=0.0)
            time.sleep(0.3)

    swung(1.2)
    pad = Planner(browser, station.url, SIZES[1])
    pad.open()
    begun = pad.joints()["swing"]
    # Back to the other side, slowly: straight on, and there is time to come in its way.
    there = math.copysign(ASIDE, -math.remainder(begun, 2.0 * math.pi))
    pad.click(*around(there, reach_of(pad)))
    pad.plan(height=1.0, clearance=0.1, speed=6)
    pad.accept()
    pad.hold(lambda: bool(pad.follow().get("at", 0.0) > 0.5 or pad.follow().get("ended")))
    assert pad.follow()["ended"] == ""
    swung(0.0)
    pad.hold(lambda: bool(pad.follow().get("ended")))
    ended = pad.follow()
    assert not ended["arrived"], ended
    assert ended["ended"].startswith("right:"), ended
    assert ended["ended"].endswith("is in its way now"), ended
    pad.wait(lambda: pad.word() in ("ENDED", "VOID"))
    assert "RIGHT" in pad.page.inner_text("#tj-line")
    # It stands, though the dead-man is still held, far from its goal and from the partner.
    pad.hold(
        lambda: abs(pad.watched.snapshot()["machines"]["left"]["joint_velocities"]["swing"]) < 0.02
    )
    stood = pad.joints()["swing"]
    pad.hold(lambda: pad.state() == "Enabled")
    time.sleep(1.0)
    assert abs(pad.joints()["swing"] - stood) < 0.01
    assert abs(math.remainder(stood - there, 2.0 * math.pi)) > 0.3
    assert clearance(pad) > station.get("/api/site")["safety"]["stop_below"]
    assert pad.page.is_disabled("#tj-accept")
    pad.page.screenshot(path=artifacts / "trajectory-live-void-1366x768.png")
    assert [error for error in pad.watched.errors if "409" not in error] == []
    pad.dead_man(False)
    partner.close()
    pad.page.context.close()
