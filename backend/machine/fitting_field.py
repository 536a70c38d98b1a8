"""The distance to a mesh on a grid: one lookup a point instead of a search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from backend.machine.fitting_clip import sample, thin
from backend.spatial.types import Array


@dataclass(frozen=True)
class Field:
    """distance (nx, ny, nz) [m] at origin + index * step; step [m]."""

    origin: Array
    step: float
    distance: Array


def box_surface(low: Array, high: Array, spacing: float) -> Array:
    """Points (n, 3) on the six faces of low <= p <= high, at most `spacing` [m] apart."""
    lines = [
        np.linspace(low[a], high[a], max(2, int(np.ceil((high[a] - low[a]) / spacing)) + 1))
        for a in range(3)
    ]
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        gu, gv = np.meshgrid(lines[u], lines[v])
        for value in (low[axis], high[axis]):
            local = np.empty((gu.size, 3))
            local[:, axis], local[:, u], local[:, v] = value, gu.ravel(), gv.ravel()
            faces.append(local)
    return np.concatenate(faces)


def distance_field(triangles: Array, step: float = 0.025, margin: float = 0.6) -> Field:
    """The field of triangles (n, 3, 3) [m] on a grid reaching `margin` [m] beyond them.

    The step grows for large meshes so that the grid keeps below six million nodes.
    """
    points = triangles.reshape(-1, 3)
    origin, top = points.min(axis=0) - margin, points.max(axis=0) + margin
    step = max(step, float((np.prod(top - origin) / 6e6) ** (1.0 / 3.0)))
    shape = tuple(np.ceil((top - origin) / step).astype(int) + 1)
    free = np.ones(shape, dtype=bool)
    index = np.rint((thin(sample(triangles, step), step / 4) - origin) / step).astype(np.intp)
    free[index[:, 0], index[:, 1], index[:, 2]] = False
    return Field(origin, step, np.asarray(distance_transform_edt(free)) * step)
