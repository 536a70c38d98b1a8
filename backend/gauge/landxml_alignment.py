"""<Alignment>: plan, profiles, cant and stations, checked against each other."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from backend.gauge import xml_values as xml
from backend.gauge.alignment import Alignment
from backend.gauge.cant import Cant
from backend.gauge.elements import Element, Line, Polyline
from backend.gauge.landxml_plan import PlanReader
from backend.gauge.landxml_profile import read_cant, read_profiles
from backend.gauge.log import LENGTH, Log
from backend.gauge.profile import Profile, Pvi, build
from backend.gauge.stations import Equation, Stations
from backend.gauge.units import Units
from backend.spatial.angles import difference
from backend.spatial.types import Array

KINK = 1e-3  # between elements of which one is curved [rad]
GAUGES = {True: 1.524, False: 1.435}  # in Finland and elsewhere [m]


def read_alignment(
    element: Any,
    units: Units,
    points: Mapping[str, Array],
    log: Log,
    *,
    inframodel: bool,
    state: str = "",
) -> Alignment | None:
    """One <Alignment>; None when nothing of its plan was read. state: of its collection."""
    where = xml.called(element)
    start = _start(element, units, where, log)
    geometry = xml.child(element, "CoordGeom")
    if geometry is None:
        log.skip(where, "it has no <CoordGeom>")
        return None
    elements, starts, heights = _plan(geometry, PlanReader(units, points, log), start, where, log)
    if not elements:
        log.skip(where, "none of its elements was read")
        return None
    notes: list[str] = []
    profiles = read_profiles(element, units, start, where, log)
    if not profiles:
        own = _own_profile(heights)
        profiles = () if own is None else (own,)
        notes.append("it has no profile: " + ("heights are unknown" if own is None else own.name))
    stations = _stations(element, units, start, where, log, inframodel)
    stated = _number(element, "length", units.linear, where, log)
    alignment = Alignment(
        name=xml.clean(element.get("name")),
        elements=tuple(elements),
        starts=np.array(starts),
        description=xml.clean(element.get("desc")),
        state=xml.clean(element.get("state")) or state,
        stations=stations,
        profiles=profiles,
        stated_length=stated,
        coding=xml.coding(element),
    )
    log.check(where, "length; used is the sum of the elements", stated, alignment.length)
    cant, gauge = _cant(element, units, start, where, alignment, log, notes)
    known = gauge if math.isfinite(gauge) else GAUGES[inframodel]
    if not math.isfinite(gauge) and cant is not None:
        notes.append(f"no gauge is stated: {known} m is assumed")
    _coverage(alignment, notes)
    stated_gauge = math.isfinite(gauge)
    return replace(alignment, cant=cant, gauge=known, gauge_stated=stated_gauge, notes=tuple(notes))


def _number(element: Any, key: str, factor: float, where: str, log: Log) -> float:
    try:
        return xml.attribute(element, key, factor)
    except ValueError as error:
        log.skip(where, str(error))
        return math.nan


def _start(element: Any, units: Units, where: str, log: Log) -> float:
    start = _number(element, "staStart", units.linear, where, log)
    if math.isnan(start):
        log.note(f"{where}: no staStart, taken as 0")
        return 0.0
    return start


def _plan(
    geometry: Any, reader: PlanReader, start: float, where: str, log: Log
) -> tuple[list[Element], list[float], list[Array]]:
    """Elements, the distance of each one's start, and heights (n, 2) along the alignment."""
    elements: list[Element] = []
    starts: list[float] = []
    heights: list[Array] = []
    at, hole = 0.0, False
    for item in geometry:
        if xml.local(item) in ("", "Feature"):
            continue
        made = reader.read(item, where)
        stated = _number(item, "staStart", reader.linear, where, log) - start
        if made is None:
            hole = True
            continue
        if hole:
            at = _behind_hole(elements, at, made[0], stated)
        elif elements:
            _joint(elements[-1], made[0], f"{where} / {xml.called(item)}", log)
        named = f"{where} / {xml.called(item)}"
        log.check(named, "staStart; used is the sum of the lengths", stated + start, at + start)
        hole = False
        elements.append(made[0])
        starts.append(at)
        heights.append(made[1] + [at, 0.0])
        at += made[0].length
    return elements, starts, heights


