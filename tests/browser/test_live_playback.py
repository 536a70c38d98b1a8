"""The shipped near miss in a real browser, played by the real program."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from live import Backend, playback
from watched import SIZES, Watch, Watched

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(300)]

PLAYBACK = "window.cockpit.state.snapshot?.playback"


@pytest.fixture(scope="module")
def near_miss(repository: Path) -> Iterator[Backend]:
    with playback(repository / "scenes" / "sessions" / "near-miss.mcap") as running:
        yield running


@pytest.fixture
def page(near_miss: Backend, watch: Watch) -> Iterator[Watched]:
    watched = watch(near_miss.url, SIZES[0])
    watched.until(f"{PLAYBACK}.duration > 30")
    if status(watched)["playing"]:
        watched.page.click("#t-play")
        watched.until(f"!{PLAYBACK}.playing")
    yield watched
    assert watched.errors == []


def status(watched: Watched) -> dict[str, Any]:
    found: dict[str, Any] = watched.snapshot()["playback"]
    return found


def x_of(watched: Watched, seconds: float) -> tuple[float, float]:
    box = watched.page.locator("#timeline").bounding_box()
    assert box is not None
    share = seconds / status(watched)["duration"]
    return box["x"] + 12 + share * (box["width"] - 24), box["y"] + 0.6 * box["height"]


def drag(watched: Watched, start: float, end: float) -> None:
    mouse = watched.page.mouse
    mouse.move(*x_of(watched, start))
    mouse.down()
    for k in range(1, 9):
        mouse.move(*x_of(watched, start + (end - start) * k / 8))
    mouse.up()


def test_dragging_goes_there_and_everything_follows(page: Watched, artifacts: Path) -> None:
    drag(page, 2.0, 17.0)
    page.until(f"Math.abs({PLAYBACK}.time - 17) < 0.4")
    page.until("window.cockpit.state.snapshot.concerns.some((c) => c.level === 'STOP')")
    pair = page.snapshot()["pairs"][0]
    assert 0.05 < pair["distance"] < 0.45
    page.until("document.getElementById('alarm-line').textContent.startsWith('STOP')")
    page.page.screenshot(path=artifacts / "played-near-miss-1920x1080.png")
    drag(page, 17.0, 37.5)
    page.until(f"Math.abs({PLAYBACK}.time - 37.5) < 0.4")
    page.until("window.cockpit.state.snapshot.machines.right.validity === 'STALE'")
    page.until("document.getElementById('alarm-line').textContent.startsWith('UNKNOWN')")


def test_a_step_is_a_cycle_and_events_are_jumped_to(page: Watched) -> None:
    drag(page, 20.0, 25.0)
    page.until(f"Math.abs({PLAYBACK}.time - 25) < 0.4")
    sought = status(page)["time"]
    page.page.click("#t-step")  # onto the next cycle, and from there to the one after it
    page.until(f"{PLAYBACK}.time > {sought}")
    before = status(page)["time"]
    page.page.click("#t-step")
    page.until(f"{PLAYBACK}.time > {before}")
    assert 0.005 < status(page)["time"] - before < 0.15
    page.page.click("#t-back")
    page.until(f"Math.abs({PLAYBACK}.time - {before}) < 0.01")
    page.page.click("#t-next")
    page.until(f"{PLAYBACK}.time > 30")  # the cut of RIGHT's stream
    page.page.click("#t-previous")
    page.until(f"{PLAYBACK}.time < 25")


def test_a_loop_repeats_its_section(page: Watched) -> None:
    page.page.keyboard.down("Shift")
    drag(page, 8.0, 9.0)
    page.page.keyboard.up("Shift")
    page.until(f"{PLAYBACK}.loop?.[0] > 7 && {PLAYBACK}.loop[1] < 10")
    page.page.click("#t-play")
    times = []
    for _ in range(12):
        page.page.wait_for_timeout(400)
        times.append(status(page)["time"])
    page.page.click("#t-play")
    page.page.click("#t-loop")
    low, high = 7.9, 9.2
    inside = [t for t in times if low < t < high]
    assert len(inside) >= 10
    assert any(later < earlier for earlier, later in pairwise(inside))


def test_both_sources_agree_on_the_near_miss(page: Watched) -> None:
    drag(page, 5.0, 17.0)
    page.until(f"Math.abs({PLAYBACK}.time - 17) < 0.4")
    page.until("window.cockpit.state.snapshot.pairs[0].distance !== null")
    recorded = page.snapshot()["pairs"][0]["distance"]
    page.page.click("[data-source=evaluated]")
    page.until(f"{PLAYBACK}.source === 'evaluated'", 60.0)
    page.until("window.cockpit.state.snapshot.pairs[0].distance !== null", 60.0)
    assert page.snapshot()["pairs"][0]["distance"] == pytest.approx(recorded, abs=0.05)
    page.page.click("[data-source=recorded]")
    page.until(f"{PLAYBACK}.source === 'recorded'", 60.0)


def test_a_report_is_downloaded(page: Watched, artifacts: Path) -> None:
    with page.page.expect_download(timeout=120_000) as download:
        page.page.click("#t-report")
    path = artifacts / "near-miss-report.html"
    download.value.save_as(path)
    text = path.read_text(encoding="utf-8")
    assert "Least distance between machines" in text
    assert "__VISER_EMBED_DATA__" in text
