"""A plan of a model as SVG: east to the right, north up, in metres of the CRS."""

from __future__ import annotations

import math
from xml.sax.saxutils import escape

import numpy as np

from backend.gauge.records import Model
from backend.spatial.types import Array

WIDTH, HEIGHT, MARGIN = 1200.0, 900.0, 60.0
MAX_EDGES = 40_000  # of a surface that is drawn; more are thinned
STYLE = """
text { font: 13px sans-serif; fill: #222 }
.surface { stroke: #cbb994; stroke-width: .5; fill: none }
.breakline { stroke: #9a7d3c; stroke-width: 1; fill: none }
.alignment { stroke: #14568a; stroke-width: 2.5; fill: none }
.joint { fill: #fff; stroke: #14568a; stroke-width: 1.2 }
.feature { stroke: #8a3d14; stroke-width: 1.5; fill: none }
.cable { stroke: #b3261e; stroke-width: 2; stroke-dasharray: 6 3; fill: none }
.pipe { stroke: #2e7d4f; stroke-width: 2; fill: none }
.structure { fill: #2e7d4f }
.scale { stroke: #222; stroke-width: 2 }
"""


def plan_svg(model: Model, title: str) -> str:
    """The drawing's text."""
    layers = _layers(model)
    corners = [xy for _, _, xy in layers if len(xy)]
    everything = np.concatenate(corners) if corners else np.zeros((1, 2))
    everything = everything[np.isfinite(everything).all(axis=1)]
    if not len(everything):
        everything = np.zeros((1, 2))
    low, high = everything.min(axis=0), everything.max(axis=0)
    span = np.maximum(high - low, 1.0)
    scale = float(min((WIDTH - 2 * MARGIN) / span[0], (HEIGHT - 2 * MARGIN) / span[1]))
    middle = (low + high) / 2

    def place(xy: Array) -> Array:
        away = (xy - middle) * scale
        return np.stack([WIDTH / 2 + away[:, 0], HEIGHT / 2 - away[:, 1]], axis=1)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}">',
        f"<title>{escape(title)}</title><style>{STYLE}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    for kind, label, xy in layers:
        parts.append(_drawn(kind, label, place(xy)))
    parts += [_labels(model, place), _scale_bar(scale), _caption(model, title)]
    return "\n".join([*parts, "</svg>\n"])


def _layers(model: Model) -> list[tuple[str, str, Array]]:
    """Kind, label and points (n, 2), from the bottom up; surfaces as pairs of points."""
    layers: list[tuple[str, str, Array]] = []
    for surface in model.surfaces:
        pairs = surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        edges = np.unique(np.sort(pairs, axis=1), axis=0)
        edges = edges[:: 1 + len(edges) // MAX_EDGES]
        layers.append(("surface", surface.name, surface.points[edges.ravel(), :2]))
        layers += [("breakline", surface.name, line[:, :2]) for line in surface.breaklines]
    for network in model.networks:
        layers += [("pipe", pipe.name, pipe.points[:, :2]) for pipe in network.pipes]
        layers += [("structure", s.name, s.center[None, :2]) for s in network.structures]
    for feature in model.features:
        kind = "cable" if feature.kind == "cable" else "feature"
        layers += [(kind, feature.name, line[:, :2]) for line in feature.lines]
        layers += [(kind, feature.name, point[None, :2]) for point in feature.points]
    for alignment in model.alignments:
        count = max(2, min(4000, 1 + int(alignment.length / 0.5)))
        s = np.union1d(np.linspace(0.0, alignment.length, count), alignment.starts)
        layers.append(("alignment", alignment.name, alignment.plan(s)[0]))
        layers += [("joint", "", e.start[None, :2]) for e in alignment.elements]
    return layers


def _drawn(kind: str, label: str, xy: Array) -> str:
    title = f"<title>{escape(label)}</title>" if label else ""
    if kind == "surface":
        ends = xy.reshape(-1, 2, 2)
        path = "".join(f"M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}" for a, b in ends)
        return f'<path class="surface" d="{path}">{title}</path>'
    if len(xy) == 1:
        return (
            f'<circle class="{kind}" cx="{xy[0, 0]:.1f}" cy="{xy[0, 1]:.1f}" r="3">{title}</circle>'
        )
    return f'<path class="{kind}" d="{_path(xy)}">{title}</path>'


def _path(xy: Array) -> str:
    """A line that is broken where a point is not known."""
    words, pen = [], "M"
    for x, y in xy:
        if math.isfinite(x) and math.isfinite(y):
            words.append(f"{pen}{x:.1f} {y:.1f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(words)


def _labels(model: Model, place: object) -> str:
    words = []
    for alignment in model.alignments:
        xy = place(alignment.plan(np.array([alignment.length / 2]))[0])[0]  # type: ignore[operator]
        if np.isfinite(xy).all():
            text = escape(alignment.name)
            words.append(f'<text x="{xy[0] + 8:.1f}" y="{xy[1] - 8:.1f}">{text}</text>')
    return "\n".join(words)


def _scale_bar(scale: float) -> str:
    """A bar of a round length, at most 200 pixels."""
    longest = 200.0 / scale
    power = 10.0 ** math.floor(math.log10(longest))
    length = power * max(k for k in (1, 2, 5) if k * power <= longest)
    x, y = MARGIN, HEIGHT - 24.0
    return (
        f'<line class="scale" x1="{x}" y1="{y}" x2="{x + length * scale:.1f}" y2="{y}"/>'
        f'<text x="{x}" y="{y - 8}">{length:g} m</text>'
        f'<text x="{WIDTH - MARGIN}" y="{MARGIN}" text-anchor="middle">N ↑</text>'
    )


def _caption(model: Model, title: str) -> str:
    crs = f"EPSG:{model.crs.epsg}" if model.crs.epsg else "CRS unknown"
    return f'<text x="{MARGIN}" y="24">{escape(title)} · {escape(model.format)} · {crs}</text>'
