"""The page in a real browser against real processes: it draws what the snapshot says."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from live import Backend, all_valid, backend
from PIL import Image
from watched import CANVASES, SIZES, Watch

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(300)]


@pytest.fixture(scope="module")
def moving() -> Iterator[Backend]:
    with backend("demo") as running:
        running.wait_for(all_valid)
        yield running


def test_every_panel_lives_and_both_machines_move(
    moving: Backend, watch: Watch, artifacts: Path
) -> None:
    watched = watch(moving.url, SIZES[0])
    first, one = watched.snapshot(), watched.canvases()
    changed: set[str] = set()
    moved: set[str] = set()
    until = time.monotonic() + 40.0
    while time.monotonic() < until and (len(moved) < 2 or len(changed) < 7):
        time.sleep(0.5)
        now, other = watched.snapshot(), watched.canvases()
        changed |= {name for name in CANVASES if other[name]["state"] != one[name]["state"]}
        for name, machine in now["machines"].items():
            before = first["machines"][name]["joints"]
            if max(abs(machine["joints"][j] - before[j]) for j in before) > 0.1:
                moved.add(name)
    assert moved == {"left", "right"}
    # "limits" changes only when something is near.
    assert changed >= set(CANVASES) - {"limits"}
    watched.page.keyboard.press("c")  # a demo's pictures are shown when they are asked for
    for side in ("own", "partner"):  # of both cabs
        watched.until(f"Number(document.getElementById('camera-{side}').dataset.count) > 1", 120.0)
    watched.page.screenshot(path=artifacts / "demo-1920x1080.png")
    assert watched.errors == []


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_nothing_is_clipped_and_nothing_scrolls(
    moving: Backend, watch: Watch, artifacts: Path, size: tuple[int, int]
) -> None:
    watched = watch(moving.url, size)
    time.sleep(1.0)
    page = watched.page
    assert page.evaluate(
        "[document.documentElement.scrollWidth <= innerWidth,"
        " document.documentElement.scrollHeight <= innerHeight]"
    ) == [True, True]
    outside = page.evaluate(
        """() => [...document.querySelectorAll("main, section, header, canvas, button")]
          .filter(n => n.checkVisibility()).map(n => [n.id, n.getBoundingClientRect()])
          .filter(([id, r]) => r.left < -1 || r.top < -1 || r.right > innerWidth + 1
            || r.bottom > innerHeight + 1).map(([id]) => id)"""
    )
    assert outside == []
    clipped = page.evaluate(
        """() => [...document.querySelectorAll("#top *, #alarm *, .panel > header *")]
          .filter(n => n.children.length === 0 && n.checkVisibility()
            && n.scrollWidth > n.clientWidth + 1 && n.clientWidth > 0)
          .map(n => n.id || n.textContent)"""
    )
    assert clipped == []
    page.screenshot(path=artifacts / f"demo-calm-{size[0]}x{size[1]}.png")


def test_the_3d_scene_shows_the_machines(moving: Backend, watch: Watch) -> None:
    watched = watch(moving.url, SIZES[0])
    # The cameras' pictures, over the scene, would have machines in them.
    watched.until("document.getElementById('camera-own').hidden")
    deadline = time.monotonic() + 60.0
    warm = 0
    while warm < 200:
        assert time.monotonic() < deadline, "no machine in its colours in the 3D scene"
        picture = Image.open(io.BytesIO(watched.page.locator("#scene").screenshot()))
        pixels = np.asarray(picture.convert("RGB"), dtype=int)
        # Machine yellow is the only warm colour of a calm scene; what is stale is grey.
        warm = int(((pixels[..., 0] > pixels[..., 2] + 25) & (pixels[..., 0] > 60)).sum())


def test_a_reconnecting_page_is_current_within_two_seconds(moving: Backend, watch: Watch) -> None:
    watched = watch(moving.url, SIZES[1])
    page = watched.page
    page.reload()
    watched.until("window.cockpit && window.cockpit.latency.first !== null", 10.0)
    first = page.evaluate("window.cockpit.latency.first")
    assert first["age"] < 2000.0
    # The 3D scene came after it, and what is shown goes on being new.
    watched.until("document.getElementById('scene').contentDocument?.querySelector('canvas')")
    watched.until("window.cockpit.link === 'ok'")
