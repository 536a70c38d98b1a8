"""The polygons of one swing: every obstacle in reach, cut by every slab in which a body moves."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.exact_levels import INNER, OUTER, ROUNDING
from backend.cspace.planar_arm import Profiles
from backend.cspace.planar_slices import POINTS, inner_slice, outer_slice, slab_slice
from backend.cspace.rows import Polygons, rectangle_distance
from backend.spatial.types import Array, BoolArray


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
def slices_wanted(
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    pairs: BoolArray,
    kind: int,
    spread: float,
    pivot: Array,
    reach: Array,
) -> tuple[Array, bool]:
    """How far from the pivot the slice of each slab and obstacle matters (s, m) [m], 0 where the
    arm meets none; whether there are any.

    spread: half a cell of the swing [rad]; pivot: (2,) of the boom; reach: (3,) of the bodies of
    boom, stick and bucket from there [m].
    """
    centers, _, halves = boxes
    m, slabs, some = len(centers), len(body.slabs), False
    wide = max(abs(body.slabs.min()), abs(body.slabs.max())) + abs(ROUNDING * kind)
    wanted = np.zeros((slabs, m))
    for j in range(m):
        size = math.sqrt(halves[j, 0] ** 2 + halves[j, 1] ** 2 + halves[j, 2] ** 2) + 1e-6
        x, t, z = centers[j, 0], centers[j, 1], centers[j, 2]
        beside = abs(t) * math.cos(spread) - abs(x) * math.sin(spread) - size
        # Within the cell the swing moves a point on a circle about z.
        if beside > wide:
            continue
        away = math.hypot(max(abs(math.hypot(x, t) - abs(pivot[0])) - wide, 0.0), z - pivot[1])
        if spread == 0.0:
            away = math.hypot(x - pivot[0], z - pivot[1]) - wide
        for b in range(len(body.group)):
            within = reach[body.group[b]]
            if body.sides[b] > 0 and pairs[b, j] and away - size <= within + wide:
                wanted[body.slab[b], j] = max(wanted[body.slab[b], j], within)
                some = True
    return wanted, some


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def slices(
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    wanted: Array,
    kind: int,
    spread: float,
    pivot: Array,
) -> Polygons:
    """Polygons of all obstacles that the arm can meet, for every slab that needs them; see
    `slices_wanted`.
    """
    centers, rotations, halves = boxes
    m, slabs = len(centers), len(body.slabs)
    pad = ROUNDING * kind
    room = 0
    for s in range(slabs):
        for j in range(m):
            if wanted[s, j] > 0.0:
                room += 2 if kind == OUTER and spread > 0.0 else 1
    slab, obstacle = np.empty(room, np.int64), np.empty(room, np.int64)
    count = np.zeros(room, np.int64)
    xs, zs = np.empty((room, POINTS)), np.empty((room, POINTS))
    corners, work = np.empty((8, 3)), np.empty((2, 12, 3))
    points, flat = np.empty((POINTS, 3)), np.empty((2, POINTS))
    low_corner, high_corner = np.empty((room, 2)), np.empty((room, 2))
    k = 0
    for j in range(m):
        made = False
        for s in range(slabs):
            if wanted[s, j] == 0.0:
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
            for part in range(2 if kind == OUTER and spread > 0.0 else 1):
                if spread == 0.0:
                    n = slab_slice(corners, low, high, flat, xs[k], zs[k])
                elif kind == INNER:
                    n = inner_slice(corners, low, high, spread, points, work, xs[k], zs[k])
                    n = n if n >= 3 else 0
                else:
                    n = outer_slice(
                        corners, low, high, spread, part == 0, points, work, xs[k], zs[k]
                    )
                if n == 0:
                    continue
                low_corner[k, 0], high_corner[k, 0] = xs[k, :n].min(), xs[k, :n].max()
                low_corner[k, 1], high_corner[k, 1] = zs[k, :n].min(), zs[k, :n].max()
                near = rectangle_distance(low_corner[k], high_corner[k], pivot[0], pivot[1])
                if near <= wanted[s, j] ** 2:
                    slab[k], obstacle[k], count[k] = s, j, n
                    k += 1
    widest = 1
    for i in range(k):
        widest = max(widest, count[i])
    normal_x, normal_z = np.zeros((k, widest)), np.zeros((k, widest))
    angle = np.zeros((k, widest))
    offset = np.zeros((k, widest))
    for i in range(k):
        n = count[i]
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
        normal_x, normal_z, offset, angle, low_corner[:k], high_corner[:k],
    )  # fmt: skip
