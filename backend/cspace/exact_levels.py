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

    kind: EXACT, OUTER, INNER; rows: (8, p) their values, see X_ROW, in runs of RUN, those behind
    the last one far from everything; runs: (4, p / RUN) left, below, right and above bounds of the
    pivots of each run; widest: the largest margin, at least 0 [m]. turn: how far the angle can be
    from its cell's, below 0 for INNER [rad]; step, cells: of the rows.

    Along one direction a pivot moves less than in all: the boom turns it by up to `boom` about
    (boom_x, boom_z), the stick by up to `stick` about the point behind it; bend: what the paths'
    curvature adds at most [m].
    """

    kind: int
    rows: Array
    runs: Array
    widest: float
    boom_x: float
    boom_z: float
    boom: float
    stick: float
    bend: float
    turn: float
    step: float
    cells: int


X_ROW, Z_ROW, ORIGIN_ROW, MARGIN_ROW, LEVER_X_ROW, LEVER_Z_ROW, FIRST_X_ROW, FIRST_Z_ROW = range(8)
"""Values of rows: pivots [m]; angles of the first cells [rad]; how far a pivot can be from there,
below 0 for INNER, 0 when EXACT [m]; from the point that the stick turns it about, 0 when EXACT [m];
and the directions of the first cells.
"""


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def levels(links: Array, axes: Array, kind: int) -> tuple[Level, Level, Level]:
    """Boom, stick and bucket. links: (3, 2) the boom's pivot, and from pivot to pivot at joint
    values 0 [m]; axes: (4, 4) see START.
    """
    n1, n2 = int(axes[1, COUNT]), int(axes[2, COUNT])
    half1, half2, half3 = axes[1, HALF], axes[2, HALF], axes[3, HALF]
    ox, oz = links[0, 0], links[0, 1]
    l1, l2 = math.hypot(links[1, 0], links[1, 1]), math.hypot(links[2, 0], links[2, 1])
    rows0, rows1, rows2 = _new_rows(1), _new_rows(n1), _new_rows(n1 * n2)
    u2, f2 = np.empty((n2, 2)), np.empty((n2, 2))
    for j in range(n2):
        angle = axes[2, START] + axes[2, STEP] * j
        c, s = math.cos(angle), math.sin(angle)
        u2[j, 0] = c * links[2, 0] - s * links[2, 1]
        u2[j, 1] = s * links[2, 0] + c * links[2, 1]
        f2[j, 0], f2[j, 1] = math.cos(axes[3, START] + angle), math.sin(axes[3, START] + angle)
    rows0[X_ROW, 0], rows0[Z_ROW, 0], rows0[ORIGIN_ROW, 0] = ox, oz, axes[1, START]
    rows0[FIRST_X_ROW, 0], rows0[FIRST_Z_ROW, 0] = (
        math.cos(axes[1, START]),
        math.sin(axes[1, START]),
    )
    rows0[MARGIN_ROW, 0] = kind * ROUNDING
    b, a = math.cos(axes[2, START]), math.sin(axes[2, START])
    for i in range(n1):
        angle = axes[1, START] + axes[1, STEP] * i
        c, s = math.cos(angle), math.sin(angle)
        vx, vz = c * links[1, 0] - s * links[1, 1], s * links[1, 0] + c * links[1, 1]
        rows1[X_ROW, i], rows1[Z_ROW, i] = ox + vx, oz + vz
        rows1[ORIGIN_ROW, i] = axes[2, START] + angle
        rows1[FIRST_X_ROW, i], rows1[FIRST_Z_ROW, i] = c * b - s * a, s * b + c * a
        rows1[MARGIN_ROW, i] = kind * (l1 * half1 + ROUNDING)
        for j in range(n2):
            k = i * n2 + j
            wx, wz = c * u2[j, 0] - s * u2[j, 1], s * u2[j, 0] + c * u2[j, 1]
            rows2[X_ROW, k], rows2[Z_ROW, k] = ox + vx + wx, oz + vz + wz
            rows2[ORIGIN_ROW, k] = axes[3, START] + (angle + (axes[2, START] + axes[2, STEP] * j))
            rows2[FIRST_X_ROW, k] = c * f2[j, 0] - s * f2[j, 1]
            rows2[FIRST_Z_ROW, k] = s * f2[j, 0] + c * f2[j, 1]
            if kind == EXACT:
                continue
            # The boom turns the stick's pivot about its own, and the bucket's; the stick that one.
            away = math.hypot(vx + wx, vz + wz) + l2 * half2
            rows2[MARGIN_ROW, k] = kind * (away * half1 + l2 * half2 + ROUNDING)
            rows2[LEVER_X_ROW, k], rows2[LEVER_Z_ROW, k] = wx, wz
    bend1 = 0.5 * l1 * half1 * half1 + ROUNDING
    bend2 = 0.5 * (l1 + l2) * half1 * half1 + l2 * half2 * (half1 + 0.5 * half2) + ROUNDING
    runs0, widest0 = _runs(rows0, 1)
    runs1, widest1 = _runs(rows1, n1)
    runs2, widest2 = _runs(rows2, n1 * n2)
    turn1, turn2 = kind * (half1 + ROUNDING), kind * (half1 + half2 + ROUNDING)
    turn3 = kind * (half1 + half2 + half3 + ROUNDING)
    return (
        Level(
            kind, rows0, runs0, widest0, ox, oz, 0.0, 0.0, ROUNDING,
            turn1, axes[1, STEP], n1,
        ),
        Level(
            kind, rows1, runs1, widest1, ox, oz, half1, 0.0, bend1,
            turn2, axes[2, STEP], n2,
        ),
        Level(
            kind, rows2, runs2, widest2, ox, oz, half1, half2, bend2,
            turn3, axes[3, STEP], int(axes[3, COUNT]),
        ),
    )  # fmt: skip


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _new_rows(count: int) -> Array:
    """Whole runs for `count` rows, all of them far from everything."""
    rows = np.zeros((8, (count + RUN - 1) // RUN * RUN))
    rows[X_ROW], rows[Z_ROW] = math.inf, math.inf
    return rows


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _runs(rows: Array, count: int) -> tuple[Array, float]:
    """Bounds (4, runs) of every RUN pivots, and the largest margin, at least 0."""
    runs, widest = np.empty((4, rows.shape[1] // RUN)), 0.0
    for r in range(runs.shape[1]):
        left, below, right, above = math.inf, math.inf, -math.inf, -math.inf
        for k in range(r * RUN, min((r + 1) * RUN, count)):
            left, right = min(left, rows[X_ROW, k]), max(right, rows[X_ROW, k])
            below, above = min(below, rows[Z_ROW, k]), max(above, rows[Z_ROW, k])
            widest = max(widest, rows[MARGIN_ROW, k])
        runs[0, r], runs[1, r], runs[2, r], runs[3, r] = left, below, right, above
    return runs, widest
