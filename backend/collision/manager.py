"""python-fcl's broad-phase managers: whether two sets of boxes touch. A peer for benchmarks."""

from __future__ import annotations

import fcl

from backend.collision.closest import fcl_box
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array


class BoxManager:
    """Boxes in a dynamic tree, which can be moved together."""

    def __init__(self, boxes: Boxes) -> None:
        self._objects = [
            fcl_box(c, R, h)
            for c, R, h in zip(boxes.centers, boxes.rotations, boxes.half_extents, strict=True)
        ]
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects(self._objects)
        self._manager.setup()

    def move(self, centers: Array, rotations: Array) -> None:
        """centers: (n, 3) [m]; rotations: (n, 3, 3)."""
        for item, center, R in zip(self._objects, centers, rotations, strict=True):
            item.setTransform(fcl.Transform(R, center))  # type: ignore[attr-defined]
        self._manager.update()

    def touches(self, other: BoxManager) -> bool:
        """Whether any box touches one of the other set."""
        data = fcl.CollisionData()
        self._manager.collide(other._manager, data, fcl.defaultCollisionCallback)
        return bool(data.result.is_collision)
