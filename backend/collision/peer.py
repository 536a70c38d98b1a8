"""The same scene in python-fcl: a peer for tests and benchmarks, never what decides."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any

import fcl
import numpy as np

from backend.collision.closest import fcl_box, fcl_distance
from backend.collision.scene import Surface
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array, IntArray

_OVER = 0.1
"""More than python-fcl over-estimates a distance by now and then [m]: 72 mm were seen for a beam of
6 m, less than 0.1 mm for 17,560 pairs of machines' bodies and random boxes."""


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

    def least_along(self, boxes: Boxes, frames: IntArray, T: Array) -> float:
        """The least distance of moving boxes to all objects in m places, 0 where they touch [m].

        boxes: b, fixed in frames[k] of (m, f, 4, 4) T. A place is left out where it cannot be the
        least: no distance changes by more than the box has moved since.
        """
        centers = _centers(boxes, frames, T)
        # Two rotations differ by a chord of 2 sin(angle / 2) = |R - R'| / sqrt(2).
        R = T[:, :, :3, :3]
        chords = np.sqrt(np.maximum(3.0 - np.einsum("mfij,mfij->mf", R[:-1], R[1:]), 0.0))
        step = np.diff(centers, axis=0)
        moved = np.sqrt(np.einsum("mbi,mbi->mb", step, step))
        moved += np.linalg.norm(boxes.half_extents, axis=1) * chords[:, frames]
        along = np.concatenate([np.zeros((1, len(boxes))), np.cumsum(moved, axis=0)])
        objects, manager = _all_at_origin(boxes), self._made()

        def distance(place: int, box: int) -> float:
            rotation = R[place, frames[box]] @ boxes.rotations[box]
            objects[box].setTransform(fcl.Transform(rotation, centers[place, box]))
            data = fcl.DistanceData()
            manager.distance(objects[box], data, fcl.defaultDistanceCallback)
            return max(float(data.result.min_distance), 0.0)

        least, gaps = np.inf, list[tuple[float, int, int, float, int, float]]()

        def between(box: int, i: int, before: float, j: int, after: float) -> None:
            if j > i + 1:
                way = float(along[j, box] - along[i, box])
                bound = 0.5 * (before + after - way) - _OVER
                heappush(gaps, (bound, box, i, before, j, after))

        last = len(T) - 1
        for box in range(len(boxes)):
            ends = distance(0, box), distance(last, box)
            least = min(least, *ends)
            between(box, 0, ends[0], last, ends[1])
        while gaps and gaps[0][0] < least:
            _, box, i, before, j, after = heappop(gaps)
            lowest = 0.5 * (before - after + along[i, box] + along[j, box])
            k = int(np.searchsorted(along[:, box], lowest))
            k = min(max(k, i + 1), j - 1)
            d = distance(k, box)
            least = min(least, d)
            between(box, i, before, k, d)
            between(box, k, d, j, after)
        return float(least)

    def each_along(self, boxes: Boxes, frames: IntArray, T: Array) -> Array:
        """(m,) the same of each place, all of them asked for."""
        centers = _centers(boxes, frames, T)
        rotations = T[:, frames, :3, :3] @ boxes.rotations
        objects, moving = _all_at_origin(boxes), fcl.DynamicAABBTreeCollisionManager()
        moving.registerObjects(objects)
        moving.setup()
        still, found = self._made(), np.empty(len(T))
        for m in range(len(T)):
            for one, center, rotation in zip(objects, centers[m], rotations[m], strict=True):
                one.setTransform(fcl.Transform(rotation, center))
            moving.update()
            data = fcl.DistanceData()
            moving.distance(still, data, fcl.defaultDistanceCallback)
            found[m] = max(float(data.result.min_distance), 0.0)
        return found

    def by_manager(self, links: Boxes) -> Array:
        """(links,) the same by the broad-phase manager, one query for each link [m]."""
        manager, found = self._made(), []
        for link in _all(links):
            data = fcl.DistanceData()
            manager.distance(link, data, fcl.defaultDistanceCallback)
            found.append(max(float(data.result.min_distance), 0.0))
        return np.array(found)

    def _made(self) -> Any:
        if self._manager is None:
            self._manager = fcl.DynamicAABBTreeCollisionManager()
            self._manager.registerObjects(self._objects)
            self._manager.setup()
        return self._manager


def _centers(boxes: Boxes, frames: IntArray, T: Array) -> Array:
    """(m, b, 3) of boxes that are fixed in frames (m, f, 4, 4)."""
    out = np.empty((len(T), len(boxes), 3))
    for frame in np.unique(frames):
        own = frames == frame
        out[:, own] = boxes.centers[own] @ T[:, frame, :3, :3].swapaxes(1, 2)
        out[:, own] += T[:, frame, None, :3, 3]
    return out


def _all_at_origin(boxes: Boxes) -> list[Any]:
    return [fcl_box(np.zeros(3), np.eye(3), np.asarray(half)) for half in boxes.half_extents]


def _all(links: Boxes) -> list[object]:
    arrays = zip(links.centers, links.rotations, links.half_extents, strict=True)
    return [fcl_box(c, R, h) for c, R, h in arrays]


def _mesh(surface: Surface) -> object:
    model = fcl.BVHModel()
    model.beginModel(len(surface.vertices), len(surface.faces))
    model.addSubModel(surface.vertices, surface.faces)
    model.endModel()
    return model
