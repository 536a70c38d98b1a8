"""What a made-up server says of people: one walks towards LEFT, one is far, one was lost."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest
from exact_frames import exact, margins, zone
from playwright.sync_api import Browser
from test_page_exact import ExactFeed
from test_page_offline import snapshot, sun

PERIOD = 0.04  # between two snapshots [s]
SPEED = 0.6  # of P7, towards LEFT [m/s]
START = 4.6  # of P7 at cycle 0, east of LEFT [m]


def track(
    number: int, place: tuple[float, float], velocity: tuple[float, float], **more: Any
) -> dict[str, Any]:
    ahead = [place[k] + velocity[k] for k in range(2)]
    return {
        "id": number,
        "kind": "person",
        "status": "confirmed",
        "position": [*place, 0.9],
        "velocity": list(velocity),
        "yaw": 0.3,
        "size": [0.5, 0.6, 1.8],
        "sigma": 0.08,
        "unseen": 0.1,
        "ahead": {"position": ahead, "cov": [[0.16, 0.03], [0.03, 0.05]]},
        **more,
    }


def risk(number: int, level: str, now: tuple[Any, Any], later: tuple[Any, Any]) -> dict[str, Any]:
    return {
        "id": number,
        "machine": "left",
        "body": "left:bucket/0",
        "distance": 1.12,
        "ttc": now[0],
        "index": now[1],
        "ttc_ahead": later[0],
        "index_ahead": later[1],
        "level": level,
    }


def people(cycle: int, level: str = "EMERGENCY", **more: Any) -> dict[str, Any]:
    """P7 is in the WARNING region now and in the EMERGENCY region in a second."""
    place = (START - SPEED * PERIOD * cycle % 3.0, -2.0)
    tracks = [
        track(7, place, (-SPEED, 0.0)),
        track(8, (5.5, 3.4), (0.0, 0.0), status="coasting", unseen=0.8),
        track(9, (-3.0, 3.0), (0.0, 0.0), kind="object", size=[1.6, 1.0, 1.2]),
        track(12, (-2.5, -3.2), (0.3, 0.2), status="tentative"),
    ]
    risks = [
        risk(7, level, (2.2, 1.6), (0.8, 0.4)),
        risk(8, "SAFE", (None, None), (None, None)),
        risk(9, "SAFE", (5.0, 3.1), (None, None)),
        risk(12, "WARNING", (2.6, -1000.0) if level == "SAFE" else (2.4, 3.0), (2.9, 2.5)),
    ]
    sensor = {"machine": "left", "name": "lidar", "age": 0.1, "position": [0, 0, 2], "points": 9}
    return {
        "reason": "",
        "age": 0.1,
        "sensors": [sensor],
        "tracks": tracks,
        "lost": [{"id": 3, "position": [3.0, 4.6, 0.9], "seen": 12.3, "lost": 9.3}],
        "risks": risks,
        **more,
    }


class PeopleFeed(ExactFeed):
    """`said` changes what the server says of people; None is a site without LiDARs."""

    def __init__(self, browser: Browser, width: int = 1366, height: int = 768) -> None:
        self.said: dict[str, Any] | None = {}
        super().__init__(browser, width, height)

    def send(self, until: Callable[[], bool], **changes: Any) -> None:
        """25 Hz, people walking on from frame to frame; fails after 20 s."""
        end = time.monotonic() + 20
        while time.monotonic() < end:
            self.cycle += 1
            assert self.socket is not None
            now = None if self.said is None else people(self.cycle, **self.said)
            self.socket.send(snapshot(self.cycle, margins=margins(), people=now, **changes))
            if self.cycle % 3 == 0:
                at = 100.0 + PERIOD * self.cycle - 0.1
                self.socket.send(sun(self.cycle))
                self.socket.send(exact(at))
                self.socket.send(zone(at))
                for frame in self.more(at):
                    self.socket.send(frame)
            self.page.wait_for_timeout(40)
            if self.cycle % 5 == 0 and until():
                return
        pytest.fail(f"the page did not get there: {self.shown('plan')}, {self.shown('trends')}")

    def more(self, at: float) -> list[bytes]:
        """Other frames of the state time `at`."""
        return []

    def run(self, cycles: int) -> None:
        """So many frames more."""
        last = self.cycle + cycles
        self.send(lambda: self.cycle >= last)
