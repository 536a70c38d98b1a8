"""The exact envelope of a track, by rotation matrices: what pieces are compared with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import Point, Polygon
from track_curves import Curve

from backend.gauge.features import TrackRule
from backend.spatial.rotation import from_attitude
from backend.spatial.types import Array


@dataclass(frozen=True)
class Envelope:
    """Of `polygon` (y, z), which may have any shape, along `line`."""

    line: Curve
    polygon: Polygon
    rule: TrackRule

    def frame(self, s: float) -> tuple[Array, Array]:
        """Origin (3,) and R (3, 3), columns ahead, left, up, of the tilted cross-section."""
        at = self.line.at(np.array([s]))
        pitch = np.arctan(at.gradient[0])
        level = from_attitude(at.heading[0], pitch)
        spacing = self.line.gauge + self.rule.rail_head
        roll = np.arcsin(at.cant[0] / spacing) if self.rule.pivot else 0.0
        tilted = from_attitude(at.heading[0], pitch, roll)
        pivot = np.zeros(3)
        if self.rule.pivot in ("low_rail", "as_told"):
            pivot[1] = -np.sign(at.cant[0]) * spacing / 2.0
        return at.xyz[0] + level @ pivot - tilted @ pivot, tilted

    def section(self, s: float) -> Polygon:
        """The cross-section, widened: the union of many shifted copies and what is between."""
        e = self.rule.widening * abs(self.line.at(np.array([s])).curvature[0])
        if e == 0.0:
            return self.polygon
        parts = []
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(self.polygon)):
            moved = [affinity.translate(triangle, way * e) for way in (-1, 1)]
            parts.append(shapely.union_all(moved).convex_hull)
        found = shapely.union_all(parts)
        assert isinstance(found, Polygon)
        return found

    def points(self, count: int, rng: np.random.Generator) -> Array:
        """(n, 3) random points, and for every station the section's corners."""
        found = []
        for s in rng.uniform(0.0, self.line.length, count):
            origin, R = self.frame(s)
            section = self.section(s)
            low_y, low_z, high_y, high_z = section.bounds
            inner = rng.uniform([low_y, low_z], [high_y, high_z], (20, 2))
            inner = inner[shapely.contains_xy(section, inner)]
            yz = np.concatenate([inner, np.array(section.exterior.coords)[:-1]])
            found.append(origin + yz @ R[:, 1:].T)
        return np.concatenate(found)

    def distance(self, point: Array) -> float:
        """No less than that of a point from the envelope: in the plane of a station."""
        s = np.linspace(0.0, self.line.length, 400)
        near = int(np.linalg.norm(self.line.at(s).xyz - point, axis=1).argmin())
        low, high = s[max(near - 2, 0)], s[min(near + 2, len(s) - 1)]
        for _ in range(50):
            middle = (low + high) / 2.0
            origin, R = self.frame(middle)
            low, high = (middle, high) if R[:, 0] @ (point - origin) > 0.0 else (low, middle)
        origin, R = self.frame(low)
        ahead, y, z = R.T @ (point - origin)
        return float(np.hypot(ahead, self.section(low).distance(Point(y, z))))
