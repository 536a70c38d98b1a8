"""Points and triangles for the scene's nodes. Pure; float32, as they go to the browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from cockpit.views.palette import Rgb

Float32 = NDArray[np.float32]
UInt32 = NDArray[np.uint32]

# Faces of a box over the corner order of Boxes.corners (x slowest), seen from outside.
BOX_FACES: UInt32 = np.array(
    [
        *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5)),
        *((0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6)),
        *((0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
    ],
    dtype=np.uint32,
)

# What a node of lines is made with before there is anything to draw.
NO_LINE: Float32 = np.zeros((1, 2, 3), dtype=np.float32)

# The twelve edges of the unit cube, (12, 2, 3).
BOX_EDGES: Float32 = np.array(
    [
        np.roll([[0, u, v], [1, u, v]], axis, axis=1)
        for axis in range(3)
        for u in (0, 1)
        for v in (0, 1)
    ],
    dtype=np.float32,
)


def box_mesh(boxes: Boxes) -> tuple[Float32, UInt32]:
    """Vertices (8n, 3) and faces (12n, 3) of n boxes in their common frame."""
    offsets = 8 * np.arange(len(boxes), dtype=np.uint32)[:, None, None]
    faces = (BOX_FACES + offsets).reshape(-1, 3)
    return boxes.corners().reshape(-1, 3).astype(np.float32), faces


def link_meshes(machine: Machine, link: int) -> list[tuple[Float32, UInt32, Rgb | None]]:
    """One mesh per colour of a link, in the link's frame; its bodies when it has no visuals.

    The colour is None for bodies.
    """
    by_color: dict[Rgb, list[tuple[Array, Any]]] = {}
    for visual in machine.links[link].visuals:
        by_color.setdefault(visual.color, []).append((visual.vertices, visual.faces))
    if by_color:
        return [(*_joined(parts), color) for color, parts in by_color.items()]
    bodies = [k for k, owner in enumerate(machine.body_links) if owner == link]
    return [(*box_mesh(machine.bodies.take(bodies)), None)] if bodies else []


@dataclass(frozen=True)
class LinkLooks:
    """One mesh per colour of a link (see `link_meshes`), and its sharp edges (k, 2, 3) [m]."""

    meshes: list[tuple[Float32, UInt32, Rgb | None]]
    edges: Float32


def link_looks(machine: Machine, link: int) -> LinkLooks:
    """In the link's frame."""
    meshes = link_meshes(machine, link)
    edges = [feature_edges(vertices, faces) for vertices, faces, _ in meshes]
    return LinkLooks(meshes, np.concatenate([NO_LINE[:0], *edges]))


def _joined(parts: list[tuple[Array, Any]]) -> tuple[Float32, UInt32]:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = [np.asarray(faces) + start for (_, faces), start in zip(parts, starts, strict=False)]
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices.astype(np.float32), np.concatenate(faces).astype(np.uint32)


def feature_edges(
    vertices: Float32, faces: UInt32, angle: float = 0.7, shortest: float = 0.06, most: int = 240
) -> Float32:
    """The longest edges (k, 2, 3), k <= most, where the surface turns by over `angle` [rad]."""
    points, merged = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    corners = merged.reshape(-1)[faces]
    first, second, third = np.moveaxis(points[corners].astype(float), 1, 0)
    normals = np.cross(second - first, third - first)
    areas = np.linalg.norm(normals, axis=1)
    corners, normals = corners[areas > 0.0], normals[areas > 0.0] / areas[areas > 0.0, None]
    sides = np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    ends, start, count = np.unique(sides[order], axis=0, return_index=True, return_counts=True)
    start, ends = start[count == 2], ends[count == 2]  # where just two triangles meet
    a, b = normals[order[start] // 3], normals[order[start + 1] // 3]
    sharp = ends[np.einsum("ij,ij->i", a, b) < np.cos(angle)]
    edges = np.asarray(points[sharp], dtype=np.float32)
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    order = np.argsort(-lengths)[:most]
    return edges[order[lengths[order] > shortest]]


def circle(segments: int = 96, dashed: bool = False) -> Float32:
    """The unit circle as line segments (k, 2, 3) at z = 0; dashed leaves out every second."""
    angles = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(segments + 1)])
    lines = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
    return lines[::2] if dashed else lines


def polyline(points: Array, closed: bool, z: float = 0.0) -> Float32:
    """Line segments (k, 2, 3) through points (n, 2)."""
    flat = np.column_stack([points, np.full(len(points), z)])
    ends = np.roll(flat, -1, axis=0) if closed else flat[1:]
    return np.stack([flat if closed else flat[:-1], ends], axis=1).astype(np.float32)


def dashed(ring: Array, on: float, off: float) -> Float32:
    """A closed outline (n, 2), not closed itself, as dashes that bend with it: (k, 2, 3).

    on, off: lengths of dashes and gaps [m], fitted to whole dashes around the outline.
    """
    closed = np.concatenate([ring, ring[:1]])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    if not lengths[-1] > 0.0:
        return np.zeros((0, 2, 3), dtype=np.float32)
    count = max(1, round(lengths[-1] / (on + off)))
    period = lengths[-1] / count
    starts = period * np.arange(count)
    drawn = period * on / (on + off)
    knots = np.unique(np.concatenate([lengths, starts, starts + drawn]))
    knots = knots[np.diff(knots, prepend=-1.0) > 1e-9]
    points = np.column_stack([np.interp(knots, lengths, closed[:, k]) for k in (0, 1)])
    middle = (knots[:-1] + knots[1:]) / 2.0
    return polyline(points, closed=False)[middle % period < drawn]


def rings(geometry: BaseGeometry | None) -> list[Array]:
    """Every outline (n, 2) of the polygons in a geometry, holes too, not closed."""
    found = []
    for part in shapely.get_parts(geometry):
        if isinstance(part, shapely.Polygon) and not part.is_empty:
            found += [np.asarray(ring.coords)[:-1, :2] for ring in (part.exterior, *part.interiors)]
    return found


def filled(polygon: Array) -> tuple[Float32, UInt32]:
    """Triangles of a polygon's inside, normals up: vertices (n, 3) at z = 0, faces (m, 3).

    polygon: (k, 2), not closed; one that crosses itself is repaired first. Nothing for zero area.
    """
    if len(polygon) < 3 or not np.isfinite(polygon).all():
        return _NOTHING
    return filled_geometry(shapely.make_valid(shapely.Polygon(polygon)))


def filled_geometry(shape: BaseGeometry) -> tuple[Float32, UInt32]:
    """Triangles of a valid geometry's polygons, their holes left open; as `filled`."""
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    triangles = triangles[shapely.area(triangles) > 0.0]
    if not len(triangles):
        return _NOTHING
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3].copy()
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < 0.0
    corners[clockwise] = corners[clockwise][:, ::-1]
    flat = np.pad(corners.reshape(-1, 2), ((0, 0), (0, 1)))
    return flat.astype(np.float32), np.arange(len(flat), dtype=np.uint32).reshape(-1, 3)


_NOTHING = np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint32)
