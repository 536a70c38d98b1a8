"""A machine driven from the page, with a gamepad, through the real processes."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from driving_frames import GAMEPAD
from live import Backend, all_valid, serve, simulated
from playwright.sync_api import Browser
from watched import SIZES, Watched

import backend

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(900)]
LB = 4  # the dead-man
# A pad's axes (forwards is negative) that raise each joint's value, in ISO's pattern.
AXES = {"swing": (0, -1.0), "boom": (3, 1.0), "stick": (1, -1.0), "bucket": (2, 1.0)}
NEAR = 0.12  # [rad]
# Dig at the trench, carry away from the partner, dump, and back; differences to the start [rad].
CYCLE: tuple[tuple[str, dict[str, float]], ...] = (
    ("dig", {"boom": -0.35, "stick": -0.2, "bucket": 0.0}),
    ("fill", {"bucket": -0.35}),
    ("lift", {"boom": 0.25}),
    ("swing", {"swing": -0.6}),
    ("dump", {"bucket": 0.9}),
    ("back", {"swing": 0.0}),
)


class Pad:
    """The page of one operator with a made-up gamepad in their hands."""

    def __init__(self, browser: Browser, url: str, size: tuple[int, int]) -> None:
        context = browser.new_context(viewport={"width": size[0], "height": size[1]})
        context.add_init_script(GAMEPAD)
        self.watched = Watched(context, url, size)
        self.page = self.watched.page
        self.partner: list[dict[str, float]] = []  # RIGHT's joints at every look
        # Drawn by the processor, beside all processes of a site, the 3D scene would take the time
        # that levers need: a page that is late pauses the machine, as it should.
        self.page.evaluate("() => { document.getElementById('scene').src = 'about:blank'; }")
        self.page.evaluate(
            """() => { window.made.pads.push(window.made.pad(0, "Pad", 4, 17, "standard"));
              dispatchEvent(new Event("gamepadconnected")); }"""
        )

    def axis(self, number: int, value: float) -> None:
        self.page.evaluate("([n, v]) => { window.made.pads[0].axes[n] = v; }", [number, value])

    def rest(self) -> None:
        self.page.evaluate("() => window.made.pads[0].axes.fill(0)")

    def dead_man(self, held: bool) -> None:
        self.page.evaluate("v => window.made.press(4, v)", 1 if held else 0)

    def eyes(self) -> tuple[str, dict[str, float]]:
        """State of LEFT's console on this page, and LEFT's joints; little, as it is asked often."""
        state, joints, partner = self.page.evaluate(
            """() => { const {you, snapshot} = window.cockpit.state;
              const seat = snapshot.driving.seats[you?.seat];
              const {left, right} = snapshot.machines;
              return [seat?.consoles?.left?.state ?? "", left.joints, right.joints]; }"""
        )
        self.partner.append(partner)
        return str(state), joints

    def state(self) -> str:
        return self.eyes()[0]

    def shut(self) -> list[str]:
        """Axes of LEFT that wait for their stick's neutral."""
        return list(
            self.page.evaluate(
                """() => { const {you, snapshot} = window.cockpit.state;
                  const causes = snapshot.driving.seats[you?.seat]?.decision?.left?.causes ?? {};
                  return Object.entries(causes).filter(([, both]) =>
                    both.some((side) => side.concern === "neutral")).map(([role]) => role); }"""
            )
        )

    def wait(self, condition: Any, timeout: float = 120.0) -> None:
        end = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < end, json.dumps(self.watched.snapshot()["driving"])[:1500]
            time.sleep(0.1)

    def request(self) -> int:
        """How often: again when a busy computer lets the lease end before it could be refreshed."""
        end, times, asked = time.monotonic() + 120.0, 0, -math.inf
        while self.state() in ("", "Reserved"):
            assert time.monotonic() < end, json.dumps(self.watched.snapshot()["driving"])[:1500]
            if time.monotonic() - asked > 3.0:
                self.page.keyboard.press("r")
                asked, times = time.monotonic(), times + 1
            time.sleep(0.1)
        return times

    def arm(self) -> None:
        """Request, dead-man; again when a busy computer pauses it."""
        self.request()
        end = time.monotonic() + 120.0
        while self.state() not in ("Enabled", "Active"):
            assert time.monotonic() < end, json.dumps(self.watched.snapshot()["driving"])[:1500]
            self.rest()
            self.dead_man(False)
            time.sleep(0.3)
            self.dead_man(True)
            time.sleep(0.7)

    def joints(self) -> dict[str, float]:
        return self.eyes()[1]

    def move(self, goal: dict[str, float], timeout: float = 150.0) -> None:
        """By eye: until every joint named is near its goal."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            state, now = self.eyes()
            left = {role: value - now[role] for role, value in goal.items()}
            if all(abs(value) < NEAR for value in left.values()):
                self.rest()
                return
            if state not in ("Enabled", "Active"):
                self.arm()
            shut = self.shut()
            if shut:  # stopped for want of fresh data on a busy computer
                self.rest()
                time.sleep(0.2)
            for role, value in left.items():
                number, way = AXES[role]
                speed = 0.0 if abs(value) < NEAR / 2 else max(min(1.5 * value, 1.0), -1.0)
                speed = speed if abs(speed) > 0.3 or not speed else 0.3 * speed / abs(speed)
                self.axis(number, way * speed)
            time.sleep(0.1)
        driving = json.dumps(self.watched.snapshot()["driving"])
        raise AssertionError(f"{goal} was not reached: {self.joints()}, {driving[:1500]}")


def compiled() -> set[Path]:
    """Kernels that numba has kept."""
    return set(Path(backend.__path__[0]).rglob("*.nbc"))


@pytest.fixture(scope="module")
def station() -> Iterator[Backend]:
    before = compiled()
    with (
        serve("demo", "--no-record") as running,
        simulated("demo", running.endpoint, "left", "right"),
    ):
        running.wait_for(all_valid)
        yield running
    # Compiling takes a cycle's process seconds, in which every lease ends: it is `backend.warm`'s.
    assert compiled() - before == set()


def test_dig_swing_and_dump_by_stick_while_the_other_works(
    browser: Browser, station: Backend, artifacts: Path
) -> None:
    pad = Pad(browser, station.url, SIZES[1])
    pad.arm()
    start = pad.joints()
    travelled = 0.0
    for name, change in CYCLE:
        before = pad.joints()
        goal = {role: start[role] + by for role, by in change.items()}
        pad.move(goal)
        after = pad.joints()
        travelled += sum(abs(after[role] - before[role]) for role in after)
        if name == "swing":
            pad.page.screenshot(path=artifacts / "driving-live-1366x768.png")
    assert travelled > 2.0
    document = station.get("/api/snapshot")
    machines = document["driving"]["machines"]
    assert machines["left"]["mode"] == "remote"
    assert machines["left"]["holder"]
    assert machines["right"]["holder"] == ""
    # RIGHT worked meanwhile; its cycle pauses, and comes back to where it was: any look counts.
    worked = {role: [look[role] for look in pad.partner] for role in start}
    assert max(max(values) - min(values) for values in worked.values()) > 0.05
    # What the page shows is what is sent.
    shown = pad.watched.canvases()["limits"]["state"]
    assert shown["enforced"] is True
    pad.dead_man(False)
    pad.wait(lambda: pad.state() == "Pause")
    assert "dead-man" in pad.page.inner_text("#drive-words").lower() or "LB" in pad.page.inner_text(
        "#drive-words"
    )
    assert pad.watched.errors == []
    pad.page.context.close()


def test_stop_on_the_page_latches(browser: Browser, station: Backend) -> None:
    pad = Pad(browser, station.url, SIZES[1])
    pad.arm()
    pad.page.keyboard.press("Backspace")
    pad.wait(lambda: pad.state() == "Stop")
    pad.dead_man(False)
    time.sleep(0.3)
    pad.dead_man(True)
    time.sleep(0.5)
    assert pad.state() == "Stop"
    pad.dead_man(False)
    time.sleep(0.3)
    pad.page.click("#reset")
    pad.wait(lambda: pad.state() == "Idle")
    assert pad.watched.errors == []
    pad.page.context.close()


def test_from_a_closed_browser_to_a_moving_machine(browser: Browser, station: Backend) -> None:
    """Actions: open the page, request, hold the dead-man, move a stick."""
    pad = Pad(browser, station.url, SIZES[1])
    actions = ["open the page"]
    actions += ["request"] * pad.request()
    time.sleep(0.3)
    pad.dead_man(True)
    actions.append("hold the dead-man")
    pad.arm()  # a computer that draws without a graphics card may pause it meanwhile
    actions.append("move a stick")
    pad.move({"boom": pad.joints()["boom"] - 0.2})
    assert len(actions) <= 6
    pad.page.context.close()
