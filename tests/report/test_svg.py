"""Plots as SVG: well-formed, values where they belong, gaps where nothing is known."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from hypothesis import given
from hypothesis import strategies as st

from cockpit.report.svg import Band, Plot, draw, plan, ticks


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e4))
def test_ticks_are_round_and_inside(low: float, span: float) -> None:
    found = ticks(low, low + span)
    assert 1 <= len(found) <= 8
    assert all(low - 1e-6 * span <= t <= low + span * (1 + 1e-6) for t in found)


def test_a_plot_has_its_axes_units_legend_and_gaps() -> None:
    plot = Plot(
        "Clear<ance",
        "m",
        [0.0, 1.0, 2.0, 3.0],
        {"left & right": [1.0, 2.0, None, 4.0]},
        {"slow": 0.8},
        (Band(1.0, 3.0, "#ffa51f", "SLOW"),),
        bottom=0.0,
        top=5.0,
    )
    root = ET.fromstring(draw(plot))
    text = " ".join(root.itertext())
    assert "Clear<ance [m]" in text
    assert "left & right" in text
    assert "slow" in text
    assert "SLOW" in text
    assert "3 s" in text
    curve = next(e for e in root if e.get("class") == "curve" and e.get("d", "").count("M") > 1)
    points = re.findall(r"[ML]([\d.]+) ([\d.]+)", curve.get("d", ""))
    assert [p[0] for p in points] == sorted((p[0] for p in points), key=float)
    heights = [float(p[1]) for p in points]
    assert heights[0] > heights[1] > heights[2]  # greater values stand higher


def test_a_plan_is_to_scale_and_north_up() -> None:
    square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
    north = [[0.0, 6.0], [2.0, 6.0], [2.0, 8.0], [0.0, 8.0]]
    outlines = {"A": {"tracks": square}, "B": {"tracks": north}}
    root = ET.fromstring(plan(outlines, [[1.0, 2.0, 0.0], [1.0, 6.0, 0.0]]))
    a, b = (e.get("points", "") for e in root if e.tag == "polygon")
    low = [tuple(map(float, p.split(","))) for p in a.split()]
    high = [tuple(map(float, p.split(","))) for p in b.split()]
    assert max(y for _, y in high) < min(y for _, y in low)
    side = low[1][0] - low[0][0]
    assert abs((low[0][1] - high[0][1]) - 3.0 * side) < 0.5
    assert plan({}, None) == ""
