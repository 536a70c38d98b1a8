"""Line plots over time and plan-view figures, as SVG text for a printed page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 960, 64, 16, 26, 30
STYLES = (("#1f4e79", ""), ("#7030a0", "6 3"), ("#3e8e78", "2 3"), ("#8a5a00", "9 3 2 3"))
"""Colour and dash of each curve: told apart without colour as well."""

Values = Sequence[float | None]


@dataclass(frozen=True)
class Band:
    """A stretch of time that is marked. start, end [s]; text in its middle."""

    start: float
    end: float
    colour: str
    text: str


@dataclass(frozen=True)
class Plot:
    """curves: name -> values, None where unknown; lines: a name and a value each, drawn across."""

    title: str
    unit: str
    time: Sequence[float]
    curves: dict[str, Values]
    lines: dict[str, float] = field(default_factory=dict)
    bands: tuple[Band, ...] = ()
    bottom: float | None = None
    top: float | None = None


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round values from low to high, at most `most` + 1 of them."""
    span = high - low
    if not span > 0.0:
        return [low]
    raw = span / most
    unit = 10.0 ** math.floor(math.log10(raw))
    step = next(unit * m for m in (1.0, 2.0, 5.0, 10.0) if unit * m >= raw * (1.0 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def draw(plot: Plot, height: int = 220) -> str:
    """The plot with axes, units and a legend. Unknown values leave a gap."""
    known = [v for values in plot.curves.values() for v in values if v is not None]
    low = min([*known, *plot.lines.values()], default=0.0) if plot.bottom is None else plot.bottom
    high = max([*known, *plot.lines.values()], default=1.0) if plot.top is None else plot.top
    if high - low < 1e-9:
        low, high = low - 0.5, high + 0.5
    begin, end = (plot.time[0], plot.time[-1]) if plot.time else (0.0, 1.0)
    end = max(end, begin + 1e-3)

    def x(t: float) -> float:
        return LEFT + (t - begin) / (end - begin) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        inside = min(max(value, low), high)
        return height - BOTTOM - (inside - low) / (high - low) * (height - TOP - BOTTOM)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{escape(plot.title)}">',
        f'<text x="{LEFT}" y="14" class="title">{escape(plot.title)} [{escape(plot.unit)}]</text>',
    ]
    for band in plot.bands:
        a, b = x(max(band.start, begin)), x(min(band.end, end))
        if b <= a:
            continue
        parts.append(
            f'<rect x="{a:.1f}" y="{TOP}" width="{b - a:.1f}" height="{height - TOP - BOTTOM}" '
            f'fill="{band.colour}" fill-opacity="0.18"><title>{escape(band.text)}</title></rect>'
        )
        if b - a > 9 * len(band.text):
            parts.append(f'<text x="{(a + b) / 2:.1f}" y="{TOP + 12}" class="band">')
            parts.append(f"{escape(band.text)}</text>")
    parts += _axes(x, y, (begin, end), (low, high), height)
    for name, value in plot.lines.items():
        at = y(value)
        parts.append(f'<path d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}" class="limit"/>')
        parts.append(f'<text x="{LEFT + 4}" y="{at - 3:.1f}">{escape(name)}</text>')
    for k, (name, values) in enumerate(plot.curves.items()):
        colour, dash = STYLES[k % len(STYLES)]
        path = "".join(_path(zip(plot.time, values, strict=True), x, y))
        line = f'stroke="{colour}" stroke-dasharray="{dash}" class="curve"'
        parts.append(f'<path d="{path}" {line}/>')
        at = LEFT + 300 + 150 * k
        parts.append(f'<path d="M{at} 10h26" {line}/><text x="{at + 31}" y="14">')
        parts.append(f"{escape(name)}</text>")
    return "".join(parts) + "</svg>"


def _axes(x, y, times, values, height) -> Iterable[str]:  # type: ignore[no-untyped-def]
    for value in ticks(*values, most=5):
        at = y(value)
        yield f'<path d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}" class="grid"/>'
        yield f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
    for value in ticks(*times, most=10):
        at = x(value)
        yield f'<path d="M{at:.1f} {height - BOTTOM}v4" class="axis"/>'
        yield f'<text x="{at:.1f}" y="{height - 12}" text-anchor="middle">{value:g} s</text>'
    yield f'<path d="M{LEFT} {TOP}V{height - BOTTOM}H{WIDTH - RIGHT}" class="axis"/>'


def _path(points, x, y) -> Iterable[str]:  # type: ignore[no-untyped-def]
    pen = False
    for t, value in points:
        if value is None:
            pen = False
            continue
        yield f"{'L' if pen else 'M'}{x(t):.1f} {y(value):.1f}"
        pen = True


def plan(
    outlines: dict[str, dict[str, list[list[float]]]],
    points: Sequence[Sequence[float]] | None,
    size: int = 420,
) -> str:
    """Seen from above, north up. outlines: machine -> part -> (k, 2) site frame [m]; points:
    the two closest ones (2, 3), joined by a line; None when unknown.
    """
    xy = [p for parts in outlines.values() for outline in parts.values() for p in outline]
    if not xy:
        return ""
    low = [min(p[i] for p in xy) - 0.5 for i in (0, 1)]
    high = [max(p[i] for p in xy) + 0.5 for i in (0, 1)]
    scale = (size - 20) / max(high[0] - low[0], high[1] - low[1])

    def at(p: Sequence[float]) -> str:
        return f"{10 + (p[0] - low[0]) * scale:.1f},{10 + (high[1] - p[1]) * scale:.1f}"

    height = 34 + (high[1] - low[1]) * scale
    parts = [f'<svg viewBox="0 0 {size} {height:.0f}" class="plan" role="img" aria-label="plan">']
    for k, (name, shapes) in enumerate(outlines.items()):
        colour, _ = STYLES[k % len(STYLES)]
        for part, outline in shapes.items():
            corners = " ".join(at(p) for p in outline)
            parts.append(
                f'<polygon points="{corners}" fill="{colour}" fill-opacity="0.25" '
                f'stroke="{colour}"><title>{escape(f"{name} {part}")}</title></polygon>'
            )
        first = next(iter(shapes.values()), None)
        if first:
            cx = sum(p[0] for p in first) / len(first)
            cy = sum(p[1] for p in first) / len(first)
            x, y = at((cx, cy)).split(",")
            parts.append(f'<text x="{x}" y="{y}" text-anchor="middle">{escape(name)}</text>')
    if points is not None:
        a, b = at(points[0]), at(points[1])
        parts.append(f'<polyline points="{a} {b}" class="closest"/>')
        for p in (a, b):
            x, y = p.split(",")
            parts.append(f'<circle cx="{x}" cy="{y}" r="3.5"/>')
    length = max(ticks(0.0, (high[0] - low[0]) / 3.0, 2))
    y = height - 8
    parts.append(f'<path d="M10 {y:.0f}h{length * scale:.1f}" class="axis"/>')
    parts.append(f'<text x="14" y="{y - 4:.0f}">{length:g} m, north up</text>')
    return "".join(parts) + "</svg>"
