"""`cockpit gauge`: what a file of drawings or models holds, in words, as JSON and as a plan."""

from __future__ import annotations

from pathlib import Path

from backend.documents.gauge import AlignmentModel, GaugeDocument, NetworkModel, SkippedModel
from backend.documents.gauge_document import gauge_document
from backend.errors import InputError
from backend.gauge.read import read
from backend.shell.app.wire import dumps
from backend.site.site import load_site
from cockpit.gauge_plan import plan_svg

MOST = 40  # of a list in words; --json has all


def run_gauge(
    path: Path, site_name: str | None, as_json: bool, step: float, svg: Path | None
) -> None:
    """Prints what was found, and writes the plan."""
    epsg = None if site_name is None else load_site(site_name).frame.epsg
    model = read(path, epsg)
    document = gauge_document(model, str(path), step)
    if svg is not None:
        try:
            svg.write_text(plan_svg(model, path.name), encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"--svg {svg} cannot be written ({error.strerror or error})."
            ) from None
    print(dumps(document.model_dump()) if as_json else _words(document))


def _words(document: GaugeDocument) -> str:
    crs = document.crs
    named = f"EPSG:{crs.epsg} by the {crs.source}" if crs.epsg else "CRS unknown"
    lines = [f"{document.file}: {document.format}, {named}"]
    for alignment in document.alignments:
        lines += _alignment(alignment)
    for surface in document.surfaces:
        lines.append(
            f'surface "{surface.name}" {surface.kind}: {surface.points} points, '
            f"{surface.faces} faces ({surface.invisible} invisible), {surface.area:.2f} m² "
            f"({surface.plan_area:.2f} m² in plan), {surface.breaklines} breaklines"
        )
    for feature in document.features[:MOST]:
        kind = feature.kind or "feature"
        points = f", {len(feature.points)} points" if feature.points else ""
        lines.append(f'{kind} "{feature.name}": {feature.length:.3f} m{points}')
    lines += _more(len(document.features), "features")
    for network in document.networks:
        lines += _network(network)
    count = len(document.skipped) - len(
        document.conflicts
    )  # conflicts stand behind what is left out
    lines += _listed("skipped", _told(document.skipped[:count]))
    lines += _listed("conflicts", _told(document.skipped[count:]))
    lines += _listed("notes", document.notes)
    return "\n".join(lines)


def _told(entries: list[SkippedModel]) -> list[str]:
    return [f"{entry.what}: {entry.why}" for entry in entries]


def _alignment(a: AlignmentModel) -> list[str]:
    state = f", {a.state}" if a.state else ""
    stated = "" if a.length_stated is None else f" (stated {a.length_stated:.3f})"
    gauge = f"gauge {a.gauge:.3f} m" + ("" if a.gauge_stated else " assumed")
    lines = [
        f'alignment "{a.name}"{state}: {a.length:.3f} m{stated}, stations {a.sta_start:.3f} to '
        f"{a.sta_start + a.length:.3f}, {gauge}",
        f"  {'element':22} {'station':>12} {'length':>11} {'radius':>21} "
        f"{'end east':>15} {'end north':>15}",
    ]
    for e in a.elements[:MOST]:
        kind = " ".join(word for word in (e.type, e.law, e.name) if word)[:22]
        radius = _radius(e.radius_start)
        if e.type == "spiral":
            radius = f"{radius} > {_radius(e.radius_end)}"
        lines.append(
            f"  {kind:22} {e.sta_start:12.3f} {e.length:11.3f} {radius:>21} "
            f"{e.end[0]:15.3f} {e.end[1]:15.3f}"
        )
    lines += _more(len(a.elements), "elements", "  ")
    for equation in a.equations[:MOST]:
        lines.append(f'  post or equation "{equation.name}" at {equation.internal:.3f}')
    return lines + [f"  {note}" for note in a.notes]


def _radius(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _network(network: NetworkModel) -> list[str]:
    length = sum(pipe.length for pipe in network.pipes)
    return [
        f'network "{network.name}" {network.kind}: {len(network.pipes)} pipes, {length:.2f} m, '
        f"{len(network.structures)} structures"
    ]


def _listed(title: str, entries: list[str]) -> list[str]:
    if not entries:
        return []
    shown = [f"  {entry}" for entry in entries[:MOST]]
    return [f"{title}:", *shown, *_more(len(entries), title, "  ")]


def _more(count: int, what: str, indent: str = "") -> list[str]:
    return [f"{indent}and {count - MOST} more {what}; --json lists all"] if count > MOST else []
