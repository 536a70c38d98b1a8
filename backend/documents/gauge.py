"""What `cockpit gauge --json` prints: what a file of drawings or models holds."""

from __future__ import annotations

from pydantic import BaseModel, Field

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
