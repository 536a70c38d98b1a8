"""What does not move, prepared once for many queries: boxes, hulls, meshes, and clouds of points.

Mäkinen 2021, Section 3.4: static limits are made before operation begins; a cloud of points from a
perception system is a set of its own that is replaced whenever a new one arrives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from backend.collision.kinds import BOXES, POINTS, TRIANGLES
from backend.collision.tree import Tree, curve_order, tree, tree_of_points
from backend.errors import InputError
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import AnyArray, Array, IntArray

Progress: TypeAlias = Callable[[str, float], None]
"""Called with what is being done and the share of it that is done, 0..1."""

_BOX_LEAF, _TRIANGLE_LEAF = 2, 4
_SLACK = 1e-9
"""Hulls must be convex to this, relative to their size."""


@dataclass(frozen=True)
class Surface:
    """A mesh, or a convex hull, in the site frame. vertices: (v, 3) [m]; faces: (f, 3) indices.

    Of a mesh the surface counts; a hull is solid, its faces counter-clockwise seen from outside.
    """

    name: str
    vertices: Array
    faces: AnyArray


@dataclass(frozen=True)
class Items:
    """Items of one kind in a tree. body: (n,) which of the scene's names each belongs to.

    centers (n, 3), rotations (n, 3, 3), half_extents (n, 3): of boxes; corners: (n, 3, 3) of
    triangles; radius: of points, whose middles are the centers [m]; patched: one body, of which the
    closest items on every side of a link count.
    """

    kind: int
    tree: Tree
    centers: Array
    rotations: Array
    half_extents: Array
    corners: Array
    body: IntArray
    radius: float = 0.0
    patched: bool = False

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array, IntArray, float]:
        """What the kernels take."""
        return (
            *(self.centers, self.rotations, self.half_extents, self.corners),
            *(self.body, self.radius),
        )


@dataclass(frozen=True)
class Scene:
    """names: of all bodies; sets: of items, clouds last; hulls: (planes (f, 4) with n . x <= d
    inside, body) of each convex hull; clouds: which set holds the cloud of a name.
    """

    names: tuple[str, ...]
    sets: tuple[Items, ...]
    hulls: tuple[tuple[Array, int], ...] = ()
    clouds: Mapping[str, int] | None = None

    def with_cloud(self, name: str, points: Array, radius: float) -> Scene:
        """This scene with the cloud `name` replaced, or added; all else is shared, not copied.

        points: (n, 3) site frame [m], those that are not finite are left out; radius: of each
        point, at least 0 [m]. Raises InputError for any other shape or radius.
        """
        points = np.asarray(points)
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"cloud {name}: points have shape {points.shape}; allowed is (n, 3).")
        if not (np.isfinite(radius) and radius >= 0.0):
            raise InputError(f"cloud {name}: radius is {radius}; allowed is 0 or more metres.")
        known = dict(self.clouds or {})
        at = known.setdefault(name, len(self.sets))
        names, sets = self.names, list(self.sets)
        body = int(sets[at].body[0]) if at < len(sets) and len(sets[at].body) else -1
        if body < 0:
            body = names.index(name) if name in names else len(names)
            names = names if name in names else (*names, name)
        sets[at : at + 1] = [_points(points, float(radius), body)]
        return replace(self, names=names, sets=tuple(sets), clouds=known)


def scene(
    boxes: Boxes = NO_BOXES,
    names: tuple[str, ...] = (),
    hulls: tuple[Surface, ...] = (),
    meshes: tuple[Surface, ...] = (),
    progress: Progress | None = None,
) -> Scene:
    """Everything that does not move, in the site frame. names: of the boxes, one each.

    Raises InputError for surfaces with wrong shapes or indices, and for hulls that are not convex.
    """
    if len(names) != len(boxes):
        raise ValueError(f"{len(boxes)} boxes have {len(names)} names")
    say = progress or (lambda what, share: None)
    say("boxes", 0.0)
    sets = [_boxes(boxes)] if len(boxes) else []
    bodies, planes, solid, owners = list(names), [], [], []
    for k, surface in enumerate((*hulls, *meshes)):
        say(surface.name, (1 + k) / (1 + len(hulls) + len(meshes)))
        corners, body = _corners(surface), np.full(len(surface.faces), len(bodies), np.int64)
        if k < len(hulls):
            planes.append((_planes(surface, corners), len(bodies)))
            solid.append(corners)
            owners.append(body)
        else:
            sets.append(_triangles(corners, body, patched=True))
        bodies.append(surface.name)
    if solid:
        sets.append(_triangles(np.concatenate(solid), np.concatenate(owners), patched=False))
    say("done", 1.0)
    return Scene(tuple(bodies), tuple(sets), tuple(planes))


def moving(boxes: Boxes, names: tuple[str, ...] = ()) -> Scene:
    """Bodies of a machine where they are now: cheap enough for every cycle. names: one each."""
    return scene(boxes, names or tuple(str(k) for k in range(len(boxes))))


def _boxes(boxes: Boxes) -> Items:
    wide = (np.abs(boxes.rotations) @ boxes.half_extents[:, :, None])[:, :, 0]
    held = tree(boxes.centers - wide, boxes.centers + wide, _BOX_LEAF)
    arrays = boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()
    return Items(BOXES, held, *arrays, np.zeros((0, 3, 3)), np.arange(len(boxes)))


def _triangles(corners: Array, body: IntArray, patched: bool) -> Items:
    held = tree(corners.min(axis=1), corners.max(axis=1), _TRIANGLE_LEAF)
    none = np.zeros((0, 3))
    return Items(TRIANGLES, held, none, np.zeros((0, 3, 3)), none, corners, body, 0.0, patched)


def _points(points: AnyArray, radius: float, body: int) -> Items:
    middles = np.ascontiguousarray(points, dtype=np.float64)
    if not np.isfinite(middles.sum()):
        middles = middles[np.isfinite(middles).all(axis=1)]
    middles = np.take(middles, curve_order(middles, middles), axis=0)
    held = tree_of_points(middles, radius)
    no_box = np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3))
    return Items(POINTS, held, middles, *no_box, np.full(len(middles), body), radius, True)


def _corners(surface: Surface) -> Array:
    vertices, faces = np.asarray(surface.vertices, dtype=np.float64), np.asarray(surface.faces)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise InputError(f"{surface.name}: vertices must be finite numbers of shape (v, 3).")
    whole = np.issubdtype(faces.dtype, np.integer)
    if faces.ndim != 2 or faces.shape[1] != 3 or not whole or not len(faces):
        raise InputError(f"{surface.name}: faces must be one or more whole-number rows of three.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"{surface.name}: faces name vertices {faces.min()} to {faces.max()}; "
            f"allowed are 0 to {len(vertices) - 1}."
        )
    return np.ascontiguousarray(vertices[faces])


def _planes(surface: Surface, corners: Array) -> Array:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    kept = lengths > 1e-12 * size * size
    normals = normals[kept] / lengths[kept, None]
    offsets = np.einsum("fx,fx->f", normals, corners[kept, 0])
    outside = (np.asarray(surface.vertices) @ normals.T - offsets).max(initial=-np.inf)
    if outside > max(_SLACK * size, 1e-9) * 1e3:
        raise InputError(
            f"{surface.name}: a vertex is {outside:.3g} m outside of a face; allowed is a convex "
            "hull with faces counter-clockwise seen from outside."
        )
    return np.concatenate([normals, offsets[:, None]], axis=1)
