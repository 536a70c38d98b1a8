"""Oriented boxes from triangles: all of a mesh inside a few boxes, none of them far beyond it.

The triangles are split at planes, best cut first; each piece gets the orientation that exceeds the
mesh least. Triangles are cut where a plane crosses them, so that the boxes together contain every
point of every triangle and not only the vertices.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from backend.machine.fitting_clip import sample, thin
from backend.machine.fitting_search import Piece, search
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

PAD = 5e-4  # [m] on every side: rounding, and the arc between two samples of a cylinder's sweep


def fit_boxes(
    triangles: Array,
    max_boxes: int = 12,
    max_excess: float = 0.15,
    progress: Callable[[float], None] | None = None,
) -> Boxes:
    """Oriented boxes that together contain all triangles (n, 3, 3) [m], in the triangles' frame.

    At most `max_boxes`; fewer when `max_excess` [m] (see `excess`) is reached earlier. When it
    cannot be reached, the best found. progress: called with the share done, 0..1.
    Deterministic. Raises ValueError for an empty or non-finite set.
    """
    triangles = np.asarray(triangles, dtype=float)
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or not len(triangles):
        raise ValueError("triangles must have shape nx3x3 with n > 0")
    if not np.isfinite(triangles).all():
        raise ValueError("triangles must be finite")
    pieces = search(triangles, max_boxes, max_excess, progress or (lambda share: None))
    return _boxes(pieces)


def excess(boxes: Boxes, triangles: Array, spacing: float = 0.03) -> float:
    """How far the union of boxes reaches beyond the mesh [m].

    The largest distance to the nearest mesh point over points on the union's surface, sampled on a
    grid of at most `spacing` [m] on each face; points inside another box are not on the surface.
    triangles: (n, 3, 3) [m]. The mesh is sampled at 15 mm, so the value errs high by < 1 cm.
    """
    points = surface_points(boxes, spacing)
    mesh = thin(sample(np.asarray(triangles, dtype=float), 0.015), 0.005)
    return float(cKDTree(mesh).query(points)[0].max()) if len(points) else 0.0


def surface_points(boxes: Boxes, spacing: float) -> Array:
    """Points (m, 3) on the surface of the union of boxes, at most `spacing` [m] apart on a face."""
    kept = []
    for k in range(len(boxes)):
        h = boxes.half_extents[k]
        faces = []
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            lines = [
                np.linspace(-h[a], h[a], max(2, int(np.ceil(2 * h[a] / spacing)) + 1))
                for a in (u, v)
            ]
            gu, gv = (g.ravel() for g in np.meshgrid(*lines))
            for side in (-1.0, 1.0):
                local = np.empty((len(gu), 3))
                local[:, axis], local[:, u], local[:, v] = side * h[axis], gu, gv
                faces.append(local)
        points = np.concatenate(faces) @ boxes.rotations[k].T + boxes.centers[k]
        for other in range(len(boxes)):
            if other != k:
                local = (points - boxes.centers[other]) @ boxes.rotations[other]
                points = points[~(np.abs(local) < boxes.half_extents[other]).all(axis=1)]
        kept.append(points)
    return np.concatenate(kept)


def _boxes(pieces: list[Piece]) -> Boxes:
    centers, rotations, halves = [], [], []
    for p in pieces:
        centers.append(p.R @ ((p.low + p.high) / 2.0))
        rotations.append(p.R)
        halves.append((p.high - p.low) / 2.0 + PAD)
    return Boxes(np.array(centers), np.array(rotations), np.array(halves))
