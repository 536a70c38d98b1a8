"""coal and python-fcl as judges of configurations: managers for obstacles, own bodies by pairs.

The bodies are placed by `separating_axes`, so that nothing here calls the project's geometry.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from typing import Any, Protocol

import coal
import fcl
import numpy as np
from separating_axes import Placed, near_self_pairs, placed

from backend.machine.model import Machine
from backend.spatial.boxes import Boxes


class Engine(Protocol):
    """One machine among obstacles in its root frame."""

    def against(self, own: Placed, c: int) -> bool:
        """Whether configuration c touches an obstacle."""
        ...

    def pair(self, i: int, j: int) -> bool:
        """Whether bodies i and j touch, where `against` has placed them last."""
        ...


class Coal:
    """coal."""

    def __init__(self, halves: np.ndarray, obstacles: Boxes) -> None:
        self._own = [_coal_object(np.zeros(3), np.eye(3), h) for h in halves]
        self._all = [
            _coal_object(c, R, h)
            for c, R, h in zip(
                obstacles.centers, obstacles.rotations, obstacles.half_extents, strict=True
            )
        ]
        self._managers = (
            coal.DynamicAABBTreeCollisionManager(),
            (coal.DynamicAABBTreeCollisionManager()),
        )
        for manager, objects in zip(self._managers, (self._own, self._all), strict=True):
            for thing in objects:
                manager.registerObject(thing)
            manager.setup()

    def place(self, own: Placed, c: int, bodies: Iterable[int] | None = None) -> None:
        for k in range(len(self._own)) if bodies is None else bodies:
            self._own[k].setTransform(coal.Transform3s(own.rotations[c, k], own.centers[c, k]))
            self._own[k].computeAABB()

    def against(self, own: Placed, c: int) -> bool:
        self.place(own, c)
        self._managers[0].update()
        callback = coal.CollisionCallBackDefault()
        self._managers[0].collide(self._managers[1], callback)
        return bool(callback.data.result.isCollision())

    def pair(self, i: int, j: int) -> bool:
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        return bool(coal.collide(self._own[i], self._own[j], request, result))

    def nearer(self, i: int, j: int, margin: float) -> bool:
        """Whether body i is within `margin` [m] of obstacle j."""
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        request.security_margin = margin
        return bool(coal.collide(self._own[i], self._all[j], request, result))


def _coal_object(c: np.ndarray, R: np.ndarray, half: np.ndarray) -> Any:
    return coal.CollisionObject(coal.Box(*(2.0 * half)), np.array(R), np.array(c))


class Fcl:
    """python-fcl."""

    def __init__(self, halves: np.ndarray, obstacles: Boxes) -> None:
        self.own = [_fcl_object(np.zeros(3), np.eye(3), h) for h in halves]
        self.obstacles = [
            _fcl_object(c, R, h)
            for c, R, h in zip(
                obstacles.centers, obstacles.rotations, obstacles.half_extents, strict=True
            )
        ]
        self._managers = (
            fcl.DynamicAABBTreeCollisionManager(),
            (fcl.DynamicAABBTreeCollisionManager()),
        )
        for manager, objects in zip(self._managers, (self.own, self.obstacles), strict=True):
            manager.registerObjects(objects)
            manager.setup()

    def place(self, own: Placed, c: int, bodies: Iterable[int] | None = None) -> None:
        for k in range(len(self.own)) if bodies is None else bodies:
            self.own[k].setTransform(fcl.Transform(own.rotations[c, k], own.centers[c, k]))

    def against(self, own: Placed, c: int) -> bool:
        self.place(own, c)
        self._managers[0].update()
        data = fcl.CollisionData(request=fcl.CollisionRequest(num_max_contacts=1))
        self._managers[0].collide(self._managers[1], data, fcl.defaultCollisionCallback)
        return bool(data.result.is_collision)

    def pair(self, i: int, j: int) -> bool:
        return fcl_touch(self.own[i], self.own[j])


def fcl_touch(a: Any, b: Any) -> bool:
    return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()) > 0)


def _fcl_object(c: np.ndarray, R: np.ndarray, half: np.ndarray) -> Any:
    return fcl.CollisionObject(fcl.Box(*(2.0 * half)), fcl.Transform(np.array(R), np.array(c)))


def judged_by(
    make: Callable[[np.ndarray, Boxes], Engine],
    machine: Machine,
    q: np.ndarray,
    obstacles: Boxes,
) -> np.ndarray:
    """(c, 2) whether the machine at q (c, joints) touches an obstacle, and itself."""
    engine = make(machine.bodies.half_extents, obstacles)
    out = np.zeros((len(q), 2), dtype=bool)
    for start in range(0, len(q), 500):
        own = placed(machine, q[start : start + 500])
        c, i, j = near_self_pairs(machine, own)
        of = by_configuration(c, len(own.centers))
        for k in range(len(own.centers)):
            out[start + k, 0] = engine.against(own, k)
            out[start + k, 1] = any(engine.pair(int(i[p]), int(j[p])) for p in of[k])
    return out


def by_configuration(c: np.ndarray, count: int) -> list[range]:
    """The pairs of each configuration, whose indices c (k,) ascend."""
    bounds = np.searchsorted(c, np.arange(count + 1)).tolist()
    return [range(a, b) for a, b in itertools.pairwise(bounds)]
