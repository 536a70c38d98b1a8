"""What `cockpit gauge --json` prints: what a file of drawings or models holds."""

from __future__ import annotations

import math

import numpy as np
from pydantic import BaseModel, Field

from backend.errors import InputError
from backend.gauge.alignment import Alignment
from backend.gauge.elements import Element, Spiral
from backend.gauge.records import Feature, Model, Network, Surface
from backend.spatial.types import Array

MAX_STATIONS = 500_000  # of one document

EastNorth = tuple[float, float]


class CrsModel(BaseModel):
    """The coordinate reference system of all coordinates."""

    epsg: int | None = Field(description="EPSG code; null when nobody names one")
    name: str = Field(description="as the file spells it")
    source: str = Field(description="who decided: site, code, name, or empty")
    heights: str = Field(description="the file's vertical system")


class ElementModel(BaseModel):
    """One element in plan."""

    type: str = Field(description="line, curve, spiral or polyline")
    name: str
    law: str = Field(description="of a spiral, the file's name of it; else empty")
    sta_start: float = Field(description="internal station of its start [m]")
    length: float = Field(description="in plan [m]")
    radius_start: float | None = Field(description="[m], left positive; null where straight")
    radius_end: float | None = Field(description="[m], left positive; null where straight")
    start: EastNorth = Field(description="east, north [m]")
    end: EastNorth = Field(description="east, north [m]")


class PointModel(BaseModel):
    """The alignment at one station; null where the file does not tell."""

    station: float = Field(description="internal station: sta_start plus the distance [m]")
    e: float | None = Field(description="east [m]")
    n: float | None = Field(description="north [m]")
    z: float | None = Field(description="the profile's height [m]")
    heading: float | None = Field(description="counter-clockwise from grid east [rad]")
    gradient: float | None = Field(description="rise over distance in plan")
    cant: float = Field(description="[m], positive when the left rail is the higher one")
    curvature: float | None = Field(description="[1/m], left positive")
    lift: float = Field(description="how far cant raises the middle between the rails above z [m]")


class EquationModel(BaseModel):
    """A station equation, or a kilometre post."""

    name: str
    internal: float = Field(description="internal station [m]")
    back: float | None
    ahead: float | None


class AlignmentModel(BaseModel):
    """One track, road or line."""

    name: str
    description: str
    state: str
    length: float = Field(description="sum of the elements, in plan [m]")
    length_stated: float | None = Field(description="what the file says [m]")
    sta_start: float = Field(description="internal station of the start [m]")
    equations: list[EquationModel]
    gauge: float = Field(description="between the rails [m]")
    gauge_stated: bool = Field(description="whether the file says it")
    rotation_point: str = Field(description="what stays at the profile's height under cant")
    coding: dict[str, str]
    elements: list[ElementModel]
    points: list[PointModel]
    notes: list[str] = Field(description="what was assumed, in words")


class SurfaceModel(BaseModel):
    """One triangle mesh."""

    name: str
    kind: str
    state: str
    points: int
    faces: int = Field(description="visible ones")
    invisible: int = Field(description="faces that the file marks invisible; left out")
    area: float = Field(description="along the slope [m²]")
    plan_area: float = Field(description="from above [m²]")
    breaklines: int
    coding: dict[str, str]


class FeatureModel(BaseModel):
    """One plan feature."""

    name: str
    kind: str
    state: str
    lines: list[list[list[float | None]]] = Field(description="of [east, north, height] [m]")
    points: list[list[float | None]] = Field(description="[east, north, height] [m]")
    length: float = Field(description="of its lines, in plan [m]")
    properties: dict[str, str]


class PipeModel(BaseModel):
    name: str
    kind: str
    start: str
    end: str
    width: float | None = Field(description="clear [m]")
    height: float | None = Field(description="clear [m]")
    length: float = Field(description="[m]")
    points: list[list[float | None]] = Field(description="[east, north, height] [m]")


class StructureModel(BaseModel):
    name: str
    kind: str
    center: list[float | None] = Field(description="[east, north, height] [m]")
    rim: float | None = Field(description="[m]")


class NetworkModel(BaseModel):
    """Pipes and their structures."""

    name: str
    kind: str
    state: str
    structures: list[StructureModel]
    pipes: list[PipeModel]


class SkippedModel(BaseModel):
    what: str = Field(description="element path and line")
    why: str


class ConflictModel(BaseModel):
    """Two of the file's own numbers that disagree."""

    where: str
    what: str
    stated: float | str | None
    used: float | str | None
    unit: str


class GaugeDocument(BaseModel):
    """A file of drawings or models; what `cockpit gauge --json` prints. Lengths in metres, angles
    in radians, positions in the CRS."""

    file: str
    format: str
    project: str
    crs: CrsModel
    alignments: list[AlignmentModel]
    surfaces: list[SurfaceModel]
    features: list[FeatureModel]
    networks: list[NetworkModel]
    skipped: list[SkippedModel] = Field(description="what was not read; and every conflict")
    conflicts: list[ConflictModel]
    notes: list[str]