def _behind_hole(elements: list[Element], at: float, after: Element, stated: float) -> float:
    """Where an element begins behind one that was not read: where it says, else straight on."""
    straight = math.dist(elements[-1].end, after.start) if elements else 0.0
    return stated if math.isfinite(stated) and stated >= at - LENGTH else at + straight


def _joint(before: Element, after: Element, where: str, log: Log) -> None:
    gap = math.dist(before.end, after.start)
    if gap > LENGTH:
        log.conflict(where, "distance of its start from the end before it", 0.0, gap, "m")
    if isinstance(before, Line | Polyline) and isinstance(after, Line | Polyline):
        return
    first = before.at(np.array([before.length]))[1][0]
    second = after.at(np.zeros(1))[1][0]
    kink = abs(float(difference(first, second)))
    if kink > max(KINK, 2e-3 / min(before.length, after.length)):
        log.conflict(where, "change of direction at its start", 0.0, kink, "rad")


def _own_profile(heights: list[Array]) -> Profile | None:
    """The profile of elements that carry heights themselves, all of them."""
    if not heights or not all(len(part) for part in heights):
        return None
    table = np.concatenate(heights)
    keep = np.concatenate([[True], np.diff(table[:, 0]) > 1e-6])
    pvis = [Pvi(float(s), float(z)) for s, z in table[keep]]
    return build("heights of its own points", pvis, lambda *_: None, lambda *_: None)


def _cant(
    element: Any,
    units: Units,
    start: float,
    where: str,
    alignment: Alignment,
    log: Log,
    notes: list[str],
) -> tuple[Cant | None, float]:
    """Its cant, and the gauge it states, NaN when it states none."""
    found = xml.child(element, "Cant")
    cant = None if found is None else read_cant(found, units, start, where, alignment, log)
    if cant is None:
        notes.append("it has no cant: taken as 0")
        return None, math.nan
    if len(cant.s) == 0:
        notes.append("its cant has no stations: taken as 0")
    return cant, cant.gauge


def _coverage(alignment: Alignment, notes: list[str]) -> None:
    if alignment.profile is not None:
        first, last = alignment.profile.range
        if first > 0.1 or last < alignment.length - 0.1:
            notes.append(
                f"its profile covers {max(first, 0.0):.3f} to {min(last, alignment.length):.3f} m "
                f"of {alignment.length:.3f} m; heights are unknown elsewhere"
            )


def _stations(
    element: Any, units: Units, start: float, where: str, log: Log, inframodel: bool
) -> Stations:
    """Equations whose internal station is a number; the others are left out."""
    equations: list[Equation] = []
    for item in xml.children(element, "StaEquation"):
        named = f"{where} / {xml.called(item, xml.clean(item.get('desc')))}"
        keys = ("staInternal", "staBack", "staAhead")
        internal, back, ahead = (_number(item, k, units.linear, named, log) for k in keys)
        if math.isnan(internal):
            internal = ahead if inframodel else math.nan
        if math.isnan(internal):
            log.skip(named, "it has no internal station")
            continue
        equations.append(Equation(internal, back, ahead, xml.clean(item.get("desc"))))
    equations.sort(key=lambda e: e.internal)
    for before, after in pairwise(equations):
        named = f'{where} / StaEquation "{after.name}"'
        if after.ahead == after.internal:  # a kilometre post: back counts from the post before it
            log.check(named, "staBack", after.back, after.internal - before.internal)
        elif math.isfinite(before.ahead):
            back = before.ahead + after.internal - before.internal
            log.check(named, "staBack", after.back, back)
    return Stations(start, tuple(equations))
