"""<Profile> and <Cant> of an alignment."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from backend.gauge import xml_values as xml
from backend.gauge.alignment import Alignment
from backend.gauge.cant import ROTATION_POINTS, Cant
from backend.gauge.log import Log
from backend.gauge.profile import Profile, Pvi, build
from backend.gauge.transitions import DIRECT, INTEGRATED, Law
from backend.gauge.units import Units

NEAR = 1.0  # where the plan is looked at for the side of a cant [m]
KINDS = ("PVI", "CircCurve", "ParaCurve", "UnsymParaCurve")
HIGHEST_CANT = 1.0  # in metres or feet; beyond, the file means millimetres or inches


def read_profiles(
    alignment: Any, units: Units, start: float, where: str, log: Log
) -> tuple[Profile, ...]:
    """All <ProfAlign> of an <Alignment>, whose stations count from `start` [m]."""
    found = []
    for profile in xml.children(alignment, "Profile"):
        for item in xml.children(profile, "ProfAlign"):
            made = _profile(item, units, start, f"{where} / {xml.called(item)}", log)
            if made is not None:
                found.append(made)
    return tuple(found)


def _profile(element: Any, units: Units, start: float, where: str, log: Log) -> Profile | None:
    pvis: list[Pvi] = []
    for item in element:
        kind = xml.local(item)
        if kind in ("Feature", ""):
            continue
        named = f"{where} / {xml.called(item, xml.clean(item.get('desc')))}"
        if kind not in KINDS:
            log.skip(named, f"points of the kind {kind} are not read")
            continue
        try:
            pvis.append(_pvi(item, kind, units, start))
        except ValueError as error:
            log.skip(named, str(error))
    pvis.sort(key=lambda p: p.s)
    rising = [p for i, p in enumerate(pvis) if i == 0 or p.s - pvis[i - 1].s > 1e-6]
    if len(rising) < len(pvis):
        log.skip(where, f"{len(pvis) - len(rising)} points repeat the station before them")

    def called(i: int) -> str:
        return f"{where} / {rising[i].kind} at {rising[i].s + start:.3f}"

    def conflict(i: int, what: str, stated: float, used: float, unit: str) -> None:
        log.conflict(called(i), what, stated, used, unit)

    try:
        return build(
            xml.clean(element.get("name")),
            rising,
            conflict,
            lambda i, why: log.skip(called(i), why),
        )
    except ValueError as error:
        log.skip(where, str(error))
        return None


def _pvi(element: Any, kind: str, units: Units, start: float) -> Pvi:
    values = xml.floats(element.text)
    if len(values) != 2 or not all(math.isfinite(v) for v in values):
        raise ValueError("it has no station and height")
    s, z = values[0] * units.linear - start, values[1] * units.elevation
    if max(abs(s), abs(z)) > xml.LARGEST:
        raise ValueError(f"a number is beyond {xml.LARGEST:g} m")

    def length(key: str) -> float:
        return abs(xml.attribute(element, key, units.linear))

    if kind == "CircCurve":
        return Pvi(s, z, "circle", length("radius"), length("length"))
    if kind == "ParaCurve":
        half = length("length") / 2
        return Pvi(s, z, "parabola", length_in=half, length_out=half)
    if kind == "UnsymParaCurve":
        return Pvi(s, z, "parabola", length_in=length("lengthIn"), length_out=length("lengthOut"))
    return Pvi(s, z)


def read_cant(
    element: Any, units: Units, start: float, where: str, alignment: Alignment, log: Log
) -> Cant | None:
    """<Cant>. A station's sign is that of its curvature, else that of the plan there."""
    where = f"{where} / {xml.called(element)}"
    rows: list[tuple[float, float, Law | None]] = []
    for item in xml.children(element, "CantStation"):
        try:
            rows.append(_station(item, units, start, alignment))
        except ValueError as error:
            log.skip(f"{where} / {xml.called(item)}", str(error))
    rows.sort(key=lambda row: row[0])
    rising = [row for i, row in enumerate(rows) if i == 0 or row[0] > rows[i - 1][0]]
    if len(rising) < len(rows):
        log.skip(where, f"{len(rows) - len(rising)} cant stations repeat the one before them")
    values = np.array([value for _, value, _ in rising])
    small = 0.0254 if units.imperial else 1e-3
    if len(values) and np.abs(values).max() > HIGHEST_CANT * units.linear:
        log.note(f"{where}: cant is read as {'inches' if units.imperial else 'millimetres'}")
        values = values / units.linear * small
    try:
        gauge = abs(xml.attribute(element, "gauge", units.linear))
    except ValueError as error:
        log.skip(where, str(error))
        gauge = math.nan
    if gauge > 10.0 * units.linear:
        gauge = gauge / units.linear * small
    if not 0.3 <= gauge <= 4.0 and math.isfinite(gauge):
        log.skip(where, f"its gauge is {gauge:g} m; allowed is 0.3 to 4")
        gauge = math.nan
    rail = xml.clean(element.get("rotationPoint"))
    if rail not in ROTATION_POINTS:
        read = ", ".join(ROTATION_POINTS[1:])
        log.skip(where, f'its rotationPoint is "{rail}", taken as center; read are {read}')
        rail = ""
    name = xml.clean(element.get("name"))
    laws = tuple(law for _, _, law in rising)
    return Cant(name, gauge, rail, np.array([s for s, _, _ in rising]), values, laws)


def _station(
    element: Any, units: Units, start: float, alignment: Alignment
) -> tuple[float, float, Law | None]:
    """Distance [m], signed cant in metres (or what the file means), and the law behind it."""
    s = xml.attribute(element, "station", units.linear) - start
    value = xml.attribute(element, "appliedCant", units.linear)
    if math.isnan(s) or math.isnan(value):
        raise ValueError("it has no station and applied cant")
    side = {"cw": 1.0, "ccw": -1.0}.get(element.get("curvature", "").strip(), 0.0)
    if side == 0.0 and value != 0.0:
        near = np.clip(s + np.array([-NEAR, 0.0, NEAR]), 0.0, alignment.length)
        bends = np.nan_to_num(alignment.plan(near)[2])
        bend = bends[np.argmax(np.abs(bends))]
        if bend == 0.0:
            raise ValueError("it does not say to which side, nor does the plan bend there")
        side = -math.copysign(1.0, bend)
    if element.get("adverse", "").strip() in ("true", "1"):
        side = -side
    word = element.get("transitionType", "").strip()
    law = INTEGRATED.get(word) or DIRECT.get(word, (None, False))[0]
    return s, side * value, law
