"""Features of the infrastructure, as readers and site files give them: site frame, metres.

Heights are those of the site frame. `state` is a word such as "existing" or "proposed", see
`backend.gauge.choose`. A feature's own rule replaces the one for all features of its kind.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from backend.gauge.centreline import Centreline
from backend.gauge.frames import Pivot
from backend.spatial.types import Array


@dataclass(frozen=True)
class TrackRule:
    """The envelope of a track, above the tops of its rails.

    profile: (k, 2) polygon, y to the left and z up [m], of the kinematic envelope (EN 14033-2,
    Mäkinen's Fig. 2.2); None for a rectangle. half_width: of the rectangle [m]: 1.845 is Mäkinen's
    example (Section 2.1.2), for curves of 250 to 2000 m. from_rail: [m] from the outer side of the
    nearest rail, instead of half_width (Finland: 2.5). bottom, top: of the rectangle [m].
    widening: [m^2], both sides grow by widening / R in a curve, as 36 / R. pivot: what cant turns
    the envelope about, None to leave it upright. rail_head: the width of a rail's head [m]; the
    gauge and one head are the spacing that cant is measured over.
    """

    half_width: float = 1.845
    from_rail: float | None = None
    bottom: float = 0.0
    top: float = 5.3
    profile: Array | None = None
    widening: float = 0.0
    pivot: Pivot | None = "as_told"
    rail_head: float = 0.072


@dataclass(frozen=True)
class OverheadRule:
    """Distances from a live wire [m]: below it and to its sides (Mäkinen 2021: 1 m and 3 m, 25 kV),
    and above it, where the thesis is silent.
    """

    below: float = 1.0
    beside: float = 3.0
    above: float = 3.0


@dataclass(frozen=True)
class Track:
    """A track along a centreline."""

    line: Centreline
    rule: TrackRule | None = None

    @property
    def name(self) -> str:
        return self.line.name

    @property
    def state(self) -> str:
        return self.line.state


@dataclass(frozen=True)
class Overhead:
    """A wire through points (k, 3) [m]. sag: of the middle of each span below its chord [m]."""

    name: str
    points: Array
    state: str = "existing"
    sag: float = 0.0
    rule: OverheadRule | None = None


@dataclass(frozen=True)
class Pole:
    """An upright round pole. base: (3,) [m]; radius, height [m]; clearance: kept around it [m]."""

    name: str
    base: Array
    radius: float
    height: float
    state: str = "existing"
    clearance: float | None = None


@dataclass(frozen=True)
class Area:
    """An upright body over a polygon. polygon: (k, 2) corners in order; bottom, top: heights;
    clearance: kept around it, not above and below [m].
    """

    name: str
    kind: Literal["building", "road", "keep_out"]
    polygon: Array
    bottom: float
    top: float
    state: str = "existing"
    clearance: float | None = None


@dataclass(frozen=True)
class KeepIn:
    """Machines stay over the polygon (k, 2), between bottom and top where these are given [m]."""

    name: str
    polygon: Array
    bottom: float | None = None
    top: float | None = None
    state: str = "existing"


@dataclass(frozen=True)
class Ceiling:
    """Nothing rises above `height` [m]. polygon: (k, 2) where that holds; None for everywhere."""

    name: str
    height: float
    polygon: Array | None = None
    state: str = "existing"


@dataclass(frozen=True)
class Buried:
    """A pipe or cable in the ground along points (k, 3) of its middle [m]; clearance: kept around
    it [m].
    """

    name: str
    points: Array
    diameter: float
    state: str = "existing"
    clearance: float | None = None


Feature: TypeAlias = Track | Overhead | Pole | Area | KeepIn | Ceiling | Buried
