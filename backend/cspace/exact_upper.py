"""Whether a body that turns with the swing, or does not turn at all, touches obstacles."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray

DEPTH = 6
"""A swing cell is halved at most this often before it stays undecided."""
_PAD = 1e-9


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _turned_gap(
    center: Array,
    R: Array,
    half: Array,
    c: Array,
    Q: Array,
    h: Array,
    cos: float,
    sin: float,
    enough: float,
) -> float:
    """`gap` of a box turned about z from an obstacle (c, Q, h), or a lower bound above `enough`."""
    x, y = cos * center[0] - sin * center[1], sin * center[0] + cos * center[1]
    dx, dy, dz = x - c[0], y - c[1], center[2] - c[2]
    spheres = math.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2) + enough
    spheres += math.sqrt(h[0] ** 2 + h[1] ** 2 + h[2] ** 2)
    apart = dx * dx + dy * dy + dz * dz
    if apart > spheres * spheres:
        return math.sqrt(apart) - spheres + enough
    at, turned = np.empty(3), np.empty((3, 3))
    at[0], at[1], at[2] = x, y, center[2]
    for k in range(3):
        turned[0, k] = cos * R[0, k] - sin * R[1, k]
        turned[1, k] = sin * R[0, k] + cos * R[1, k]
        turned[2, k] = R[2, k]
    return float(gap(at, turned, half, c, Q, h, enough))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _decide(
    own: tuple[Array, Array, Array],
    others: tuple[Array, Array, Array],
    pairs: BoolArray,
    radius: Array,
    angle: float,
    half_cell: float,
    colliding: bool,
    depth: int,
) -> bool:
    """With `colliding`: whether some pair surely touches at every angle of the cell. Without:
    whether some pair may touch at some angle.
    """
    stack = np.empty((depth + 2, 3))
    stack[0, 0], stack[0, 1], stack[0, 2] = angle, half_cell, depth
    size = 1
    while size > 0:
        size -= 1
        middle, half, left = stack[size, 0], stack[size, 1], stack[size, 2]
        # No point of a body moves farther than its radius times this within the part.
        chord = 2.0 * math.sin(0.5 * min(half, math.pi))
        sure, maybe = False, False
        cos, sin = math.cos(middle), math.sin(middle)
        for i in range(len(own[0])):
            moved = radius[i] * chord + _PAD
            for j in range(len(others[0])):
                if sure or not pairs[i, j]:
                    continue
                g = _turned_gap(
                    own[0][i], own[1][i], own[2][i], others[0][j], others[1][j], others[2][j],
                    cos, sin, moved,
                )  # fmt: skip
                sure = sure or g < -moved
                maybe = maybe or g <= moved
        if sure or not maybe:
            # One part settles it, unless it is what every part must be.
            if sure != colliding:
                return not colliding
            continue
        if left == 0.0:
            return not colliding
        for side in (-0.5, 0.5):
            stack[size, 0], stack[size, 1] = middle + side * half, 0.5 * half
            stack[size, 2] = left - 1.0
            size += 1
    return colliding


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def turned_touches(
    own: tuple[Array, Array, Array],
    others: tuple[Array, Array, Array],
    pairs: BoolArray,
    radius: Array,
    angle: float,
    half_cell: float,
    kind: int,
) -> bool:
    """`touching_swings` at one angle. radius: (own,) of the bodies about the axis [m]."""
    if kind != 0:
        return bool(_decide(own, others, pairs, radius, angle, half_cell, kind < 0, DEPTH))
    cos, sin = math.cos(angle), math.sin(angle)
    for i in range(len(own[0])):
        for j in range(len(others[0])):
            if not pairs[i, j]:
                continue
            g = _turned_gap(
                own[0][i], own[1][i], own[2][i], others[0][j], others[1][j], others[2][j],
                cos, sin, 0.0,
            )  # fmt: skip
            if g <= 0.0:
                return True
    return False


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _states(
    own: tuple[Array, Array, Array],
    others: tuple[Array, Array, Array],
    pairs: BoolArray,
    radius: Array,
    angles: Array,
    half_cell: float,
    kind: int,
) -> BoolArray:
    out = np.zeros(len(angles), np.bool_)
    for s in range(len(angles)):
        out[s] = turned_touches(own, others, pairs, radius, angles[s], half_cell, kind)
    return out


def touching_swings(
    own: Boxes,
    obstacles: Boxes,
    pairs: BoolArray,
    angles: Array,
    half_cell: float = 0.0,
    kind: int = 0,
) -> BoolArray:
    """(n,) whether boxes that turn about z by `angles` (n,) [rad] touch obstacles.

    Both in one frame with z the swing axis. kind: 0 at the angles themselves; 1 whether they may
    touch somewhere within half_cell [rad] of an angle; -1 whether they surely touch at each angle
    within it. pairs: (own, obstacles) which count.
    """
    corners = own.corners()
    radius = np.hypot(corners[:, :, 0], corners[:, :, 1]).max(axis=1, initial=0.0)
    found = _states(
        (own.centers, own.rotations, own.half_extents),
        (obstacles.centers, obstacles.rotations, obstacles.half_extents),
        np.ascontiguousarray(pairs),
        radius,
        np.ascontiguousarray(angles, dtype=float),
        float(half_cell),
        kind,
    )
    return np.asarray(found, dtype=bool)
