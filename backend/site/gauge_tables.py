"""Tables of a site file on the working gauge: features with their coordinates, and their rules.

Positions are in the site's projected CRS, heights in its vertical datum. What is not given has the
defaults of `backend.gauge.rules`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from backend.site.base import Name, NotNegative, Positive, Table, Vector

Point: TypeAlias = tuple[float, float]
State: TypeAlias = Annotated[str, Field(min_length=1, max_length=32)]
Line: TypeAlias = Annotated[tuple[Vector, ...], Field(min_length=2)]
Polygon: TypeAlias = Annotated[tuple[Point, ...], Field(min_length=3)]


class TrackEnvelope(Table):
    """See backend.gauge.features.TrackRule. One of half_width, from_rail and profile."""

    half_width: Positive | None = None
    from_rail: NotNegative | None = None
    profile: Polygon | None = None
    bottom: float | None = None
    top: float | None = None
    widening: NotNegative | None = None
    pivot: Literal["as_told", "low_rail", "centre", "none"] | None = None
    rail_head: Positive | None = None

    @model_validator(mode="after")
    def _one_width(self) -> TrackEnvelope:
        given = [n for n in ("half_width", "from_rail", "profile") if getattr(self, n) is not None]
        if len(given) > 1:
            raise ValueError(f"gives {' and '.join(given)}; allowed is one of them")
        return self


class WireDistances(Table):
    """See backend.gauge.features.OverheadRule."""

    below: NotNegative | None = None
    beside: Positive | None = None
    above: NotNegative | None = None


class GaugeRules(Table):
    """For all features of a kind; see backend.gauge.rules.Rules. Clearances in metres."""

    track: TrackEnvelope = TrackEnvelope()
    overhead: WireDistances = WireDistances()
    pole: NotNegative | None = None
    building: NotNegative | None = None
    road: NotNegative | None = None
    keep_out: NotNegative | None = None
    buried: NotNegative | None = None
    excess: Positive | None = None
    boxes: Annotated[int, Field(ge=1, le=100)] | None = None
    depth: Positive | None = None


class GaugeSource(Table):
    """A file of features, such as LandXML. file: relative to the site file; epsg: of its CRS, where
    the file names none or names it wrongly: the site's.

    tracks, buried, overhead, poles: patterns such as "*" or "OHL*" for the names, or kinds, of what
    counts as such: alignments; pipes, cables and other lines; wires; points. Of what matches
    several the first of buried, overhead and poles counts. height: of stations of a track whose own
    height is not known; diameter: of lines that state none; pole_radius, pole_height [m].
    """

    file: Annotated[str, Field(min_length=1)]
    epsg: int | None = None
    tracks: tuple[str, ...] = ("*",)
    buried: tuple[str, ...] = ("pipe", "cable")
    overhead: tuple[str, ...] = ()
    poles: tuple[str, ...] = ()
    height: float | None = None
    diameter: Positive = 0.1
    pole_radius: Positive = 0.2
    pole_height: Positive = 9.0


class _Feature(Table):
    name: Name
    state: State = "existing"


class GaugeTrack(TrackEnvelope):
    """A smooth line through points midway between the rails, at their tops. cant: one, or one for
    every point, positive where the left rail is the higher one [m]; gauge [m].
    """

    name: Name
    state: State = "existing"
    points: Line
    cant: Annotated[tuple[float, ...], Field(min_length=1)] = (0.0,)
    gauge: Positive = 1.435

    @model_validator(mode="after")
    def _cants(self) -> GaugeTrack:
        if len(self.cant) not in (1, len(self.points)):
            raise ValueError(
                f"cant has {len(self.cant)} entries; allowed is one, or one for each of the "
                f"{len(self.points)} points"
            )
        return self


class GaugeOverhead(WireDistances):
    """A wire through points; sag: of every span's middle below its chord [m]."""

    name: Name
    state: State = "existing"
    points: Line
    sag: NotNegative = 0.0


class GaugePole(_Feature):
    """base: of its middle, on the ground."""

    base: Vector
    radius: Positive
    height: Positive
    clearance: NotNegative | None = None


class GaugeArea(_Feature):
    """A building, a road or a keep-out area. bottom, top: heights."""

    polygon: Polygon
    bottom: float
    top: float
    clearance: NotNegative | None = None

    @model_validator(mode="after")
    def _ordered(self) -> GaugeArea:
        _check_order(self.bottom, self.top)
        return self


class GaugeKeepIn(_Feature):
    """Machines stay over the polygon, and between the heights bottom and top where given."""

    polygon: Polygon
    bottom: float | None = None
    top: float | None = None

    @model_validator(mode="after")
    def _ordered(self) -> GaugeKeepIn:
        if self.bottom is not None and self.top is not None:
            _check_order(self.bottom, self.top)
        return self


class GaugeCeiling(_Feature):
    """Nothing rises above `height`: over the polygon, or everywhere."""

    name: Name = "ceiling"
    height: float
    polygon: Polygon | None = None


class GaugeBuried(_Feature):
    """A pipe or cable; points: of its middle."""

    points: Line
    diameter: Positive
    clearance: NotNegative | None = None


class Gauge(Table):
    """The working gauge of a site. tolerance: of volumes [m]; radius: about the site's origin,
    beyond which tracks and wires do not matter [m]; on, off: features by name that hold whatever
    their state, or not at all.
    """

    tolerance: Annotated[float, Field(ge=0.001, le=1.0)] | None = None
    radius: Positive | None = None
    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()
    rules: GaugeRules = GaugeRules()
    source: tuple[GaugeSource, ...] = ()
    track: tuple[GaugeTrack, ...] = ()
    overhead: tuple[GaugeOverhead, ...] = ()
    pole: tuple[GaugePole, ...] = ()
    building: tuple[GaugeArea, ...] = ()
    road: tuple[GaugeArea, ...] = ()
    keep_out: tuple[GaugeArea, ...] = ()
    keep_in: tuple[GaugeKeepIn, ...] = ()
    ceiling: GaugeCeiling | None = None
    buried: tuple[GaugeBuried, ...] = ()

    @property
    def names(self) -> Iterator[str]:
        """Of all features of the tables."""
        yield from (track.name for track in self.track)
        yield from (wire.name for wire in self.overhead)
        areas = (*self.building, *self.road, *self.keep_out, *self.keep_in)
        others: tuple[_Feature, ...] = (*self.pole, *areas, *self.buried)
        yield from (feature.name for feature in others)
        if self.ceiling is not None:
            yield self.ceiling.name

    @model_validator(mode="after")
    def _distinct(self) -> Gauge:
        seen: set[str] = set()
        for name in self.names:
            if name in seen:
                raise ValueError(f'has the name "{name}" twice; allowed is a unique name')
            seen.add(name)
        both = sorted(set(self.on) & set(self.off))
        if both:
            raise ValueError(f'has "{both[0]}" in on and in off; allowed is one of them')
        return self


def _check_order(bottom: float, top: float) -> None:
    if bottom >= top:
        raise ValueError(f"top is {top}; allowed is more than bottom ({bottom})")
