"""What a file of drawings or models holds, as plain records.

Coordinates are (east, north, up) in metres in the file's projected CRS, whatever the file's order
and units. A height that the file does not give is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backend.gauge.alignment import Alignment
from backend.spatial.types import Array, IntArray


@dataclass(frozen=True)
class Skipped:
    """Something that was not read. where: element path and line; why: in words."""

    where: str
    why: str


@dataclass(frozen=True)
class Conflict:
    """Two of a file's own numbers that disagree. stated is what an attribute says, used is what the
    geometry gives and what is used."""

    where: str
    what: str
    stated: float | str
    used: float | str
    unit: str = ""

    @property
    def words(self) -> str:
        """Both numbers in one sentence."""
        return (
            f"{self.what}: stated {_show(self.stated)}, used {_show(self.used)} {self.unit}".strip()
        )


@dataclass(frozen=True)
class Crs:
    """The coordinate reference system. epsg: None when nobody names one; source: "site", "name",
    "code" or "" ; name: as the file spells it; heights: its vertical system."""

    epsg: int | None = None
    name: str = ""
    source: str = ""
    heights: str = ""


@dataclass(frozen=True)
class Surface:
    """A triangle mesh. points: (n, 3) [m]; faces: (m, 3) rows of points, invisible ones left out.

    breaklines: polylines (k, 3) [m]; invisible: how many faces the file marks so; kind: how it
    is called in the file (TIN, grid, mesh, an IFC class).
    """

    name: str
    points: Array
    faces: IntArray
    description: str = ""
    state: str = ""
    kind: str = ""
    invisible: int = 0
    breaklines: tuple[Array, ...] = ()
    coding: dict[str, str] = field(default_factory=dict)

    @property
    def area(self) -> float:
        """Of the visible faces, along the slope [m²]."""
        return float(np.linalg.norm(self._crosses(), axis=1).sum() / 2)

    @property
    def plan_area(self) -> float:
        """Of the visible faces, seen from above [m²]; faces above each other count twice."""
        return float(np.abs(self._crosses()[:, 2]).sum() / 2)

    def _crosses(self) -> Array:
        corners = self.points[self.faces]
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@dataclass(frozen=True)
class Feature:
    """A plan feature: a cable, fence, railing, footing or anything else given by lines or points.

    kind: "cable", "footing", "railing", "fence", "surfaceStructure", "planfeature", another word
    of the file, "points" for a group of surveyed points, or ""; lines: polylines (k, 3) [m];
    points: (n, 3) single points [m]; properties: the file's own, each as "extension.label".
    """

    name: str
    kind: str
    lines: tuple[Array, ...] = ()
    points: Array = field(default_factory=lambda: np.zeros((0, 3)))
    description: str = ""
    state: str = ""
    properties: dict[str, str] = field(default_factory=dict)

    @property
    def length(self) -> float:
        """Of all its lines, in plan [m]."""
        steps = (np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1) for line in self.lines)
        return float(sum(step.sum() for step in steps))


@dataclass(frozen=True)
class Structure:
    """A node of a pipe network: a well, an inlet, an outlet or a connection.

    center: (3,) [m], at the sump; rim: height of the rim or NaN; size: (length, width) in plan, a
    diameter twice for a round one, (0, 0) for what has none [m].
    """

    name: str
    kind: str
    center: Array
    rim: float
    size: tuple[float, float]
    state: str = ""


@dataclass(frozen=True)
class Pipe:
    """A pipe between two structures. points: (n, 3) [m] at the inverts where these are given;
    size: (width, height) of the clear cross-section [m], NaN when not stated; thickness: of the
    wall, 0 when not stated [m]."""

    name: str
    kind: str
    start: str
    end: str
    points: Array
    size: tuple[float, float]
    thickness: float = 0.0
    state: str = ""

    @property
    def length(self) -> float:
        """Along its points [m]; in plan where a height is missing."""
        steps = np.diff(self.points, axis=0)
        return float(np.linalg.norm(np.nan_to_num(steps), axis=1).sum())


@dataclass(frozen=True)
class Network:
    """Pipes and their structures. kind: sanitary, storm, water, cable, ..."""

    name: str
    kind: str
    structures: tuple[Structure, ...]
    pipes: tuple[Pipe, ...]
    description: str = ""
    state: str = ""


@dataclass(frozen=True)
class Model:
    """All that was read of one file. notes: what was assumed, in words."""

    name: str
    format: str
    crs: Crs = field(default_factory=Crs)
    alignments: tuple[Alignment, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    features: tuple[Feature, ...] = ()
    networks: tuple[Network, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    conflicts: tuple[Conflict, ...] = ()
    notes: tuple[str, ...] = ()


def _show(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}" if abs(value) < 1 else f"{value:.4f}"
