"""<CoordGeom>: lines, curves, spirals and polylines of an alignment or a plan feature."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from backend.gauge import xml_values as xml
from backend.gauge.elements import Arc, Element, Line, Polyline, Spiral, arc
from backend.gauge.log import ANGLE, Log
from backend.gauge.spirals import DirectSpiral, IntegratedSpiral, Shape
from backend.gauge.transitions import DIRECT, INTEGRATED, UNDEFINED
from backend.gauge.units import Units
from backend.spatial.angles import difference
from backend.spatial.types import Array

SHORTEST = 1e-6  # of an element [m]


class PlanReader:
    """Reads the elements of <CoordGeom>. points: named points (3,) that elements may refer to."""

    def __init__(self, units: Units, points: Mapping[str, Array], log: Log) -> None:
        self._units, self._points, self._log = units, points, log
        self.linear = units.linear

    def read(self, element: Any, where: str) -> tuple[Element, Array] | None:
        """One element and its heights (n, 2) of distance along it and height [m], empty when it
        has none; None when it was left out, which the log says."""
        where = f"{where} / {xml.called(element)}"
        try:
            made = self._made(element, where)
        except ValueError as error:
            self._log.skip(where, str(error))
            return None
        if made is None:
            return None
        found, heights = made
        if not SHORTEST <= found.length <= xml.LARGEST:
            self._log.skip(where, f"its length is {found.length:g} m")
            return None
        return found, heights

    def _made(self, element: Any, where: str) -> tuple[Element, Array] | None:
        kind = xml.local(element)
        if kind == "Line":
            return self._line(element, where)
        if kind == "Curve":
            return self._curve(element, where)
        if kind == "Spiral":
            return self._spiral(element, where)
        if kind in ("IrregularLine", "Chain"):
            return self._polyline(element)
        if kind not in ("Feature", ""):
            raise ValueError(f"elements of the kind {kind} are not read")
        return None

    def _point(self, element: Any, name: str, needed: bool = True) -> Array | None:
        found = xml.child(element, name)
        if found is None:
            if needed:
                raise ValueError(f"it has no <{name}>")
            return None
        reference = xml.clean(found.get("pntRef"))
        try:
            if not (found.text or "").strip() and reference:
                if reference not in self._points:
                    raise ValueError(f'there is no point "{reference}"')
                return self._points[reference]
            return xml.point(found.text, self._units)
        except ValueError as error:
            raise ValueError(f"<{name}>: {error}") from None

    def _ends(self, element: Any) -> tuple[Array, Array]:
        start, end = self._point(element, "Start"), self._point(element, "End")
        assert start is not None
        assert end is not None
        return start, end

    def _length(self, element: Any) -> float:
        return xml.attribute(element, "length", self._units.linear)

    def _direction(self, element: Any, key: str, where: str, found: float, length: float) -> None:
        """Compares a stated direction with the heading `found` [rad]."""
        stated = self._units.bearing(xml.number(element.get(key)))
        if not math.isfinite(stated):
            return
        tolerance = max(ANGLE, 2e-3 / length)  # coordinates are given to millimetres
        self._log.direction(where, key, stated, math.pi / 2 - found, tolerance)

    def _line(self, element: Any, where: str) -> tuple[Element, Array]:
        start, end = self._ends(element)
        line = Line(start[:2], end[:2], xml.clean(element.get("name")))
        if line.length < SHORTEST:
            raise ValueError("its start is its end")
        self._log.check(where, "length", self._length(element), line.length)
        self._direction(element, "dir", where, line.heading, line.length)
        return line, _heights([0.0, line.length], [start[2], end[2]])

    def _curve(self, element: Any, where: str) -> tuple[Element, Array]:
        start, end = self._ends(element)
        center = self._point(element, "Center", needed=False)
        kind = element.get("crvType", "arc").strip()
        if kind != "arc":
            raise ValueError(f'curves of the type "{kind}" are not read')
        stated = xml.radius(element, "radius", self._units.linear)
        plan = None if center is None else center[:2]
        made = arc(start[:2], end[:2], self._left(element), plan, stated)
        made = Arc(made.start, made.heading, made.curvature, made.length, _name(element))
        self._log.check(where, "length", self._length(element), made.length)
        if center is not None:
            self._log.check(where, "radius", stated, made.radius)
            at_start, at_end = math.dist(start[:2], center[:2]), math.dist(end[:2], center[:2])
            self._log.check(where, "distance of the centre from the start", at_start, made.radius)
            self._log.check(where, "distance of the centre from the end", at_end, made.radius)
        chord = xml.attribute(element, "chord", self._units.linear)
        self._log.check(where, "chord", chord, math.dist(start[:2], end[:2]))
        self._direction(element, "dirStart", where, made.heading, made.length)
        turned = made.heading + made.curvature * made.length
        self._direction(element, "dirEnd", where, turned, made.length)
        return made, _heights([0.0, made.length], [start[2], end[2]])

    def _left(self, element: Any) -> bool:
        rot = str(element.get("rot", "")).strip()
        if rot not in ("cw", "ccw"):
            raise ValueError(f'its rot is "{rot}"; allowed are "cw" and "ccw"')
        return rot == "ccw"

    def _spiral(self, element: Any, where: str) -> tuple[Element, Array]:
        start, end = self._ends(element)
        middle = self._point(element, "PI", needed=False)
        radii = [xml.radius(element, f"radius{k}", self._units.linear) for k in ("Start", "End")]
        radii = [math.inf if math.isnan(r) else r for r in radii]
        side = 1.0 if self._left(element) else -1.0
        law = element.get("spiType", "").strip()
        shape = _shape(law, self._spiral_length(element, radii), side / radii[0], side / radii[1])
        name = _name(element)
        made = Spiral(start[:2], end[:2], shape, (radii[0], radii[1]), law, name)
        chord = math.dist(start[:2], end[:2])
        own = math.dist(made.end, start[:2])
        if chord < SHORTEST or own < SHORTEST:
            raise ValueError("its start is its end")
        self._log.check(where, "distance from start to end", chord, own)
        self._constant(element, where, law, radii, made.length)
        _, heading, _ = made.at(np.array([0.0, made.length]))
        self._direction(element, "dirStart", where, float(heading[0]), made.length)
        self._direction(element, "dirEnd", where, float(heading[1]), made.length)
        if middle is not None:
            self._tangents(where, made, start, middle, end, heading)
        return made, _heights([0.0, made.length], [start[2], end[2]])

    def _spiral_length(self, element: Any, radii: list[float]) -> float:
        length = self._length(element)
        if math.isnan(length):
            raise ValueError("it has no length")
        if not SHORTEST < length <= xml.LARGEST:
            raise ValueError(f"its length is {length:g} m")
        if min(radii) < 1e-3:
            raise ValueError(f"its radius is {min(radii):g} m")
        return length

    def _constant(
        self, element: Any, where: str, law: str, radii: list[float], length: float
    ) -> None:
        """A² = L / (1/R_end - 1/R_start) of a clothoid."""
        stated = xml.attribute(element, "constant", self._units.linear)
        change = abs(1 / radii[1] - 1 / radii[0])
        if law == "clothoid" and math.isfinite(stated) and change > 0.0:
            constant = math.sqrt(length / change)
            # A follows from L by half its relative change, so that a millimetre of L is this of A.
            if abs(stated - constant) > max(1e-3, 1e-3 * constant / length):
                self._log.conflict(where, "constant A", stated, constant, "m")

    def _tangents(
        self, where: str, made: Spiral, start: Array, middle: Array, end: Array, heading: Array
    ) -> None:
        """The tangents' intersection that is stated must lie on both tangents."""
        ends = (("start", start, float(heading[0]), 1.0), ("end", end, float(heading[1]), -1.0))
        for which, point, direction, sign in ends:
            way = sign * (middle[:2] - point[:2])
            distance = float(np.hypot(*way))
            if distance < 0.1:
                continue
            stated = math.atan2(way[1], way[0])
            if abs(float(difference(stated, direction))) > max(ANGLE, 2e-3 / distance):
                what = f"direction at the {which}, through PI, from north clockwise"
                found = math.degrees(math.pi / 2 - direction) % 360.0
                degrees = math.degrees(math.pi / 2 - stated) % 360.0
                self._log.conflict(where, what, degrees, found, "degrees")

    def _polyline(self, element: Any) -> tuple[Element, Array]:
        listed = xml.child(element, "PntList2D", "PntList3D")
        if listed is None and (element.text or "").strip():
            raise ValueError("chains of named points are not read")
        rows = [] if listed is None else list(xml.points(listed, self._units))
        start, end = (self._point(element, k, needed=False) for k in ("Start", "End"))
        if start is not None and not (rows and _same(start, rows[0])):
            rows.insert(0, start)
        if end is not None and not (len(rows) > 1 and _same(end, rows[-1])):
            rows.append(end)
        return polyline(np.array(rows).reshape(-1, 3), _name(element))


