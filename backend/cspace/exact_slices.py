"""The polygons of one swing: every obstacle in reach, cut by every slab in which a body moves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.planar_arm import Profiles
from backend.cspace.planar_slices import POINTS, inner_slice, outer_slice
from backend.cspace.rows import Polygons, Row
from backend.spatial.types import Array, BoolArray

EXACT, OUTER, INNER = 0, 1, -1
ROUNDING = 1e-9
"""[m], [rad]: certified bounds are moved outward by more than the kernels round."""


class Cells(NamedTuple):
    """The grid. boom, stick, bucket: rows of cell centres in the arm's plane.

    kind: EXACT at the centres; OUTER all that is not surely free; INNER only what is surely
    blocked; halves: (4,) half a cell of swing, boom, stick, bucket [rad], 0 where the value is
    exact.
    """

    boom: Row
    stick: Row
    bucket: Row
    kind: int
    halves: Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def placed(boxes: tuple[Array, Array, Array], T: Array) -> tuple[Array, Array, Array]:
    """The obstacles in the frame `arm`. T: (3, 4)."""
    m = len(boxes[0])
    centers, rotations = np.empty((m, 3)), np.zeros((m, 3, 3))
    for j in range(m):
        for i in range(3):
            centers[j, i] = T[i, 3]
            for k in range(3):
                centers[j, i] += T[i, k] * boxes[0][j, k]
                for a in range(3):
                    rotations[j, i, a] += T[i, k] * boxes[1][j, k, a]
    return centers, rotations, boxes[2]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def slices(
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    pairs: BoolArray,
    kind: int,
    spread: float,
    pivot: Array,
    reach: float,
) -> Polygons:
    """Polygons of all obstacles that the arm can meet, for every slab that needs them."""
    centers, rotations, halves = boxes
    m, slabs = len(centers), len(body.slabs)
    pad = ROUNDING * kind
    wide = max(abs(body.slabs.min()), abs(body.slabs.max())) + abs(pad)
    wanted = np.zeros((slabs, m), np.bool_)
    for j in range(m):
        size = math.sqrt(halves[j, 0] ** 2 + halves[j, 1] ** 2 + halves[j, 2] ** 2) + 1e-6
        x, t, z = centers[j, 0], centers[j, 1], centers[j, 2]
        beside = abs(t) * math.cos(spread) - abs(x) * math.sin(spread) - size
        # The swing moves a point on a circle about z: its distance from the pivot is at least
        # that of the nearest point of the circle.
        away = math.hypot(max(abs(math.hypot(x, t) - abs(pivot[0])) - wide, 0.0), z - pivot[1])
        if beside > wide or away - size > reach + wide:
            continue
        for b in range(len(body.group)):
            if body.sides[b] > 0 and pairs[b, j]:
                wanted[body.slab[b], j] = True
    room = 0
    for s in range(slabs):
        for j in range(m):
            if wanted[s, j]:
                room += 2 if kind == OUTER and spread > 0.0 else 1
    slab, obstacle = np.empty(room, np.int64), np.empty(room, np.int64)
    count = np.zeros(room, np.int64)
    xs, zs = np.empty((room, POINTS)), np.empty((room, POINTS))
    corners, work = np.empty((8, 3)), np.empty((2, 12, 3))
    points = np.empty((POINTS, 3))
    k = 0
    for j in range(m):
        made = False
        for s in range(slabs):
            if not wanted[s, j]:
                continue
            if not made:
                made = True
                for v in range(8):
                    for i in range(3):
                        corners[v, i] = centers[j, i]
                        for a in range(3):
                            half = halves[j, a] if (v >> a) & 1 else -halves[j, a]
                            corners[v, i] += half * rotations[j, i, a]
            low, high = body.slabs[s, 0] - pad, body.slabs[s, 1] + pad
            if kind == INNER and spread > 0.0:
                n = inner_slice(corners, low, high, spread, points, work, xs[k], zs[k])
                if n >= 3:
                    slab[k], obstacle[k], count[k] = s, j, n
                    k += 1
                continue
            for front in (True, False):
                n = outer_slice(corners, low, high, spread, front, points, work, xs[k], zs[k])
                if n > 0:
                    slab[k], obstacle[k], count[k] = s, j, n
                    k += 1
                if spread == 0.0:
                    break
    widest = 1
    for i in range(k):
        widest = max(widest, count[i])
    normal_x, normal_z = np.zeros((k, widest)), np.zeros((k, widest))
    angle = np.zeros((k, widest))
    offset, low_corner, high_corner = np.zeros((k, widest)), np.empty((k, 2)), np.empty((k, 2))
    for i in range(k):
        n = count[i]
        low_corner[i, 0], high_corner[i, 0] = xs[i, :n].min(), xs[i, :n].max()
        low_corner[i, 1], high_corner[i, 1] = zs[i, :n].min(), zs[i, :n].max()
        for v in range(n):
            u = v + 1 if v + 1 < n else 0
            dx, dz = xs[i, u] - xs[i, v], zs[i, u] - zs[i, v]
            length = math.hypot(dx, dz)
            if length > 0.0:
                normal_x[i, v], normal_z[i, v] = dz / length, -dx / length
            else:
                normal_x[i, v] = 1.0
            angle[i, v] = math.atan2(normal_z[i, v], normal_x[i, v])
            offset[i, v] = -math.inf
            for w in range(n):
                reached = normal_x[i, v] * xs[i, w] + normal_z[i, v] * zs[i, w]
                offset[i, v] = max(offset[i, v], reached)
    return Polygons(
        slab[:k], obstacle[:k], count[:k], xs[:k, :widest].copy(), zs[:k, :widest].copy(),
        normal_x, normal_z, offset, angle, low_corner, high_corner,
    )  # fmt: skip
