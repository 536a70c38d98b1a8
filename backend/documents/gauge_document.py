"""A model of drawings as the document that `cockpit gauge --json` prints."""

from __future__ import annotations

import math

import numpy as np

from backend.documents.gauge import (
    AlignmentModel,
    ConflictModel,
    CrsModel,
    ElementModel,
    EquationModel,
    FeatureModel,
    GaugeDocument,
    NetworkModel,
    PipeModel,
    PointModel,
    SkippedModel,
    StructureModel,
    SurfaceModel,
)
from backend.errors import InputError
from backend.gauge.alignment import Alignment
from backend.gauge.elements import Element, Spiral
from backend.gauge.records import Feature, Model, Network, Surface
from backend.spatial.types import Array

MAX_STATIONS = 500_000  # of one document


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
