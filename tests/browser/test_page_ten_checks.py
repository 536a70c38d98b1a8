"""Ten checks on one screenshot of the page, as far as a program can judge them, at both sizes."""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driving_frames import DriveFeed, limited, remote
from PIL import Image
from playwright.sync_api import Browser
from test_page_exact import CLIPPED, OUTSIDE
from test_page_offline import FREE, machine

SIZES = [(1920, 1080), (1366, 768)]
PANELS = ("plan", "reach", "slice-0", "slice-1", "slice-2", "bars", "limits", "trends")
LINE = "STOP · LEFT bucket ↔ RIGHT boom · 0.18 m"
DETAIL = "Swing left blocked. Free: swing right."
ALARM = {
    "level": "STOP",
    "name": "partner",
    "machine": "left",
    "line": LINE,
    "detail": DETAIL,
    "since": 100.0,
    "active": True,
}
CONCERN = {
    "name": "partner",
    "machine": "left",
    "level": "STOP",
    "reason": "near",
    "allowed": [[1, 0], *FREE[1:]],
    "travel": [1, 1],
}
# What is written on each canvas, newest last.
WRITTEN = """
window.written = {};
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, ...more) {
  if (this.canvas.id) (window.written[this.canvas.id] ??= []).push(String(text));
  return fill.call(this, text, ...more);
};
"""
UNIT = re.compile(r"\d\s?(m|s|ms|°|%|Hz|rad|kHz|MB|GB|min|h)\b|\d°|\d\s?%")


class Looked(DriveFeed):
    def more_routes(self) -> None:
        super().more_routes()
        self.page.add_init_script(WRITTEN)

    def pixels(self) -> np.ndarray:
        """(height, width, 3) of the page as it is seen, 0..255."""
        picture = Image.open(io.BytesIO(self.page.screenshot()))
        return np.asarray(picture.convert("RGB"), dtype=float)

    def calm(self) -> None:
        """RIGHT is 3.4 m away, LEFT is held by this page and idle."""
        self.send(
            lambda: self.exact_ready() and self.driving() and self.level() == "CLEAR",
            margins={},
        )

    def alarmed(self) -> None:
        self.seat = {**self.seat, "decision": {"left": limited(0.0)}}
        self.still("Active")
        self.send(lambda: self.level() == "STOP" and "blocked" in self.sticks(), **ALARMED)

    def sticks(self) -> str:
        return self.page.get_attribute("#limits", "aria-label") or ""


ALARMED: dict[str, Any] = {"alarms": [ALARM], "concerns": [CONCERN]}


