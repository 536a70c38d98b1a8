"""The distance to a mesh on a grid, and the room that boxes may fill: one lookup a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from backend.machine.fitting_clip import sample, thin
from backend.spatial.types import Array

_NODES = 6e6  # at most; the step grows for large meshes


@dataclass(frozen=True)
class Field:
    """values (nx, ny, nz) [m] at origin + index * step; origin (3,), step [m]."""

    origin: Array
    step: float
    values: Array


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


def distance_field(triangles: Array, margin: float = 0.15, step: float = 0.025) -> Field:
    """The distance to triangles (n, 3, 3) [m], to some millimetres, up to `margin` beyond them."""
    corners = triangles.reshape(-1, 3)
    origin, top = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    step = max(step, float((np.prod(top - origin) / _NODES) ** (1.0 / 3.0)))
    shape = np.ceil((top - origin) / step).astype(int) + 1
    points = thin(sample(triangles, step / 2), step / 4)
    index = np.rint((points - origin) / step).astype(np.intp)
    key = np.ravel_multi_index(tuple(index.T), tuple(shape))
    occupied, cell, count = np.unique(key, return_inverse=True, return_counts=True)
    middle = np.stack([np.bincount(cell, points[:, a]) / count for a in range(3)], axis=1)
    free = np.ones(int(np.prod(shape)), dtype=bool)
    free[occupied] = False
    number = np.zeros(len(free), dtype=np.int32)
    number[occupied] = np.arange(len(occupied))
    nearest = distance_transform_edt(
        free.reshape(shape), return_distances=False, return_indices=True
    )
    found = middle[number[np.ravel_multi_index(tuple(nearest), tuple(shape))]]
    squared = np.zeros(tuple(shape))
    for a in range(3):
        line = origin[a] + step * np.arange(shape[a])
        squared += (found[..., a] - line.reshape([-1 if b == a else 1 for b in range(3)])) ** 2
    return Field(origin, step, np.sqrt(squared))


def room(distance: Field, tolerance: float) -> tuple[Field, Array]:
    """Where a box may be whose surface must stay within `tolerance` [m] of the mesh.

    What lies farther from the mesh and is connected to the outside is forbidden to every box: the
    surface of their union cannot pass through it, and the union is bounded. Pockets that the mesh
    encloses may be filled, but then wholly; a cut through one would be surface.
    Returns the field that is over `tolerance` exactly in the forbidden space, elsewhere at most
    tolerance minus the way to it, and the pockets' nodes (n, 3) [m].
    """
    far = distance.values > tolerance
    labels, _ = label(np.pad(far, 1, constant_values=True))
    outside = (labels == labels[0, 0, 0])[1:-1, 1:-1, 1:-1]
    clearance = distance_transform_edt(~outside) * distance.step - distance.step
    values = np.minimum(np.minimum(distance.values, tolerance), tolerance - clearance)
    values[outside] = distance.values[outside]
    pockets = np.argwhere(far & ~outside)
    return Field(distance.origin, distance.step, values), distance.origin + pockets * distance.step
