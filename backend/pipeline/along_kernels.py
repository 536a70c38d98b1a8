"""Compiled loops of `along_track`: how near a work cycle comes to boxes over a stretch of track."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.box_kernels import pair_distance
from backend.spatial.types import Array, IntArray

_APART = 1e-9  # [m] up to which closest points give no direction


@njit(cache=True, nogil=True)
def stretch(
    centers: Array,
    rotations: Array,
    halves: Array,
    corners: Array,
    ends: IntArray,
    middles: Array,
    radii: Array,
    bulge: Array,
    cb: Array,
    Rb: Array,
    hb: Array,
    half_way: Array,
    astray: Array,
    cap: float,
    hint: IntArray,
) -> tuple[float, float, IntArray]:
    """(smallest clearance in the middle at the kept postures, lower bound of all clearances over
    the stretch and the whole cycle, (posture, body, box) of the smallest or -1).

    Everything in the frame of the track in the middle of the stretch. centers (m, B, 3), rotations
    (m, B, 3, 3), corners (m, B, 8, 3): bodies in m postures; halves (B, 3); ends (S, 2): postures
    that are passed between, by numbers; middles (S, B, 3), radii (S, B): spheres around both;
    bulge (S, B): how far a body may leave the hull of both [m]; cb, Rb, hb: boxes; half_way (3,):
    to the end of the stretch; astray (B,): how far bodies may be off the straight way [m]; hint
    (3,): where the smallest clearance was last. Beyond cap [m] nothing is looked for: both are at
    most that. The lower bound is of no use where something overlaps.
    """
    found = np.array([-1, -1, -1])
    nearest, least = cap, cap
    points, normal = np.empty((2, 3)), np.empty(3)
    travel = np.sqrt((half_way**2).sum())
    local = np.empty(3)
    if hint[0] >= 0:
        j, i, b = hint
        d = pair_distance(centers[j, i], rotations[j, i], halves[i], cb[b], Rb[b], hb[b], points)
        if d < nearest:
            nearest = d
            found[:] = hint
    for step in range(len(ends)):
        for i in range(len(halves)):
            c, r = middles[step, i], radii[step, i]
            slack = bulge[step, i] + astray[i]
            for b in range(len(cb)):
                square = 0.0
                for k in range(3):
                    along = 0.0
                    for x in range(3):
                        along += Rb[b, x, k] * (c[x] - cb[b, x])
                    out = abs(along) - hb[b, k]
                    local[k] = 0.0
                    if out > 0.0:
                        square += out * out
                        local[k] = out if along > 0.0 else -out
                bound = np.sqrt(square) - r - travel - slack
                if square == 0.0:
                    bound = -np.inf
                if bound >= nearest:
                    continue
                if square > 0.0:
                    for x in range(3):
                        normal[x] = 0.0
                        for k in range(3):
                            normal[x] += Rb[b, x, k] * local[k]
                    bound = max(
                        bound,
                        _gap(corners, ends[step], i, cb[b], Rb[b], hb[b], normal, half_way) - slack,
                    )
                    if bound >= nearest:
                        continue
                for side in range(2):
                    j = ends[step, side]
                    d = pair_distance(
                        centers[j, i], rotations[j, i], halves[i], cb[b], Rb[b], hb[b], points
                    )
                    if d < nearest:
                        nearest = d
                        found[0], found[1], found[2] = j, i, b
                    if d > _APART:
                        for x in range(3):
                            normal[x] = points[0, x] - points[1, x]
                        gap = _gap(corners, ends[step], i, cb[b], Rb[b], hb[b], normal, half_way)
                        bound = max(bound, gap - slack)
                    if bound >= nearest:
                        break
                least = min(least, bound)
    return nearest, min(least, nearest), found


@njit(cache=True, nogil=True)
def _gap(
    corners: Array, ends: IntArray, i: int, c: Array, R: Array, h: Array, n: Array, half_way: Array
) -> float:
    """How far along n, out of the box, the body's corners in both postures stay from it while they
    move by half_way to and fro [m]."""
    size = np.sqrt((n**2).sum())
    low = np.inf
    for side in range(2):
        for corner in range(8):
            at = 0.0
            for x in range(3):
                at += n[x] * (corners[ends[side], i, corner, x] - c[x])
            low = min(low, at)
    for k in range(3):
        along = 0.0
        for x in range(3):
            along += n[x] * R[x, k]
        low -= abs(along) * h[k]
    moved = 0.0
    for x in range(3):
        moved += n[x] * half_way[x]
    return float((low - abs(moved)) / size)
