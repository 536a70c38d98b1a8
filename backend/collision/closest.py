"""Closest bodies of two sets of oriented boxes: python-fcl, checked where it decides.

python-fcl over-estimates a distance now and then (thin walls and slabs, millimetres, always the
unsafe side), so every pair that could be the closest is measured again by `box_distance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import fcl
import numpy as np

from backend.collision import box_distance
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

RECHECK = 0.020
"""Pairs within this of the minimum are measured by the second solver [m]."""


@dataclass(frozen=True)
class ClosePairs:
    """Pairs of bodies in ascending distance, all confirmed by the second solver.

    index: (k, 2) into the two sets; distance: (k,) [m], negative on overlap; points: (k, 2, 3).
    disagreement: largest |python-fcl - exact| seen in this query [m].
    """

    index: IntArray
    distance: Array
    points: Array
    disagreement: float


def closest_pairs(a: Boxes, b: Boxes, within: float = 0.0) -> ClosePairs:
    """The closest pair of bodies of a and b, and every other pair nearer than `within` [m].

    Pairs are visited in the order of a lower bound (the gap along the separating axes), so that
    far pairs cost nothing. At least one pair is returned unless a set is empty.
    """
    if len(a) == 0 or len(b) == 0:
        return ClosePairs(np.zeros((0, 2), np.int64), np.zeros(0), np.zeros((0, 2, 3)), 0.0)
    bound = box_distance.lower_bounds(a, b)
    order = np.argsort(bound, axis=None)
    objects_a: dict[int, object] = {}
    objects_b: dict[int, object] = {}
    seen: list[tuple[int, int]] = []
    proposed: list[float] = []
    best = np.inf
    for flat in order:
        i, j = divmod(int(flat), len(b))
        if bound[i, j] > max(best + RECHECK, within):
            break
        d = fcl_distance(_object(a, i, objects_a), _object(b, j, objects_b))
        seen.append((i, j))
        proposed.append(d)
        best = min(best, d)
    index = np.array(seen, dtype=np.int64)
    fcl_values = np.array(proposed)
    check = fcl_values <= max(best + RECHECK, within + RECHECK)
    index, fcl_values = index[check], fcl_values[check]
    exact, points = box_distance.pair_distances(a, b, index[:, 0], index[:, 1])
    apart = (exact > 0.0) & (fcl_values > 0.0)
    disagreement = float(np.abs(exact - fcl_values)[apart].max(initial=0.0))
    keep = (exact <= within) | (np.arange(len(exact)) == int(np.argmin(exact)))
    rank = np.argsort(exact[keep], kind="stable")
    return ClosePairs(index[keep][rank], exact[keep][rank], points[keep][rank], disagreement)


def all_pairs(a: Boxes, b: Boxes) -> ClosePairs:
    """Every pair of bodies of a and b, in the order of the indices."""
    i, j = (grid.ravel() for grid in np.meshgrid(range(len(a)), range(len(b)), indexing="ij"))
    exact, points = box_distance.pair_distances(a, b, i, j)
    return ClosePairs(np.stack([i, j], axis=1).astype(np.int64), exact, points, 0.0)


def fcl_distance(a: object, b: object) -> float:
    """Distance of two FCL objects [m]; -1 on overlap, as FCL reports it."""
    result = fcl.DistanceResult()
    return float(fcl.distance(a, b, fcl.DistanceRequest(), result))


def fcl_box(center: Array, rotation: Array, half_extents: Array) -> object:
    """An FCL collision object of one oriented box."""
    geometry = _geometry(*(float(v) for v in 2.0 * half_extents))
    return fcl.CollisionObject(geometry, fcl.Transform(rotation, center))


@lru_cache(maxsize=4096)
def _geometry(x: float, y: float, z: float) -> object:
    return fcl.Box(x, y, z)


def _object(boxes: Boxes, k: int, made: dict[int, object]) -> object:
    if k not in made:
        made[k] = fcl_box(boxes.centers[k], boxes.rotations[k], boxes.half_extents[k])
    return made[k]
