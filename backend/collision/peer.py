"""The same scene in python-fcl: a peer for tests and benchmarks, never what decides."""

from __future__ import annotations

from typing import Any

import fcl
import numpy as np

from backend.collision.closest import fcl_box, fcl_distance
from backend.collision.scene import Surface
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array


class FclScene:
    """Boxes, meshes and points as python-fcl objects; a point is a small sphere."""

    def __init__(
        self,
        boxes: Boxes = NO_BOXES,
        meshes: tuple[Surface, ...] = (),
        points: Array | None = None,
        radius: float = 0.0,
    ) -> None:
        self._objects = [
            fcl_box(c, R, h)
            for c, R, h in zip(boxes.centers, boxes.rotations, boxes.half_extents, strict=True)
        ]
        self._objects += [fcl.CollisionObject(_mesh(mesh), fcl.Transform()) for mesh in meshes]
        if points is not None:
            ball = fcl.Sphere(radius)
            self._objects += [
                fcl.CollisionObject(ball, fcl.Transform(np.eye(3), p)) for p in points
            ]
        self._manager: Any = None

    def all_pairs(self, links: Boxes) -> Array:
        """(links,) least distance of each link to all objects, one by one [m]."""
        return np.array(
            [
                min(max(fcl_distance(link, one), 0.0) for one in self._objects)
                for link in _all(links)
            ]
        )

    def least_along(self, half_extents: Array, centers: Array, rotations: Array) -> Array:
        """(m,) least distance of b boxes in m places to all objects, 0 where they touch [m].

        half_extents: (b, 3); centers: (m, b, 3) [m]; rotations: (m, b, 3, 3).
        """
        moved: list[Any] = [
            fcl_box(np.zeros(3), np.eye(3), np.asarray(half)) for half in half_extents
        ]
        still, moving = (fcl.DynamicAABBTreeCollisionManager() for _ in range(2))
        still.registerObjects(self._objects)
        moving.registerObjects(moved)
        still.setup()
        moving.setup()
        found = np.empty(len(centers))
        for m in range(len(centers)):
            for one, center, rotation in zip(moved, centers[m], rotations[m], strict=True):
                one.setTransform(fcl.Transform(rotation, center))
            moving.update()
            data = fcl.DistanceData()
            moving.distance(still, data, fcl.defaultDistanceCallback)
            found[m] = max(float(data.result.min_distance), 0.0)
        return found

    def by_manager(self, links: Boxes) -> Array:
        """(links,) the same by the broad-phase manager, one query for each link [m]."""
        if self._manager is None:
            self._manager = fcl.DynamicAABBTreeCollisionManager()
            self._manager.registerObjects(self._objects)
            self._manager.setup()
        found = []
        for link in _all(links):
            data = fcl.DistanceData()
            self._manager.distance(link, data, fcl.defaultDistanceCallback)
            found.append(max(float(data.result.min_distance), 0.0))
        return np.array(found)


def _all(links: Boxes) -> list[object]:
    arrays = zip(links.centers, links.rotations, links.half_extents, strict=True)
    return [fcl_box(c, R, h) for c, R, h in arrays]


def _mesh(surface: Surface) -> object:
    model = fcl.BVHModel()
    model.beginModel(len(surface.vertices), len(surface.faces))
    model.addSubModel(surface.vertices, surface.faces)
    model.endModel()
    return model
