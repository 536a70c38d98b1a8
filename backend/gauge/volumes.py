"""Limit volumes: convex pieces of space that no part of a machine may enter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon

from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array, BoolArray, frozen

Kind: TypeAlias = Literal[
    "track", "overhead", "pole", "building", "road", "ceiling", "buried", "keep_out", "keep_in"
]
GRID = 1e-5
"""[m] of the corners of plans."""
KINDS: tuple[str, ...] = get_args(Kind)


@dataclass(frozen=True)
class Hull:
    """A convex polyhedron. vertices: (n, 3) [m]; faces: plane polygons of vertex indices,
    counter-clockwise seen from outside.
    """

    vertices: Array
    faces: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, (None, 3), "vertices"))

    @cached_property
    def planes(self) -> Array:
        """(m, 4): unit normal n and offset c of every face; inside is n x <= c."""
        planes = []
        for face in self.faces:
            ring = self.vertices[list(face)]
            # Newell's normal: sound for sides without length, too.
            normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
            size = float(np.linalg.norm(normal))
            if size > 1e-12:
                normal = normal / size
                planes.append([*normal, float((ring @ normal).max())])
        return np.array(planes).reshape(-1, 4)


@dataclass(frozen=True)
class LimitVolume:
    """What one feature keeps machines from.

    name: unique on the site; kind: of the feature; state: of the feature, "existing"; rule: what
    was applied, in words; boxes: the pieces where `hulls` is empty, else boxes that contain them;
    hulls: the convex pieces where these are no boxes; axis: (k, 3) points of a track's centreline
    [m], which it is off by no more than the tolerance.
    """

    name: str
    kind: Kind
    state: str = "existing"
    rule: str = ""
    boxes: Boxes = NO_BOXES
    hulls: tuple[Hull, ...] = ()
    axis: Array | None = None

    @property
    def box_names(self) -> tuple[str, ...]:
        """ "gauge:T1/0", "gauge:T1/1", ..."""
        return tuple(f"gauge:{self.name}/{k}" for k in range(len(self.boxes)))

    @cached_property
    def sphere(self) -> tuple[Array, float]:
        """Centre (3,) and radius [m] of a sphere around all of it."""
        corners = self.boxes.corners().reshape(-1, 3)
        if not len(corners):
            return np.zeros(3), -np.inf
        center = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        return center, float(np.linalg.norm(corners - center, axis=1).max())

    def contains(self, points: Array, slack: float = 1e-9) -> BoolArray:
        """(n,) which of the points (n, 3) lie in a piece, or within `slack` [m] of its planes."""
        inside = np.zeros(len(points), dtype=bool)
        if self.hulls:
            for hull in self.hulls:
                planes = hull.planes
                inside |= (points @ planes[:, :3].T <= planes[:, 3] + slack).all(axis=1)
            return inside
        for k in range(len(self.boxes)):
            local = (points - self.boxes.centers[k]) @ self.boxes.rotations[k]
            inside |= (np.abs(local) <= self.boxes.half_extents[k] + slack).all(axis=1)
        return inside

    @cached_property
    def plan(self) -> tuple[Polygon, ...]:
        """The volume seen from above, as polygons."""
        corners = [h.vertices for h in self.hulls] or list(self.boxes.corners())
        seen = [MultiPoint(c[:, :2]).convex_hull for c in corners]
        polygons = [s for s in seen if isinstance(s, Polygon)]
        # On a grid, so that neighbours leave no slivers between them.
        parts = shapely.get_parts(shapely.union_all(polygons, grid_size=GRID))
        return tuple(p for p in parts if isinstance(p, Polygon))


def prism(ring: Array, bottom: float, top: float) -> Hull:
    """The upright prism over a convex polygon (k, 2), counter-clockwise, between heights [m]."""
    n = len(ring)
    heights = np.repeat([bottom, top], n)[:, None]
    return stack(np.concatenate([np.tile(ring, (2, 1)), heights], axis=1))


def stack(vertices: Array) -> Hull:
    """A prism of vertices (2 n, 3): a ring and the ring opposite.

    Seen from the second ring's outside, both run counter-clockwise.
    """
    n = len(vertices) // 2
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    return Hull(vertices, (tuple(range(n))[::-1], tuple(range(n, 2 * n)), *sides))


def boxes_around(pieces: Iterable[tuple[Array, Array]]) -> Boxes:
    """The boxes with given axes around points. pieces: (points (n, 3), R (3, 3)) of every box."""
    centers, rotations, halves = [], [], []
    for points, R in pieces:
        local = points @ R
        low, high = local.min(axis=0), local.max(axis=0)
        centers.append(R @ ((low + high) / 2.0))
        rotations.append(R)
        halves.append((high - low) / 2.0)
    if not centers:
        return NO_BOXES
    return Boxes(np.array(centers), np.array(rotations), np.array(halves))
