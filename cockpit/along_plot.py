"""Clearance over station as SVG text: the drawing of `cockpit along`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape

from backend.documents.along import AlongDocument, BandModel
from cockpit.report.svg import ticks

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 960, 300, 56, 16, 40, 44
STYLE = """
text { font: 13px sans-serif; fill: #222 } .curve { stroke: #1f4e79; stroke-width: 2; fill: none }
.grid { stroke: #ddd; fill: none } .axis { stroke: #222; fill: none }
.eta { stroke: #b3261e; stroke-dasharray: 6 3; fill: none }
.violates { fill: url(#hatch); stroke: #b3261e } .undecided { fill: url(#checker); stroke: #777 }
.unknown { fill: none; stroke: #b3261e; stroke-dasharray: 4 4 }
.now { stroke: #000; stroke-width: 1.5 }
"""
PATTERNS = """<defs>
<pattern id="hatch" width="8" height="8" patternUnits="userSpaceOnUse"
 patternTransform="rotate(45)">
<rect width="8" height="8" fill="#f6d9d7"/><path d="M0 0V8" stroke="#b3261e" stroke-width="3"/>
</pattern><pattern id="checker" width="8" height="8" patternUnits="userSpaceOnUse">
<path d="M0 0h4v4H0zM4 4h4v4H4z" fill="#999"/></pattern></defs>"""

Along = Callable[[float], float]


def along_svg(document: AlongDocument) -> str:
    """The drawing's text: what is unknown leaves a gap in the curve, and bands say why."""
    first, last = document.bands[0].start, document.bands[-1].end
    known = [s.clearance for s in document.stretches if s.clearance is not None]
    low, high = min([0.0, *known]), document.cap

    def x(station: float) -> float:
        return LEFT + (station - first) / (last - first) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        inside = min(max(value, low), high)
        return HEIGHT - BOTTOM - (inside - low) / (high - low) * (HEIGHT - TOP - BOTTOM)

    title = f"{document.machine} along {document.track}: clearance over the work cycle [m]"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">',
        f"<title>{escape(title)}</title><style>{STYLE}</style>{PATTERNS}",
        '<rect width="100%" height="100%" fill="#fff"/>',
        f'<text x="{LEFT}" y="18">{escape(title)}</text>',
        *_axes(x, y, (first, last), (low, high)),
        *(_band(band, x) for band in document.bands if band.state != "clear"),
        f'<path class="eta" d="M{LEFT} {y(document.eta):.1f}H{WIDTH - RIGHT}"/>',
        f'<path class="curve" d="{_curve(document, x, y)}"/>',
    ]
    now = document.place.station
    if first <= now <= last:
        parts.append(f'<path class="now" d="M{x(now):.1f} {TOP}V{HEIGHT - BOTTOM}"/>')
        parts.append(f'<text x="{x(now):.1f}" y="{TOP - 5}" text-anchor="middle">now</text>')
    return "\n".join([*parts, "</svg>\n"])


def _axes(
    x: Along, y: Along, stations: tuple[float, float], values: tuple[float, float]
) -> Iterator[str]:
    for value in ticks(*values, most=5):
        at = y(value)
        yield f'<path class="grid" d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}"/>'
        yield f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
    for value in ticks(*stations, most=10):
        yield f'<path class="axis" d="M{x(value):.1f} {HEIGHT - BOTTOM}v4"/>'
        yield (
            f'<text x="{x(value):.1f}" y="{HEIGHT - 24}" text-anchor="middle">{value:g} m</text>'
        )
    yield f'<path class="axis" d="M{LEFT} {TOP}V{HEIGHT - BOTTOM}H{WIDTH - RIGHT}"/>'


def _band(band: BandModel, x: Along) -> str:
    wide = max(x(band.end) - x(band.start), 1.5)
    words = f"{band.state} {band.start:.2f} to {band.end:.2f} m"
    if band.limit:
        words += f", {band.part} to {band.limit}"
    return (
        f'<rect class="{band.state}" x="{x(band.start):.1f}" y="{TOP}" width="{wide:.1f}" '
        f'height="{HEIGHT - TOP - BOTTOM}" fill-opacity="0.5"><title>{escape(words)}</title></rect>'
    )


def _curve(document: AlongDocument, x: Along, y: Along) -> str:
    path, pen = [], False
    for item in document.stretches:
        if item.state == "unknown":
            pen = False
            continue
        value = document.cap if item.clearance is None else item.clearance
        at = 0.5 * (item.start + item.end)
        path.append(f"{'L' if pen else 'M'}{x(at):.1f} {y(value):.1f}")
        pen = True
    return "".join(path)
