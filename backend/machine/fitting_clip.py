"""Cutting triangles at planes and boxes, and sampling them: exact pieces, nothing lost at a cut."""

from __future__ import annotations

from itertools import product

import numpy as np

from backend.machine.fitting_kernels import lattice
from backend.spatial.types import Array

_AXES: Array = np.array([s for s in product((-1.0, 0.0, 1.0), repeat=3) if s > (0.0, 0.0, 0.0)])


def clip(triangles: Array, normal: Array, offset: float) -> Array:
    """The pieces of triangles (n, 3, 3) where normal . p <= offset, as triangles (m, 3, 3).

    A triangle that the plane crosses becomes one or two triangles (Sutherland and Hodgman 1974
    for one plane and three corners). Triangles lying in the plane stay.
    """
    d = triangles @ normal - offset
    inside = d <= 0.0
    count = inside.sum(axis=1)
    pieces = [triangles[count == 3]]
    for k in (1, 2):
        rows = np.flatnonzero(count == k)
        if not len(rows):
            continue
        # Turn each triangle so that its lone corner (inside for k=1, outside for k=2) comes first.
        lone = inside[rows] if k == 1 else ~inside[rows]
        order = (np.argmax(lone, axis=1)[:, None] + np.arange(3)) % 3
        t = np.take_along_axis(triangles[rows], order[:, :, None], axis=1)
        s = np.take_along_axis(d[rows], order, axis=1)
        ab = _crossing(t[:, 0], t[:, 1], s[:, 0], s[:, 1])
        ac = _crossing(t[:, 0], t[:, 2], s[:, 0], s[:, 2])
        if k == 1:
            pieces.append(np.stack([t[:, 0], ab, ac], axis=1))
        else:
            pieces.append(np.stack([ab, t[:, 1], t[:, 2]], axis=1))
            pieces.append(np.stack([ab, t[:, 2], ac], axis=1))
    return np.concatenate(pieces)


def outside_box(triangles: Array, R: Array, low: Array, high: Array) -> Array:
    """The pieces of triangles (n, 3, 3) outside the box {p: low <= R^T p <= high}, (m, 3, 3)."""
    local = triangles @ R
    apart = ((local.min(axis=1) >= high) | (local.max(axis=1) <= low)).any(axis=1)
    rest, pieces = triangles[~apart], [triangles[apart]]
    for axis in range(3):
        for normal, offset in ((R[:, axis], high[axis]), (-R[:, axis], -low[axis])):
            if not len(rest):
                break
            d = rest @ normal - offset
            beyond = d.max(axis=1) > 0.0
            if beyond.any():
                pieces.append(clip(rest[beyond], -normal, -offset))
                rest = np.concatenate([rest[~beyond], clip(rest[beyond], normal, offset)])
    return np.concatenate(pieces)


def sample(triangles: Array, spacing: float) -> Array:
    """Points (m, 3) on triangles (n, 3, 3), corners included, none of the surface farther than
    `spacing` [m] from one: rows along each triangle's longest edge."""
    return np.asarray(lattice(np.ascontiguousarray(triangles), spacing))


def subdivided(triangles: Array, longest: float) -> Array:
    """The same surface in triangles (m, 3, 3) with no edge over `longest` [m], by halving edges."""
    done = []
    while len(triangles):
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        short = edges.max(axis=1) <= longest
        done.append(triangles[short])
        t, first = triangles[~short], np.argmax(edges[~short], axis=1)
        t = np.take_along_axis(t, ((first[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)
        middle = (t[:, 0] + t[:, 1]) / 2.0
        triangles = np.concatenate(
            [np.stack([t[:, 0], middle, t[:, 2]], 1), np.stack([middle, t[:, 1], t[:, 2]], 1)]
        )
    return np.concatenate(done) if done else triangles


def thin(points: Array, spacing: float) -> Array:
    """One point of each occupied cube of edge `spacing` [m] (the first in the given order)."""
    if not len(points):
        return points
    cell = np.floor((points - points.min(axis=0)) / spacing).astype(np.int64)
    size = cell.max(axis=0) + 1
    key = (cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2]
    return points[np.sort(np.unique(key, return_index=True)[1])]


def extremes(points: Array, cell: float) -> Array:
    """The outermost points of each occupied cube of edge `cell` [m], along 13 axes both ways.

    Boxes around these are within millimetres of boxes around all points of whole cubes.
    """
    index = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    size = index.max(axis=0) + 1
    key = (index[:, 0] * size[1] + index[:, 1]) * size[2] + index[:, 2]
    order = np.argsort(key, kind="stable")
    points, key = points[order], key[order]
    first = np.flatnonzero(np.diff(key, prepend=-1))
    group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(key))))
    kept = np.zeros(len(points), dtype=bool)
    for axis in _AXES:
        along = points @ axis
        for values in (along, -along):
            top = np.flatnonzero(values >= np.maximum.reduceat(values, first)[group])
            kept[top[np.unique(group[top], return_index=True)[1]]] = True
    return points[kept]


def _crossing(a: Array, b: Array, da: Array, db: Array) -> Array:
    """Where the segments a-b (n, 3) meet the plane, from the signed distances of their ends."""
    w = (da / (da - db))[:, None]
    return np.asarray(a + w * (b - a))
