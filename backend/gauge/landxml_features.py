"""<PlanFeature> and <PipeNetwork>: cables, fences, footings, pipes and wells."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from backend.gauge import xml_values as xml
from backend.gauge.elements import Element, Line, Polyline
from backend.gauge.landxml_plan import PlanReader
from backend.gauge.log import Log
from backend.gauge.records import Feature, Network, Pipe, Structure
from backend.gauge.units import Units
from backend.spatial.types import Array

SAG = 5e-3  # of a curve's chords from the curve [m]
SHAPES = ("CircPipe", "ElliPipe", "EggPipe", "RectPipe", "Channel")
NODES = ("CircStruct", "RectStruct", "InletStruct", "OutletStruct", "Connection")


def read_feature(
    element: Any, units: Units, points: Mapping[str, Array], log: Log, state: str = ""
) -> Feature | None:
    """One <PlanFeature>: its geometry as polylines, or its location; None when it has neither."""
    where = xml.called(element)
    lines: list[Array] = []
    single: list[Array] = []
    for geometry in xml.children(element, "CoordGeom"):
        reader = PlanReader(units, points, log)
        for item in geometry:
            made = reader.read(item, where) if xml.local(item) not in ("", "Feature") else None
            if made is not None:
                _append(lines, _sampled(*made))
    for item in xml.children(element, "Location", "PntList2D", "PntList3D"):
        try:
            if xml.local(item) == "Location":
                single.append(xml.point(item.text, units))
            else:
                lines.append(xml.points(item, units))
        except ValueError as error:
            log.skip(f"{where} / {xml.called(item)}", str(error))
    if not lines and not single:
        log.skip(where, "it has no line and no location that could be read")
        return None
    return Feature(
        name=xml.clean(element.get("name")),
        kind=_kind(element),
        lines=tuple(lines),
        points=np.array(single).reshape(-1, 3),
        description=xml.clean(element.get("desc")),
        state=xml.clean(element.get("state")) or state,
        properties=xml.properties(element),
    )


def _kind(element: Any) -> str:
    """What its Inframodel extension says it is, e.g. IM_cable; coding is not a kind."""
    codes = [xml.clean(f.get("code")) for f in xml.children(element, "Feature")]
    other = ("coding", "proprietaryCoding", "userDefinedProperties", "spatialZone")
    kinds = [c[3:] for c in codes if c.startswith("IM_") and c[3:] not in other]
    return kinds[0] if kinds else ""


def _sampled(element: Element, heights: Array) -> Array:
    """(n, 3) points whose chords stay within SAG of the element, straight ones' own points."""
    if isinstance(element, Polyline):
        t = element.distances
    elif isinstance(element, Line):
        t = np.array([0.0, element.length])
    else:
        bend = np.abs(element.at(np.linspace(0.0, element.length, 9))[2]).max()
        step = math.sqrt(8 * SAG / bend) if bend > 0.0 else element.length
        count = 1 + min(int(element.length / step), 10_000)
        t = np.linspace(0.0, element.length, count + 1)
    xy = element.at(t)[0]
    z = np.full(len(t), np.nan)
    if len(heights):
        z = np.interp(t, heights[:, 0], heights[:, 1])
    return np.concatenate([xy, z[:, None]], axis=1)


def _append(lines: list[Array], piece: Array) -> None:
    """Continues the last line when the piece begins at its end."""
    if lines and np.hypot(*(lines[-1][-1, :2] - piece[0, :2])) < 1e-3:
        lines[-1] = np.concatenate([lines[-1], piece[1:]])
    else:
        lines.append(piece)