def gauge_document(model: Model, file: str, step: float = 1.0) -> GaugeDocument:
    """The document of a model, with a point of every alignment each `step` metres and at its end.

    Raises InputError when that were too many.
    """
    if not (math.isfinite(step) and step > 0.0):
        raise InputError(f"--step is {step}; allowed is a positive number of metres.")
    count = sum(alignment.length / step for alignment in model.alignments)
    if count > MAX_STATIONS:
        raise InputError(
            f"--step {step} makes {count:.0f} points; allowed are at most {MAX_STATIONS}."
        )
    skipped = [SkippedModel(what=s.where, why=s.why) for s in model.skipped]
    skipped += [SkippedModel(what=c.where, why=c.words) for c in model.conflicts]
    crs = model.crs
    return GaugeDocument(
        file=file,
        format=model.format,
        project=model.name,
        crs=CrsModel(epsg=crs.epsg, name=crs.name, source=crs.source, heights=crs.heights),
        alignments=[_alignment(a, step) for a in model.alignments],
        surfaces=[_surface(s) for s in model.surfaces],
        features=[_feature(f) for f in model.features],
        networks=[_network(n) for n in model.networks],
        skipped=skipped,
        conflicts=[
            ConflictModel(where=c.where, what=c.what, stated=c.stated, used=c.used, unit=c.unit)
            for c in model.conflicts
        ],
        notes=list(model.notes),
    )


def _alignment(a: Alignment, step: float) -> AlignmentModel:
    steps = np.arange(0.0, a.length, step)
    s = steps if a.length - steps[-1] < 1e-9 else np.append(steps, a.length)
    return AlignmentModel(
        name=a.name,
        description=a.description,
        state=a.state,
        length=a.length,
        length_stated=_known(a.stated_length),
        sta_start=a.stations.start,
        equations=[
            EquationModel(
                name=e.name, internal=e.internal, back=_known(e.back), ahead=_known(e.ahead)
            )
            for e in a.stations.equations
        ],
        gauge=a.gauge,
        gauge_stated=a.gauge_stated,
        rotation_point="" if a.cant is None else a.cant.rotation_point,
        coding=a.coding,
        elements=[
            _element(e, a.stations.start + float(start))
            for e, start in zip(a.elements, a.starts, strict=True)
        ],
        points=_points(a, s),
        notes=list(a.notes),
    )


def _points(a: Alignment, s: Array) -> list[PointModel]:
    line = a.at(s)
    station = s + a.stations.start
    return [
        PointModel(
            station=float(station[k]),
            e=_known(line.xyz[k, 0]),
            n=_known(line.xyz[k, 1]),
            z=_known(line.xyz[k, 2]),
            heading=_known(line.heading[k]),
            gradient=_known(line.gradient[k]),
            cant=float(line.cant[k]),
            curvature=_known(line.curvature[k]),
            lift=float(line.lift[k]),
        )
        for k in range(len(s))
    ]


def _element(element: Element, station: float) -> ElementModel:
    bend = element.at(np.array([0.0, element.length]))[2]
    radii = [None if k == 0.0 else 1.0 / float(k) for k in bend]
    if isinstance(element, Spiral):  # a parabola's own curvature at its end is a little less
        side = float(np.sign(bend[np.argmax(np.abs(bend))]))
        radii = [side * r if math.isfinite(r) else None for r in element.radii]
    return ElementModel(
        type=element.kind,
        name=element.name,
        law=getattr(element, "law", ""),
        sta_start=station,
        length=element.length,
        radius_start=radii[0],
        radius_end=radii[1],
        start=(float(element.start[0]), float(element.start[1])),
        end=(float(element.end[0]), float(element.end[1])),
    )


def _surface(s: Surface) -> SurfaceModel:
    return SurfaceModel(
        name=s.name,
        kind=s.kind,
        state=s.state,
        points=len(s.points),
        faces=len(s.faces),
        invisible=s.invisible,
        area=s.area,
        plan_area=s.plan_area,
        breaklines=len(s.breaklines),
        coding=s.coding,
    )


def _feature(f: Feature) -> FeatureModel:
    return FeatureModel(
        name=f.name,
        kind=f.kind,
        state=f.state,
        lines=[_rows(line) for line in f.lines],
        points=_rows(f.points),
        length=f.length,
        properties=f.properties,
    )


def _network(n: Network) -> NetworkModel:
    return NetworkModel(
        name=n.name,
        kind=n.kind,
        state=n.state,
        structures=[
            StructureModel(
                name=s.name, kind=s.kind, center=_rows(s.center[None])[0], rim=_known(s.rim)
            )
            for s in n.structures
        ],
        pipes=[
            PipeModel(
                name=p.name,
                kind=p.kind,
                start=p.start,
                end=p.end,
                width=_known(p.size[0]),
                height=_known(p.size[1]),
                length=p.length,
                points=_rows(p.points),
            )
            for p in n.pipes
        ],
    )


def _rows(points: Array) -> list[list[float | None]]:
    return [[_known(value) for value in row] for row in points]


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
