"""An operator draws an area on the plan of a running cockpit, switches it off and deletes it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from live import Backend, all_valid, backend
from watched import SIZES, Watch

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(600)]

# Around RAIL, far from the other machine: north-west, in the site frame [m].
CORNERS = [(-6.0, -2.5), (-1.0, -2.5), (-1.0, 2.5), (-6.0, 2.5)]


@pytest.fixture(scope="module")
def ballast() -> Iterator[Backend]:
    with backend("demo", "--site", "ballast", "--no-record") as running:
        running.wait_for(all_valid, 120.0)
        yield running


def until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


def volume(running: Backend, name: str) -> dict[str, Any] | None:
    found = running.get("/api/gauge")["volumes"]
    return next((one for one in found if one["name"] == name), None)


def shown(watched: Any) -> list[str]:
    """Names of what the plan draws of the gauge."""
    return list(json.loads(watched.page.get_attribute("#plan", "data-state"))["gauge"])


def click(watched: Any, corner: tuple[float, float], times: int = 1) -> None:
    """On the plan, where a point of the site frame is drawn."""
    x, y = watched.page.evaluate(
        """async (corner) => {
          const { chart } = await import("/static/js/plots/plan_layers.js");
          const box = document.getElementById("plan").getBoundingClientRect();
          const [x, y] = chart.at(corner);
          return [box.left + x, box.top + y];
        }""",
        list(corner),
    )
    watched.page.mouse.click(x, y, click_count=times)


def test_an_area_is_drawn_holds_and_goes(ballast: Backend, watch: Watch, artifacts: Path) -> None:
    running = ballast

    def leaves_out_its_track() -> bool:
        track = volume(running, "T1")
        assert track is not None
        return bool(track["left_out_by"] == ["rail"])

    until(leaves_out_its_track)
    watched = watch(running.url, SIZES[1])
    page = watched.page
    watched.until("!document.getElementById('gauge-open').hidden", 60.0)
    page.click("#gauge-open")
    watched.until("document.querySelectorAll('#gauge-list tr').length > 4", 60.0)
    until(lambda: "RAIL stands on it" in page.inner_text("#gauge-list tr[data-name='T1']"))
    assert "idle: switched off" in page.inner_text("#gauge-list tr[data-name='below']")
    page.click("#gauge-out")
    for corner in CORNERS:
        click(watched, corner)
        time.sleep(0.4)
    watched.until("document.getElementById('gauge-hint').textContent.startsWith('4 corners')", 20.0)
    page.keyboard.press("Enter")
    watched.until("!document.getElementById('gauge-form').hidden", 20.0)
    page.fill("#gauge-name", "pit 1")
    page.screenshot(path=artifacts / "gauge-drawing.png")
    page.keyboard.press("Enter")
    until(lambda: volume(running, "pit 1") is not None)
    (area,) = running.get("/api/gauge")["drawn"]
    for drawn, meant in zip(area["polygon"], CORNERS, strict=True):
        assert drawn == pytest.approx(meant, abs=0.15)  # a pixel or two
    until(lambda: "pit 1" in shown(watched))

    def judged(snapshot: dict[str, Any]) -> bool:
        """RAIL works in the middle of it."""
        concerns = [
            c for c in snapshot["concerns"] if (c["name"], c["machine"]) == ("site", "rail")
        ]
        return any(c["evidence"] and "pit 1" in c["evidence"]["other"] for c in concerns)

    running.wait_for(judged, 60.0)
    assert (
        page.evaluate(
            """() => [...document.querySelectorAll("#gauge *, #plan-panel > header button *")]
          .filter(n => n.children.length === 0 && n.checkVisibility()
            && n.scrollWidth > n.clientWidth + 1 && n.clientWidth > 0)
          .map(n => n.id || n.textContent)"""
        )
        == []
    )
    page.screenshot(path=artifacts / "gauge-drawn.png")
    page.click("#gauge-list tr[data-name='pit 1'] button:has-text('Off')")
    until(lambda: "pit 1" not in shown(watched))
    off = volume(running, "pit 1")
    assert off is not None
    assert (off["in_force"], off["why"]) == (False, "is switched off")
    running.wait_for(lambda snapshot: not judged(snapshot), 60.0)
    page.click("#gauge-out")
    click(watched, CORNERS[0])
    page.keyboard.press("Escape")
    assert page.evaluate("document.body.dataset.drawing") == "0"
    page.click("#gauge-list tr[data-name='pit 1'] button:has-text('Delete')")
    until(lambda: volume(running, "pit 1") is None)
    assert running.get("/api/gauge")["drawn"] == []
    assert watched.errors == []
