"""The ground plane among the points, by MSAC (Torr and Zisserman 2000; Rasul 2021, Section 3.1).

As RANSAC, but a plane is judged by how well its inliers lie on it, and outliers cost what is just
out of tolerance. The random triples are drawn from a seed: the same points, the same ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.perception.kernels import scores
from backend.spatial.types import Array

STEEPEST = math.radians(25.0)
_TRIPLES = 200
_JUDGED = 1500  # points that judge a plane
_LEAST = 50  # points on a ground


@dataclass(frozen=True)
class Plane:
    """normal: (3,) unit vector, upwards; offset: normal . x = offset on it [m]; share: of the
    points that lie on it.
    """

    normal: Array
    offset: float
    share: float

    def heights(self, points: Array) -> Array:
        """(n,) above the plane [m]. points: (n, 3)."""
        return np.asarray(points @ self.normal - self.offset)


def find_ground(points: Array, tolerance: float = 0.1, seed: int = 0) -> Plane | None:
    """The best plane that is no steeper than STEEPEST; None when too few points lie on one.

    points: (n, 3), z up [m]; tolerance: of a point on the plane [m].
    """
    n = len(points)
    if n < _LEAST:
        return None
    rng = np.random.default_rng(seed)
    judges = np.ascontiguousarray(points[rng.permutation(n)[:_JUDGED]])
    triples = rng.integers(0, len(judges), (_TRIPLES, 3))
    cost = scores(judges, triples, tolerance, math.cos(STEEPEST))
    best = int(np.argmin(cost))
    if not np.isfinite(cost[best]):
        return None
    a, b, c = judges[triples[best]]
    plane = _through(np.cross(b - a, c - a), a)
    for _ in range(2):  # refined by least squares over all that lies on it
        on = np.abs(plane.heights(points)) <= tolerance
        if on.sum() < _LEAST:
            return None
        middle = points[on].mean(axis=0)
        off = points[on] - middle
        normal = np.linalg.eigh(off.T @ off)[1][:, 0]
        plane = _through(normal, middle)
    share = float((np.abs(plane.heights(points)) <= tolerance).mean())
    return Plane(plane.normal, plane.offset, share)


def _through(normal: Array, point: Array) -> Plane:
    up = normal / np.linalg.norm(normal) * (1.0 if normal[2] >= 0.0 else -1.0)
    return Plane(up, float(up @ point), 0.0)
