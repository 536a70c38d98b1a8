"""Where the pivots of boom, stick and bucket stand in every row of an image.

The swing turns the whole arm, so that its pivots are the same in the arm's plane whatever the
swing: they are computed once for an image.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.spatial.types import Array

EXACT, OUTER, INNER = 0, 1, -1
"""Cells at their centres; all that is not surely free; only what is surely blocked."""

ROUNDING = 1e-9
"""[m], [rad]: certified bounds are moved outward by more than the kernels round."""

RUN = 16
"""Rows that are looked at together before each for itself."""

START, STEP, COUNT, HALF = 0, 1, 2, 3
"""Columns of axes (4, 4), a row for each joint: `count` cells at start + i step, as angles in the
arm's plane; `half` of a cell, 0 where the value is exact [rad]."""


class Level(NamedTuple):
    """The rows of one joint: for the boom 1, for the stick one for each cell of the boom, for the
    bucket one for each cell of boom and stick.

    kind: EXACT, OUTER, INNER; x, z: (m,) pivots [m]; origin: (m,) angles of the first cells [rad],
    first_x, first_z: (m,) and their directions; margin: (m,) how far a pivot can be from there [m],
    0 when EXACT; turn: how far the angle can be from its cell's [rad]; both below 0 for INNER.
    step, cells: of the rows. widest: the largest margin; low, high: (runs, 2) bounds of the pivots
    of RUN rows.

    Along one direction a pivot moves less than in all: the boom turns it by up to `boom` about
    (boom_x, boom_z), the stick by up to `stick` about a point that is (lever_x, lever_z), (m,),
    behind it, () when EXACT; bend: what the paths' curvature adds at most [m].
    """

    kind: int
    x: Array
    z: Array
    origin: Array
    first_x: Array
    first_z: Array
    margin: Array
    lever_x: Array
    lever_z: Array
    boom_x: float
    boom_z: float
    boom: float
    stick: float
    bend: float
    turn: float
    step: float
    cells: int
    widest: float
    low: Array
    high: Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def levels(links: Array, axes: Array, kind: int) -> tuple[Level, Level, Level]:
    """Boom, stick and bucket. links: (3, 2) the boom's pivot, and from pivot to pivot at joint
    values 0 [m]; axes: (4, 4) see START.
    """
    n1, n2 = int(axes[1, COUNT]), int(axes[2, COUNT])
    half1, half2, half3 = axes[1, HALF], axes[2, HALF], axes[3, HALF]
    ox, oz = links[0, 0], links[0, 1]
    l1, l2 = math.hypot(links[1, 0], links[1, 1]), math.hypot(links[2, 0], links[2, 1])
    rows = n1 * n2
    x0, z0, origin0, first0 = (
        np.full(1, ox),
        np.full(1, oz),
        np.full(1, axes[1, START]),
        np.empty(2),
    )
    x1, z1, origin1, first1 = np.empty(n1), np.empty(n1), np.empty(n1), np.empty((2, n1))
    x2, z2, origin2, first2 = np.empty(rows), np.empty(rows), np.empty(rows), np.empty((2, rows))
    margin0, margin1, margin2 = np.full(1, kind * ROUNDING), np.empty(n1), np.empty(rows)
    levers = rows if kind != EXACT else 0
    lever_x, lever_z = np.empty(levers), np.empty(levers)
    u2, f2 = np.empty((n2, 2)), np.empty((n2, 2))
    for j in range(n2):
        angle = axes[2, START] + axes[2, STEP] * j
        c, s = math.cos(angle), math.sin(angle)
        u2[j, 0] = c * links[2, 0] - s * links[2, 1]
        u2[j, 1] = s * links[2, 0] + c * links[2, 1]
        f2[j, 0], f2[j, 1] = math.cos(axes[3, START] + angle), math.sin(axes[3, START] + angle)
    first0[0], first0[1] = math.cos(axes[1, START]), math.sin(axes[1, START])
    b, a = math.cos(axes[2, START]), math.sin(axes[2, START])
    for i in range(n1):
        angle = axes[1, START] + axes[1, STEP] * i
        c, s = math.cos(angle), math.sin(angle)
        vx, vz = c * links[1, 0] - s * links[1, 1], s * links[1, 0] + c * links[1, 1]
        x1[i], z1[i] = ox + vx, oz + vz
        origin1[i] = axes[2, START] + angle
        first1[0, i], first1[1, i] = c * b - s * a, s * b + c * a
        margin1[i] = kind * (l1 * half1 + ROUNDING)
        for j in range(n2):
            k = i * n2 + j
            wx, wz = c * u2[j, 0] - s * u2[j, 1], s * u2[j, 0] + c * u2[j, 1]
            x2[k], z2[k] = x1[i] + wx, z1[i] + wz
            origin2[k] = axes[3, START] + (angle + (axes[2, START] + axes[2, STEP] * j))
            first2[0, k], first2[1, k] = c * f2[j, 0] - s * f2[j, 1], s * f2[j, 0] + c * f2[j, 1]
            if kind == EXACT:
                margin2[k] = 0.0
                continue
            # The boom turns the stick's pivot about its own, and the bucket's; the stick that one.
            away = math.hypot(vx + wx, vz + wz) + l2 * half2
            margin2[k] = kind * (away * half1 + l2 * half2 + ROUNDING)
            lever_x[k], lever_z[k] = wx, wz
    none0, none1 = np.zeros(min(levers, 1)), np.zeros(min(levers, n1))
    bend1 = 0.5 * l1 * half1 * half1 + ROUNDING
    bend2 = 0.5 * (l1 + l2) * half1 * half1 + l2 * half2 * (half1 + 0.5 * half2) + ROUNDING
    low0, high0, _ = _runs(x0, z0, margin0)
    low1, high1, widest1 = _runs(x1, z1, margin1)
    low2, high2, widest2 = _runs(x2, z2, margin2)
    turn1, turn2 = kind * (half1 + ROUNDING), kind * (half1 + half2 + ROUNDING)
    turn3 = kind * (half1 + half2 + half3 + ROUNDING)
    return (
        Level(
            kind, x0, z0, origin0, first0[:1], first0[1:], margin0, none0, none0, ox, oz, 0.0, 0.0,
            ROUNDING, turn1, axes[1, STEP], n1, max(margin0[0], 0.0), low0, high0,
        ),
        Level(
            kind, x1, z1, origin1, first1[0], first1[1], margin1, none1, none1, ox, oz, half1,
            0.0, bend1, turn2, axes[2, STEP], n2, widest1, low1, high1,
        ),
        Level(
            kind, x2, z2, origin2, first2[0], first2[1], margin2, lever_x, lever_z, ox, oz,
            half1, half2, bend2, turn3, axes[3, STEP], int(axes[3, COUNT]), widest2, low2, high2,
        ),
    )  # fmt: skip


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _runs(x: Array, z: Array, margin: Array) -> tuple[Array, Array, float]:
    """Bounds (runs, 2) of every RUN pivots, and the largest margin, at least 0."""
    count = (len(x) + RUN - 1) // RUN
    low, high, widest = np.full((count, 2), math.inf), np.full((count, 2), -math.inf), 0.0
    for k in range(len(x)):
        r = k // RUN
        low[r, 0], high[r, 0] = min(low[r, 0], x[k]), max(high[r, 0], x[k])
        low[r, 1], high[r, 1] = min(low[r, 1], z[k]), max(high[r, 1], z[k])
        widest = max(widest, margin[k])
    return low, high, widest