@pytest.fixture(params=SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def look(browser: Browser, request: pytest.FixtureRequest) -> Iterator[Looked]:
    opened = Looked(browser, *request.param)
    yield opened
    assert opened.errors == []
    opened.page.close()


def filled(pixels: np.ndarray, side: int = 8) -> int:
    """How many squares of that many pixels are full of saturated red or amber."""
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    warm = (red > 150) & (red - blue > 70) & (red - green > 30)
    total = np.pad(warm.astype(int).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    sums = total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]
    return int((sums == side * side).sum())


def test_1_calm_has_no_red_or_amber_fill(look: Looked, artifacts: Path) -> None:
    look.calm()
    size = look.page.viewport_size
    look.page.screenshot(path=artifacts / f"checks-calm-{size and size['width']}.png")
    assert filled(look.pixels()) == 0
    look.alarmed()  # the same measure sees an alarm
    look.page.screenshot(path=artifacts / f"checks-alarm-{size and size['width']}.png")
    assert filled(look.pixels()) > 100


def test_2_an_alarm_names_machine_part_distance_and_lever(look: Looked) -> None:
    look.calm()
    look.alarmed()
    page = look.page
    assert page.inner_text("#alarm-line") == LINE
    assert page.inner_text("#alarm-detail") == DETAIL
    assert page.is_visible("#alarm-detail")
    assert "swing left blocked" in look.sticks()
    assert "swing right" not in look.sticks()  # free
    # The same on the sticks, and nothing of it needs scrolling.
    box = page.locator("#limits").bounding_box()
    size = page.viewport_size
    assert box is not None
    assert size is not None
    assert box["y"] + box["height"] <= size["height"]


def test_2_the_longest_advice_is_read_to_its_end(look: Looked) -> None:
    """All joints and the tracks: what frees stands last."""
    look.calm()
    limits = ("swing left", "boom down", "stick out", "bucket dump", "drive ahead")
    free = "swing right, boom up, stick in, bucket curl, drive back"
    detail = f"{', '.join(f'{lever} limited to 12 %' for lever in limits)}. Free: {free}."
    detail = detail[0].upper() + detail[1:]
    alarm = {**ALARM, "detail": detail}
    look.send(lambda: look.page.inner_text("#alarm-detail").endswith("back."), alarms=[alarm])
    told, seen, wide = look.page.evaluate(
        """() => { const node = document.getElementById("alarm-detail");
          return [node.textContent, node.clientWidth, node.scrollWidth]; }"""
    )
    assert wide <= seen + 1
    assert told.replace(" ≤ ", " limited to ") == detail
    font = look.page.evaluate(
        "() => parseFloat(getComputedStyle(document.getElementById('alarm-detail')).fontSize)"
    )
    assert font >= 11.0
    # A short advice afterwards has its usual letters.
    look.alarmed()
    look.send(lambda: look.page.inner_text("#alarm-detail") == DETAIL, **ALARMED)
    assert look.page.get_attribute("#alarm-detail", "data-scale") in (None, "")


def luminance(colour: str) -> float:
    r, g, b = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def test_3_in_grey_layers_and_levels_are_told_apart(look: Looked) -> None:
    look.calm()
    # Layers: the strokes of their hatches, repeated until all have the same size.
    tiles = look.page.evaluate(
        """async () => { const {LAYERS} = await import("/static/js/layers.js");
          const {tile} = await import("/static/js/theme.js");
          return LAYERS.map(({name, hatch}) => { const {side, cells} = tile(hatch, 1);
            return [name, side, [...cells]]; }); }"""
    )
    hatches = {name: np.reshape(cells, (side, side)) for name, side, cells in tiles}
    assert len(hatches) >= 5
    for one, two in itertools.combinations(hatches, 2):
        assert np.mean(hatches[one] != hatches[two]) > 0.1, (one, two)
    # Levels: words and a shape each.
    shapes = set()
    for level in ("SLOW", "STOP", "UNKNOWN"):
        alarm = {**ALARM, "level": level, "line": LINE.replace("STOP", level)}
        look.send(lambda level=level: look.level() == level, alarms=[alarm], concerns=[CONCERN])
        assert look.page.inner_text("#alarm-line").startswith(level)
        shapes.add(look.page.inner_html("#alarm-glyph"))
    assert len(shapes) == 3


def test_4_every_panel_shows_its_age(look: Looked) -> None:
    look.calm()
    for panel in (*PANELS, "scene"):
        text = look.page.inner_text(f"#{panel}-panel .age")
        assert re.search(r"\d\.\d s", text), (panel, text)


def test_5_every_number_has_a_unit(look: Looked) -> None:
    look.calm()
    look.page.evaluate("window.written = {}")
    look.send(lambda: set(PANELS) <= set(look.page.evaluate("Object.keys(window.written)")))
    written = look.page.evaluate("window.written")
    for canvas in PANELS:
        texts = set(written[canvas])
        numbers = {t for t in texts if re.fullmatch(r"[−+-]?\d+(\.\d+)?", t.strip())}
        titled = any(re.search(r"(°|\bm\b|\bs\b|%)", t) for t in texts)
        # Bare numbers are ticks of an axis, whose title has the unit.
        assert not numbers or titled, (canvas, sorted(texts))
    bare = look.page.evaluate(
        r"""() => [...document.querySelectorAll("#top *, #alarm *, .panel > header *")]
          .filter(n => n.children.length === 0 && n.checkVisibility())
          .map(n => n.textContent.trim()).filter(t => /\d\.\d/.test(t))"""
    )
    assert bare
    assert [t for t in bare if not UNIT.search(t)] == []


def test_6_one_star_an_image_which_agrees_with_the_bars(look: Looked) -> None:
    look.calm()
    seen: dict[str, Any] = {}

    def read() -> bool:
        seen.update({name: look.shown(name) for name in ("bars", "reach", *PANELS[2:5])})
        return True

    look.send(read)
    bars = {role: float(value) for role, value in seen["bars"]["joints"].items()}
    assert seen["reach"]["star"][0] == pytest.approx(bars["swing"], abs=0.5)
    pairs = (("boom", "stick"), ("boom", "bucket"), ("stick", "bucket"))
    for k, roles in enumerate(pairs):
        star = np.degrees(seen[f"slice-{k}"]["star"])
        assert star == pytest.approx([bars[role] for role in roles], abs=0.5)


def test_7_undecided_free_and_out_of_reach_differ(look: Looked) -> None:
    look.calm()
    colours = look.page.evaluate(
        """async () => { const {C} = await import("/static/js/theme.js");
          return [C.outside, C.free, C.undecided]; }"""
    )
    levels = [luminance(colour) for colour in colours]
    assert all(b - a > 0.05 for a, b in itertools.pairwise(levels)), colours
    counts = look.shown("slice-0")["counts"]
    assert counts["free"] > 0
    assert counts["undecided"] > 0


def test_8_stale_never_reads_clear(look: Looked) -> None:
    look.calm()
    machines = {"left": machine("LEFT", 0.0), "right": machine("RIGHT", 7.0, age=0.6)}
    unknown = {"a": "left", "b": "right", "body_a": "", "body_b": "", "distance": None}
    unknown |= {"points": None, "reason": "RIGHT joints are 0.6 s old", "approach": 0.0}
    look.send(lambda: look.level() == "UNKNOWN", machines=machines, pairs=[unknown])
    assert "CLEAR" not in look.page.inner_text("body")
    assert look.shown("reach")["hollow"]
    look.page.wait_for_selector('body[data-link="lost"]')  # no more frames
    assert "CLEAR" not in look.page.inner_text("body")


def test_9_mode_holder_and_stop_are_visible(look: Looked) -> None:
    look.machines = {"left": remote("anna"), "right": remote("bert")}
    look.calm()
    page = look.page
    for place, words in (("#mode", "LIVE"), ("#stop", "STOP"), ("#machines", "anna")):
        assert page.is_visible(place)
        assert words in page.inner_text(place), place
    assert "bert" in page.inner_text("#machines")
    said = page.get_by_text("not a safety-rated", exact=False)
    assert any(said.nth(k).is_visible() for k in range(said.count()))


@pytest.mark.parametrize("state", ["calm", "alarmed"])
def test_10_nothing_is_clipped_and_nothing_scrolls(look: Looked, state: str) -> None:
    look.calm()
    shows: Callable[[], None] = getattr(look, state)
    shows()
    assert look.page.evaluate(CLIPPED) == []
    assert look.page.evaluate(OUTSIDE) == []
    size = look.page.viewport_size
    root = "document.documentElement"
    assert size is not None
    scroll = look.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]")
    assert scroll == [size["width"], size["height"]]