def polyline(xyz: Array, name: str = "") -> tuple[Polyline, Array]:
    """A polyline through (n, 3) and its heights (m, 2); repeated points count once."""
    if len(xyz) < 2:
        raise ValueError("it has fewer than two points")
    keep = np.concatenate([[True], np.linalg.norm(np.diff(xyz[:, :2], axis=0), axis=1) > SHORTEST])
    line = Polyline(xyz[keep, :2], name)
    if len(line.points) < 2:
        raise ValueError("all its points are one")
    return line, _heights(line.distances, xyz[keep, 2])


def _heights(distances: Any, heights: Any) -> Array:
    """(n, 2); none when a height is missing, or when all are zero, as programs write that draw in
    plan."""
    table = np.stack([np.asarray(distances, dtype=float), np.asarray(heights, dtype=float)], axis=1)
    known = np.isfinite(table).all() and table[:, 1].any()
    return table if known else np.zeros((0, 2))


def _shape(law: str, length: float, k0: float, k1: float) -> Shape:
    if law in INTEGRATED:
        return IntegratedSpiral(INTEGRATED[law], length, k0, k1)
    if law in DIRECT:
        if k0 != 0.0 and k1 != 0.0:
            raise ValueError(f"a {law} between two curves is not defined: one end must be straight")
        bend, over_tangent = DIRECT[law]
        return DirectSpiral(bend, length, k0 or k1, k0 != 0.0, over_tangent)
    if law in UNDEFINED:
        raise ValueError(f'spirals of the type "{law}" are not read: {UNDEFINED[law]}')
    known = ", ".join((*INTEGRATED, *DIRECT))
    raise ValueError(f'its spiType is "{law}"; read are {known}')


def _same(a: Array, b: Array) -> bool:
    return bool(np.hypot(*(a[:2] - b[:2])) <= SHORTEST)


def _name(element: Any) -> str:
    return xml.clean(element.get("name"))