def read_network(element: Any, units: Units, log: Log, state: str = "") -> Network | None:
    """One <PipeNetwork>; None when nothing of it was read."""
    where = xml.called(element)
    structures: dict[str, Structure] = {}
    inverts: dict[tuple[str, str], float] = {}
    for item in _members(element, "Structs", "Struct"):
        named = f"{where} / {xml.called(item)}"
        try:
            structure = _structure(item, units)
        except ValueError as error:
            log.skip(named, str(error))
            continue
        structures[structure.name] = structure
        for invert in xml.children(item, "Invert"):
            key = structure.name, xml.clean(invert.get("refPipe"))
            try:
                inverts[key] = xml.attribute(invert, "elev", units.elevation)
            except ValueError as error:
                log.skip(f"{named} / {xml.called(invert)}", str(error))
    pipes = []
    for item in _members(element, "Pipes", "Pipe"):
        named = f"{where} / {xml.called(item)}"
        try:
            pipe = _pipe(item, units, structures, inverts)
        except ValueError as error:
            log.skip(named, str(error))
            continue
        length = _stated(item, units)
        if math.isfinite(length) and abs(length - pipe.length) > max(0.01, 1e-3 * length):
            log.conflict(named, "length, between the structures' middles", length, pipe.length, "m")
        pipes.append(pipe)
    if not structures and not pipes:
        log.skip(where, "it has no structures and pipes that could be read")
        return None
    return Network(
        name=xml.clean(element.get("name")),
        kind=xml.clean(element.get("pipeNetType")),
        structures=tuple(structures.values()),
        pipes=tuple(pipes),
        description=xml.clean(element.get("desc")),
        state=xml.clean(element.get("state")) or state,
    )


def _members(element: Any, group: str, kind: str) -> list[Any]:
    """All of a kind, in their group as the schema has it, or without one."""
    groups = xml.children(element, group)
    return [m for g in groups for m in xml.children(g, kind)] + xml.children(element, kind)


def _structure(element: Any, units: Units) -> Structure:
    center = xml.child(element, "Center")
    if center is None:
        raise ValueError("it has no <Center>")
    xyz = xml.point(center.text, units)
    sump = xml.attribute(element, "elevSump", units.elevation)
    if math.isnan(xyz[2]):
        xyz[2] = sump
    shape = xml.child(element, *NODES)
    kind = "" if shape is None else xml.local(shape)
    size = (0.0, 0.0)
    if kind == "CircStruct":
        diameter = xml.attribute(shape, "diameter", units.diameter)
        size = (diameter, diameter)
    elif kind == "RectStruct":
        size = (
            xml.attribute(shape, "length", units.width),
            xml.attribute(shape, "width", units.width),
        )
    rim = xml.attribute(element, "elevRim", units.elevation)
    state = xml.clean(element.get("state"))
    return Structure(xml.clean(element.get("name")), kind, xyz, rim, size, state)


def _pipe(
    element: Any,
    units: Units,
    structures: Mapping[str, Structure],
    inverts: Mapping[tuple[str, str], float],
) -> Pipe:
    name = xml.clean(element.get("name"))
    ends = [xml.clean(element.get(key)) for key in ("refStart", "refEnd")]
    rows = []
    for end in ends:
        if end not in structures:
            raise ValueError(f'its structure "{end}" was not read')
        xyz = structures[end].center.copy()
        level = inverts.get((end, name), math.nan)
        xyz[2] = level if math.isfinite(level) else xyz[2]
        rows.append(xyz)
    between = [xml.point(item.text, units) for item in xml.children(element, "Center")]
    points = np.array([rows[0], *between, rows[1]])
    keep = [0] + [i for i in range(1, len(points)) if np.any(points[i, :2] != points[i - 1, :2])]
    shape = xml.child(element, *SHAPES)
    kind = "" if shape is None else xml.local(shape)
    size, thickness = (math.nan, math.nan), 0.0
    if shape is not None:
        size = _size(shape, kind, units)
        thickness = xml.attribute(shape, "thickness", units.width)
    return Pipe(
        name,
        kind,
        ends[0],
        ends[1],
        points[keep] if len(keep) > 1 else points,
        size,
        thickness if math.isfinite(thickness) else 0.0,
        xml.clean(element.get("state")),
    )


def _size(shape: Any, kind: str, units: Units) -> tuple[float, float]:
    if kind == "CircPipe":
        diameter = xml.attribute(shape, "diameter", units.diameter)
        return diameter, diameter
    if kind == "ElliPipe":
        # The schema calls an ellipse's axes "span" and "height".
        return (
            xml.attribute(shape, "span", units.width),
            xml.attribute(shape, "height", units.height),
        )
    wide = "widthTop" if kind == "Channel" else "width"
    return xml.attribute(shape, wide, units.width), xml.attribute(shape, "height", units.height)


def _stated(element: Any, units: Units) -> float:
    try:
        return xml.attribute(element, "length", units.linear)
    except ValueError:
        return math.nan
