"""<Surface>: triangle meshes and breaklines. Points and faces come one by one, so that a large
surface never stands in memory as a tree."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from backend.errors import InputError
from backend.gauge import xml_values as xml
from backend.gauge.log import Log
from backend.gauge.records import Surface
from backend.gauge.units import Units
from backend.spatial.types import Array

MAX_POINTS = 10_000_000
MAX_FACES = 20_000_000


class SurfaceReader:
    """Collects one surface. `add_point` and `add_face` take <P> and <F> as they end."""

    def __init__(self, units: Units, file: str) -> None:
        self._units, self._file = units, file
        self._rows: dict[str, int] = {}
        self._points: list[tuple[float, float, float]] = []
        self._faces: list[tuple[int, int, int]] = []
        self._invisible = 0
        self._bad: dict[str, tuple[int, int]] = {}

    def add_point(self, element: Any) -> None:
        """A <P> of <Pnts>: "north east height"; one without a height or a number is left out."""
        try:
            values = element.text.split()
            n, e, z = float(values[0]), float(values[1]), float(values[2])
        except (AttributeError, IndexError, ValueError):
            self._complain(element, "points without north, east and height")
            return
        e, n, z = e * self._units.linear, n * self._units.linear, z * self._units.elevation
        if not (abs(e) <= xml.LARGEST and abs(n) <= xml.LARGEST and abs(z) <= xml.LARGEST):
            self._complain(element, f"points that are not numbers or beyond {xml.LARGEST:g} m")
            return
        if len(self._points) >= MAX_POINTS:
            raise InputError(
                f"{self._file}: a surface has more than {MAX_POINTS} points; allowed are fewer."
            )
        self._rows[(element.get("id") or "").strip()] = len(self._points)
        self._points.append((e, n, z))

    def add_face(self, element: Any) -> None:
        """An <F> of <Faces>: three names of points; invisible ones (i="1") are only counted."""
        if (element.get("i") or "").strip() in ("1", "true"):
            self._invisible += 1
            return
        rows = [self._rows.get(word) for word in (element.text or "").split()]
        if len(rows) < 3 or None in rows:
            self._complain(element, "faces whose points are missing")
            return
        corners = [row for row in rows if row is not None]
        if len(self._faces) >= MAX_FACES:
            raise InputError(
                f"{self._file}: a surface has more than {MAX_FACES} faces; allowed are fewer."
            )
        for b, c in pairwise(corners[1:]):
            if len({corners[0], b, c}) < 3:
                self._complain(element, "faces of no area")
            else:
                self._faces.append((corners[0], b, c))

    def finish(self, element: Any, state: str, log: Log) -> Surface | None:
        """The surface at the end of its <Surface>; None when it has neither faces nor lines."""
        where = xml.called(element)
        for why, (count, line) in self._bad.items():
            log.skip(f"{where} (first in line {line})", f"{count} {why}")
        lines = []
        for item in element.iter("{*}Breakline"):
            listed = xml.child(item, "PntList2D", "PntList3D")
            named = f"{where} / {xml.called(item)}"
            if listed is None:
                log.skip(named, "it has no list of points")
                continue
            try:
                lines.append(xml.points(listed, self._units))
            except ValueError as error:
                log.skip(named, str(error))
        if not self._faces and not lines:
            log.skip(where, "it has no faces and no breaklines")
            return None
        points, faces = self._used()
        definition = xml.child(element, "Definition")
        kind = "" if definition is None else xml.clean(definition.get("surfType"))
        surface = Surface(
            name=xml.clean(element.get("name")),
            points=points,
            faces=faces,
            description=xml.clean(element.get("desc")),
            state=xml.clean(element.get("state")) or state,
            kind=kind or ("TIN" if self._faces else "breaklines"),
            invisible=self._invisible,
            breaklines=tuple(lines),
            coding=xml.coding(element),
        )
        self._check_area(where, definition, surface, log)
        return surface

    def _used(self) -> tuple[Array, Any]:
        return (
            np.array(self._points, dtype=float).reshape(-1, 3),
            np.array(self._faces, dtype=np.int64).reshape(-1, 3),
        )

    def _check_area(self, where: str, definition: Any, surface: Surface, log: Log) -> None:
        """Stated areas are of some rounding: they must agree to a thousandth."""
        if definition is None:
            return
        square = self._units.linear**2
        pairs = (("area2DSurf", surface.plan_area), ("area3DSurf", surface.area))
        for key, used in pairs:
            try:
                stated = xml.number(definition.get(key)) * square
            except ValueError as error:
                log.skip(where, f"{key}: {error}")
                continue
            if stated > 0.0 and abs(stated - used) > 1e-3 * stated + 0.01:
                log.conflict(where, key, stated, used, "m²")

    def _complain(self, element: Any, why: str) -> None:
        count, line = self._bad.get(why, (0, element.sourceline))
        self._bad[why] = (count + 1, line)
