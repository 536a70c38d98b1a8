"""The elements of a LandXML document as they end: what each one adds to the model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from lxml import etree

from backend.errors import InputError
from backend.gauge import xml_values as xml
from backend.gauge.alignment import Alignment
from backend.gauge.crs import resolve
from backend.gauge.landxml_alignment import read_alignment
from backend.gauge.landxml_features import read_feature, read_network
from backend.gauge.landxml_terrain import SurfaceReader
from backend.gauge.log import Log
from backend.gauge.records import Feature, Model, Network, Surface
from backend.gauge.units import Units, units_of
from backend.spatial.types import Array

MAX_NAMED_POINTS = 2_000_000
SILENT = (
    *("LandXML", "Units", "Project", "Application", "FeatureDictionary", "Feature", "Metadata"),
    *("CoordinateSystem", "CgPoints", "Alignments", "Surfaces", "PlanFeatures", "PipeNetworks"),
    *("Roadways", "LocalCoordinateTransformation"),
)
PARENTS = {"P": "Pnts", "F": "Faces"}


class DocumentReader:
    """Takes the parser's events one by one; `finish` gives the model."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._log = Log()
        self._units: Units | None = None
        self._inframodel = False
        self._format = ""
        self._crs = ("", "", "")
        self._points: dict[str, Array] = {}
        self._groups: list[list[Array]] = []  # of points, one for each <CgPoints> that is open
        self._surface: SurfaceReader | None = None
        self._alignments: list[Alignment] = []
        self._surfaces: list[Surface] = []
        self._features: list[Feature] = []
        self._networks: list[Network] = []
        self._depth = 0
        self._project = ""
        self._ends: dict[str, Callable[[Any], None]] = {
            "Units": self._read_units,
            "CoordinateSystem": self._read_crs,
            "Project": self._read_project,
            "FeatureDictionary": self._read_dictionary,
            "CgPoint": self._read_point,
            "CgPoints": self._read_group,
            "Alignment": self._read_alignment,
            "Surface": self._read_surface,
            "PlanFeature": self._read_feature,
            "PipeNetwork": self._read_network,
        }

    def on(self, event: str, element: Any) -> None:
        """One event of the parser."""
        name = xml.local(element)
        if event == "start":
            self._depth += 1
            if self._depth == 1:
                self._root(element)
            elif name == "CgPoints":
                self._groups.append([])
            elif name == "Surface":
                self._surface = SurfaceReader(self.units, self._file)
            return
        self._depth -= 1
        if self._surface is not None and name in PARENTS:
            if xml.local(element.getparent()) == PARENTS[name]:
                (self._surface.add_point if name == "P" else self._surface.add_face)(element)
                _forget(element)
        elif name in self._ends:
            self._ends[name](element)
            element.clear()
        elif self._depth == 1 and name not in SILENT:
            self._log.note(f"{name} is not read")
            element.clear()

    @property
    def units(self) -> Units:
        if self._units is None:
            self._log.note("no <Units> before the geometry: metres and radians are assumed")
            self._units = Units()
        return self._units

    def finish(self, epsg: int | None) -> Model:
        """The model at the end of the document."""
        self._log.settle_directions()
        code, name, heights = self._crs
        crs, conflicts = resolve(code, name, heights, epsg, self._extent())
        for c in conflicts:
            self._log.conflict(c.where, c.what, c.stated, c.used)
        if crs.epsg is None:
            self._log.note("the file names no CRS that is known")
        return Model(
            name=self._project,
            format=self._format,
            crs=crs,
            alignments=tuple(self._alignments),
            surfaces=tuple(self._surfaces),
            features=tuple(self._features),
            networks=tuple(self._networks),
            skipped=self._log.skipped,
            conflicts=self._log.conflicts,
            notes=self._log.notes,
        )

    def _root(self, element: Any) -> None:
        if element.getroottree().docinfo.doctype:
            raise InputError(
                f"{self._file}: has a document type declaration; allowed is LandXML without one."
            )
        if xml.local(element) != "LandXML":
            raise InputError(
                f"{self._file}: its root is <{xml.local(element)}>; allowed is <LandXML>."
            )
        space = etree.QName(element).namespace or ""
        version = xml.clean(element.get("version"))
        self._inframodel = "inframodel" in space.lower()
        self._format = f"{'Inframodel' if self._inframodel else 'LandXML'} {version}".strip()
        if not self._inframodel and "landxml" not in space.lower():
            self._log.note(f'its namespace "{space}" is not known; read as LandXML')

    def _read_units(self, element: Any) -> None:
        found = xml.child(element, "Metric", "Imperial")
        if found is None:
            self._log.skip(xml.called(element), "it has neither <Metric> nor <Imperial>")
            return
        imperial = xml.local(found) == "Imperial"
        if self._units is not None:
            self._log.skip(xml.called(element), "units come after geometry or twice")
            return
        attributes = {str(k): xml.clean(str(v)) for k, v in found.attrib.items()}
        self._units, complaints = units_of(attributes, imperial)
        for words in complaints:
            self._log.skip(xml.called(found), words)

    def _read_crs(self, element: Any) -> None:
        name = next(
            (
                xml.clean(element.get(k))
                for k in ("name", "horizontalCoordinateSystemName", "desc")
                if xml.clean(element.get(k))
            ),
            "",
        )
        heights = xml.clean(element.get("verticalCoordinateSystemName"))
        self._crs = (xml.clean(element.get("epsgCode")), name, heights)
        turn = xml.clean(element.get("rotationAngle"))
        try:
            turned = xml.number(turn) not in (0.0,) and bool(turn)
        except ValueError:
            turned = True
        if turned:
            self._log.skip(xml.called(element), f"rotationAngle {turn} is not applied")

    def _read_project(self, element: Any) -> None:
        self._project = xml.clean(element.get("name"))

    def _read_dictionary(self, element: Any) -> None:
        """Inframodel's version stands here; the root's is LandXML's."""
        version = xml.clean(element.get("version"))
        if xml.clean(element.get("name")).lower() == "inframodel" and version:
            self._inframodel = True
            self._format = f"Inframodel {version}"

    def _read_point(self, element: Any) -> None:
        name = xml.clean(element.get("name"))
        if not (element.text or "").strip():
            return  # refers to another
        if len(self._points) >= MAX_NAMED_POINTS:
            raise InputError(
                f"{self._file}: has more than {MAX_NAMED_POINTS} named points; allowed are fewer."
            )
        try:
            point = xml.point(element.text, self.units)
        except ValueError as error:
            self._log.skip(xml.called(element), str(error))
            return
        self._points[name or f"line {element.sourceline}"] = point
        if self._groups:
            self._groups[-1].append(point)

    def _read_group(self, element: Any) -> None:
        """Surveyed points, such as light poles; groups within groups are features of their own."""
        points = self._groups.pop()
        if not points:
            return
        self._features.append(
            Feature(
                name=xml.clean(element.get("name")),
                kind="points",
                points=np.array(points),
                description=xml.clean(element.get("desc")),
                state=xml.clean(element.get("state")),
                properties=xml.properties(element),
            )
        )

    def _read_alignment(self, element: Any) -> None:
        made = read_alignment(
            element,
            self.units,
            self._points,
            self._log,
            inframodel=self._inframodel,
            state=_state(element),
        )
        if made is not None:
            self._alignments.append(made)

    def _read_surface(self, element: Any) -> None:
        if self._surface is not None:
            made = self._surface.finish(element, _state(element), self._log)
            if made is not None:
                self._surfaces.append(made)
        self._surface = None

    def _read_feature(self, element: Any) -> None:
        made = read_feature(element, self.units, self._points, self._log, _state(element))
        if made is not None:
            self._features.append(made)

    def _read_network(self, element: Any) -> None:
        made = read_network(element, self.units, self._log, _state(element))
        if made is not None:
            self._networks.append(made)

    def _extent(self) -> Array:
        """A few points (n, 2) of what was read."""
        found = [a.elements[0].start for a in self._alignments]
        found += [s.points[0, :2] for s in self._surfaces if len(s.points)]
        found += [f.lines[0][0, :2] for f in self._features if f.lines]
        found += [f.points[0, :2] for f in self._features if len(f.points)]
        found += [n.structures[0].center[:2] for n in self._networks if n.structures]
        return np.array(found).reshape(-1, 2)


def _state(element: Any) -> str:
    """Of the collection that holds the element."""
    parent = element.getparent()
    return "" if parent is None else xml.clean(parent.get("state"))


def _forget(element: Any) -> None:
    """Frees the element and the siblings before it, which the parser needs no more."""
    element.clear()
    before = element.getprevious()
    if before is not None:
        element.getparent().remove(before)
