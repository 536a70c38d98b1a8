"""Whether bodies that turn about z touch obstacles: at an angle, or throughout a cell of angles."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.spatial.types import Array, IntArray

DEPTH = 6
"""A cell is halved at most this often before it stays undecided."""

PAD = 1e-9
"""[m] more than the kernels round."""


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def turned_gap(
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
def decided(
    own: tuple[Array, Array, Array],
    others: tuple[Array, Array, Array],
    pairs: IntArray,
    radius: Array,
    angle: float,
    half_cell: float,
    colliding: bool,
) -> bool:
    """With `colliding`: whether some pair surely touches at every angle of the cell. Without:
    whether some pair may touch at some angle. pairs: (k, 2) own body, obstacle; radius: (own,) of
    the bodies about the axis [m].
    """
    stack = np.empty((DEPTH + 2, 3))
    stack[0, 0], stack[0, 1], stack[0, 2] = angle, half_cell, DEPTH
    size = 1
    while size > 0:
        size -= 1
        middle, half, left = stack[size, 0], stack[size, 1], stack[size, 2]
        # No point of a body moves farther than its radius times this within the part.
        chord = 2.0 * math.sin(0.5 * min(half, math.pi))
        sure, maybe = False, False
        cos, sin = math.cos(middle), math.sin(middle)
        for k in range(len(pairs)):
            i, j = pairs[k, 0], pairs[k, 1]
            moved = radius[i] * chord + PAD
            g = turned_gap(
                own[0][i], own[1][i], own[2][i], others[0][j], others[1][j], others[2][j],
                cos, sin, moved,
            )  # fmt: skip
            sure = g < -moved
            maybe = maybe or g <= moved
            if sure:
                break
        if sure or not maybe:
            # One part settles it, unless it is what every part must be.
            if sure != colliding:
                return not colliding
            continue
        if left == 0.0 or half == 0.0:
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
    pairs: IntArray,
    radius: Array,
    angle: float,
    half_cell: float,
    kind: int,
) -> bool:
    """Whether some pair touches: at the angle for kind 0, as `decided` for 1 (may), -1 (must)."""
    if kind != 0:
        return bool(decided(own, others, pairs, radius, angle, half_cell, kind < 0))
    cos, sin = math.cos(angle), math.sin(angle)
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        g = turned_gap(
            own[0][i], own[1][i], own[2][i], others[0][j], others[1][j], others[2][j], cos, sin, 0.0
        )  # fmt: skip
        if g <= 0.0:
            return True
    return False
