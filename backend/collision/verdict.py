"""python-fcl's own verdict on one configuration: what touches, and what is closest."""

from __future__ import annotations

from dataclasses import dataclass

import fcl
import numpy as np

from backend.collision.box_distance import lower_bounds
from backend.collision.closest import fcl_box, fcl_distance
from backend.spatial.boxes import Boxes
from backend.spatial.types import IntArray


@dataclass(frozen=True)
class Verdict:
    """touching: (k, 2) pairs that overlap; distance: smallest of all pairs, 0 when one overlaps,
    infinite without pairs [m]; closest: that pair, None without pairs.
    """

    touching: IntArray
    distance: float
    closest: tuple[int, int] | None


def verdict(a: Boxes, b: Boxes, pairs: IntArray | None = None) -> Verdict:
    """Bodies of a against those of b. pairs: (k, 2) that count, every pair when None."""
    if pairs is None:
        pairs = np.argwhere(np.ones((len(a), len(b)), dtype=bool))
    if not len(pairs):
        return Verdict(np.zeros((0, 2), np.int64), float("inf"), None)
    objects_a = [fcl_box(a.centers[k], a.rotations[k], a.half_extents[k]) for k in range(len(a))]
    objects_b = [fcl_box(b.centers[k], b.rotations[k], b.half_extents[k]) for k in range(len(b))]
    touching: list[tuple[int, int]] = []
    best, closest = float("inf"), None
    bound = lower_bounds(a, b)[pairs[:, 0], pairs[:, 1]]
    for k in np.argsort(bound):
        i, j = int(pairs[k, 0]), int(pairs[k, 1])
        if bound[k] > max(best, 0.0):
            break
        if _collides(objects_a[i], objects_b[j]):
            touching.append((i, j))
            best, closest = 0.0, closest if best == 0.0 else (i, j)
        elif best > 0.0 and (d := fcl_distance(objects_a[i], objects_b[j])) < best:
            best, closest = d, (i, j)
    return Verdict(np.array(touching, dtype=np.int64).reshape(-1, 2), best, closest)


def _collides(a: object, b: object) -> bool:
    return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()))


def contact(a: Boxes, b: Boxes, reach: float = 0.0) -> tuple[bool, float]:
    """(whether any body of a touches one of b by python-fcl, how far apart they are at least [m]).

    reach: pairs that are farther apart than this [m] are not looked at; 0 for all that may touch.
    """
    bound = lower_bounds(a, b)
    apart = float(bound.min(initial=np.inf))
    for i, j in np.argwhere(bound <= reach):
        one = fcl_box(a.centers[i], a.rotations[i], a.half_extents[i])
        two = fcl_box(b.centers[j], b.rotations[j], b.half_extents[j])
        if _collides(one, two):
            return True, 0.0
    return False, apart
