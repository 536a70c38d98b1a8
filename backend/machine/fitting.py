"""Oriented boxes from triangles: all of a mesh inside a few boxes, none of them far beyond it.

Two searches work on points of the mesh: a cover by boxes that each keep near it, and, where that
does not come within max_excess, pieces whose boxes stick out as little as they can. What is then
left out of the triangles between those points is found by cutting every triangle at every box, and
the boxes grow over it; so they contain each triangle completely, not only its corners.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from backend.machine.fitting_clip import extremes, outside_box, sample, subdivided, thin
from backend.machine.fitting_field import box_surface, distance_field
from backend.machine.fitting_pieces import search_pieces
from backend.machine.fitting_search import search
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

PAD = 7e-4  # [m] on every side: rounding, and the arc between two samples of a cylinder's sweep
# The searches aim so much [m] below max_excess, for the grid's error and the growth over what the
# points left out; the next value where the first was reached and proved too little.
_SLACK = (0.008, 0.02, 0.035)
_SLACK_PIECES = 0.03


def fit_boxes(
    triangles: Array,
    max_boxes: int = 12,
    max_excess: float = 0.15,
    progress: Callable[[float], None] | None = None,
) -> Boxes:
    """Oriented boxes that together contain all triangles (n, 3, 3) [m], in the triangles' frame.

    One box where that is enough; else at most `max_boxes`, so placed that `excess` is at most
    `max_excess` [m] where the search can reach it, else the best found. progress: called with the
    share done, 0..1. Deterministic.
    Raises ValueError for an empty or non-finite set.
    """
    triangles = np.asarray(triangles, dtype=float)
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or not len(triangles):
        raise ValueError("triangles must have shape nx3x3 with n > 0")
    if not np.isfinite(triangles).all():
        raise ValueError("triangles must be finite")
    report = progress or (lambda share: None)
    mesh = mesh_tree(triangles)
    one = _around(triangles)
    if farthest(one, mesh, 0.03) <= max_excess:
        return one
    points = outer_points(triangles)
    field = distance_field(triangles)

    best, least = one, np.inf

    def judge(R: Array, low: Array, high: Array) -> None:
        nonlocal best, least
        low, high = grown(triangles, R, low, high)
        centers = (R @ ((low + high) / 2.0)[:, :, None])[:, :, 0]
        boxes = Boxes(centers, R, (high - low) / 2.0 + PAD)
        value = farthest(boxes, mesh, 0.03)
        if value < least:
            best, least = boxes, value

    for slack in _SLACK:
        wanted = max(max_excess - slack, 0.5 * max_excess)
        found = search(triangles, points, field, max_boxes, wanted, lambda s: report(s / 2.0))
        for R, low, high, tolerance in found:
            judge(R, low, high)
            if least <= max(max_excess, tolerance):
                break
        if least <= max_excess or tolerance > wanted:
            break
    if least > max_excess:
        wanted = max(max_excess - _SLACK_PIECES, 0.5 * max_excess)
        wide = distance_field(triangles, margin=0.6)
        sets, _ = search_pieces(points, wide, max_boxes, wanted, lambda s: report((1.0 + s) / 2.0))
        for pieces in sets:
            judge(*(np.array([getattr(p, name) for p in pieces]) for name in ("R", "low", "high")))
    report(1.0)
    return best


def excess(boxes: Boxes, triangles: Array, spacing: float = 0.03) -> float:
    """How far the union of boxes reaches beyond the mesh [m].

    The largest distance to the nearest mesh point over points on the union's surface, sampled on a
    grid of at most `spacing` [m] on each face; points inside another box are not on the surface.
    triangles: (n, 3, 3) [m]. The mesh is sampled at 15 mm, so the value errs high by < 1 cm.
    """
    return farthest(boxes, mesh_tree(np.asarray(triangles, dtype=float)), spacing)


def surface_points(boxes: Boxes, spacing: float) -> Array:
    """Points (m, 3) on the surface of the union of boxes, at most `spacing` [m] apart on a face."""
    kept = []
    for k in range(len(boxes)):
        h = boxes.half_extents[k]
        points = box_surface(-h, h, spacing) @ boxes.rotations[k].T + boxes.centers[k]
        for other in range(len(boxes)):
            if other != k:
                local = (points - boxes.centers[other]) @ boxes.rotations[other]
                points = points[~(np.abs(local) < boxes.half_extents[other]).all(axis=1)]
        kept.append(points)
    return np.concatenate(kept)


def _around(triangles: Array) -> Boxes:
    """One box along the axes of the triangles' frame."""
    corners = triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Boxes(((low + high) / 2.0)[None], np.eye(3)[None], ((high - low) / 2.0 + PAD)[None])


def mesh_tree(triangles: Array) -> cKDTree:
    """Points on triangles (n, 3, 3) [m], 15 mm apart, to measure distances to the mesh."""
    return cKDTree(thin(sample(triangles, 0.015), 0.005))


def farthest(boxes: Boxes, mesh: cKDTree, spacing: float) -> float:
    """`excess` of the boxes over the mesh of `mesh_tree` [m]."""
    points = surface_points(boxes, spacing)
    return float(np.max(mesh.query(points)[0])) if len(points) else 0.0


def outer_points(triangles: Array) -> Array:
    """Points of the mesh for the search: the outermost of small cubes, at most some 25,000."""
    dense, cell = sample(triangles, 0.03), 0.06
    points = extremes(dense, cell)
    while len(points) > 25_000 and cell < 0.2:
        cell *= 1.25
        points = extremes(points, cell)
    return np.ascontiguousarray(points)


def grown(
    triangles: Array, R: Array, low: Array, high: Array, longest: float = 0.05
) -> tuple[Array, Array]:
    """low, high (k, 3) so that every triangle is inside the union of boxes.

    What is outside of all boxes is cut into small triangles, no edge over `longest` [m]; each joins
    the box that has to grow least for it.
    """
    rest = triangles
    for k in range(len(R)):
        rest = outside_box(rest, R[k], low[k], high[k])
    rest = subdivided(rest, longest)
    if not len(rest):
        return low, high
    local = np.einsum("nci,kij->kncj", rest, R)  # (k, n, 3, 3)
    under = np.maximum(low[:, None] - local.min(axis=2), 0.0)
    over = np.maximum(local.max(axis=2) - high[:, None], 0.0)
    taker = np.argmin(np.maximum(under, over).max(axis=2), axis=0)
    low, high = low.copy(), high.copy()
    for k in range(len(R)):
        mine = local[k, taker == k].reshape(-1, 3)
        if len(mine):
            low[k] = np.minimum(low[k], mine.min(axis=0))
            high[k] = np.maximum(high[k], mine.max(axis=0))
    return low, high
