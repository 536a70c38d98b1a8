"""Driving zone while a machine turns through less than a full circle about an upright axis.

For headings phi - h and phi + h every point of the machine stays within r (1 - cos h) of the chord
between its two positions, so each pair's slice in between lies in the convex hull of the two
slices, grown by that much.
"""

from __future__ import annotations

import numpy as np
import shapely
from numba import njit

from backend.cspace.minkowski import MOST, Pieces, box_slices, convex_hull, solid_pieces
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

STEPS = 128
"""Most headings looked at; beyond that the zone grows coarser, never smaller."""


def turning_pieces(a: Boxes, b: Boxes, begin: float, end: float, tolerance: float) -> Pieces:
    """Translations (x, y) [m] for which b, turned about its z axis by begin..end, touches a.

    The hull of two slices exceeds the swept one by up to h times half the width of a body across
    its radius: coarser than `tolerance` for bodies that the axis pierces, by some millimetres.
    """
    radius = float(np.linalg.norm(b.corners()[..., :2], axis=2).max(initial=0.0))
    half = np.sqrt(2.0 * tolerance / max(radius, tolerance))
    n = int(np.clip(np.ceil((end - begin) / (2.0 * half)), 1, STEPS))
    h = 0.5 * (end - begin) / n
    grow = radius * (1.0 - np.cos(h)) + 1e-9
    rings: list[Array] = []
    before = _at(a, b, begin)
    for k in range(n):
        after = _at(a, b, begin + 2.0 * h * (k + 1))
        rings += _hulls(before, after)
        before = after
    made = shapely.buffer([shapely.Polygon(r) for r in rings], grow, join_style="mitre")
    outlines = [shapely.get_coordinates(g)[:-1][::-1] for g in made]
    start = np.concatenate([[0], np.cumsum([len(o) for o in outlines])]).astype(np.int64)
    points = np.concatenate([*outlines, np.zeros((0, 2))])
    return solid_pieces(points, start)


_Slices = tuple[Array, IntArray, dict[tuple[int, int], int]]


def _at(a: Boxes, b: Boxes, angle: float) -> _Slices:
    R = rotation.rz(angle)
    points, start, pairs = box_slices(a, Boxes(b.centers @ R.T, R @ b.rotations, b.half_extents))
    return points, start, {(int(i), int(j)): k for k, (i, j) in enumerate(pairs)}


def _hulls(before: _Slices, after: _Slices) -> list[Array]:
    # Heights do not change in a turn about an upright axis: the same pairs meet at both ends, but
    # for slices without area, which rounding may drop.
    hulls = []
    for pair in before[2].keys() | after[2].keys():
        both = [
            s[0][s[1][s[2][pair]] : s[1][s[2][pair] + 1]] for s in (before, after) if pair in s[2]
        ]
        points = np.ascontiguousarray(np.concatenate(both))
        out = np.empty((2 * MOST + 2, 2))
        n = _hull(points, out)
        if n:
            hulls.append(out[:n])
    return hulls


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _hull(points: Array, out: Array) -> int:
    return int(convex_hull(points, len(points), out))
