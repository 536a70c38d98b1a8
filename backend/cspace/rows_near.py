"""Which rows a body and a polygon can meet in.

Those whose pivots are within the body's reach of the polygon, and in which it is not beside all
that the body sweeps: from a row's first cell to its last it stays on one side of two lines that
turn with the row.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.exact_levels import (
    FIRST_X_ROW,
    FIRST_Z_ROW,
    LEVER_X_ROW,
    LEVER_Z_ROW,
    MARGIN_ROW,
    ORIGIN_ROW,
    RUN,
    X_ROW,
    Z_ROW,
    Level,
)
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows_vector import LEVER_X, LEVER_Z, MARGIN, ORIGIN, SIZE, X, Z
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

_SLACK = 1e-9  # [m] more than rounding moves anything here
Swept = tuple[float, float, float, float, float, float]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def swept_of(body: Profiles, level: tuple[Level, Level, Level]) -> Array:
    """(n, 6) half-planes n . x <= offset about the pivot that hold a body in all cells of a row:
    ahead of the last one and behind the first. Of each the cosine and sine of the angle from the
    direction of the row's first cell to n, and the offset [m].
    """
    out = np.empty((len(body.group), 6))
    for b in range(len(out)):
        of = level[0] if body.group[b] == 0 else level[1] if body.group[b] == 1 else level[2]
        way = math.copysign(1.0, of.step)
        # With all that the angle can differ from its cell's.
        span, more = abs(of.step) * (of.cells - 1), abs(of.turn)
        out[b] = (1.0, 0.0, math.inf, 1.0, 0.0, math.inf)
        for j in range(body.sides[b]):
            normal = body.normal[b, j]
            # Seen from the body, a line that turns with the last cell comes from farther on.
            offset = _support(body, b, normal, way * (span + more), -way * more)
            if offset < out[b, 2]:
                turn = normal + way * span
                out[b, :3] = (math.cos(turn), math.sin(turn), offset + _SLACK)
            offset = _support(body, b, normal, -way * (span + more), way * more)
            if offset < out[b, 5]:
                out[b, 3:] = (math.cos(normal), math.sin(normal), offset + _SLACK)
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _support(body: Profiles, b: int, normal: float, far: float, near: float) -> float:
    """How far the body reaches in any direction from normal + near to normal + far."""
    middle, half = normal + 0.5 * (far + near), 0.5 * abs(far - near)
    most = -math.inf
    for v in range(body.sides[b]):
        off = abs(body.bearing[b, v] - middle) % (2.0 * math.pi)
        off = max(min(off, 2.0 * math.pi - off) - half, 0.0)
        most = max(most, body.radius[b, v] * math.cos(off))
    return most


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def near_runs(
    runs: Array, around: tuple[float, float, float, float], within: float, some: AnyArray,
    found: IntArray,
) -> int:  # fmt: skip
    """Put the runs that are `within` a distance of the rectangle `around` into `found`, (r,): left,
    below, right, above; how many. some: (r,) room to work.
    """
    left, below, right, above = around
    n, count = runs.shape[1], 0
    for k in range(n):
        dx = max(left - runs[2, k], runs[0, k] - right)
        dz = max(below - runs[3, k], runs[1, k] - above)
        dx, dz = max(dx, 0.0), max(dz, 0.0)
        some[k] = dx * dx + dz * dz <= within * within
    for k in range(n):
        found[count] = k  # what is not wanted is written over by the next
        count += some[k]
    return count


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def near_rows(
    rows: Array, found: IntArray, runs: int, at: int, around: tuple[float, float, float, float],
    reach: float, swept: Swept, moves: bool, done: BoolArray, d: Array, place: IntArray,
    some: AnyArray,
) -> tuple[int, int]:  # fmt: skip
    """Fill a batch with those rows of the runs from `at` on in which the body can meet what is
    within the rectangle `around`, but for rows `done`: how many, and at which run to go on. moves:
    whether pivots do; if not, margins are 0 in the batch already. some: (RUN,) room to work.
    """
    count = 0
    while at < runs and count <= SIZE - RUN:
        m = found[at] * RUN
        at += 1
        _meet(rows, m, around, reach, swept, some)
        for k in range(RUN):
            place[count] = m + k  # what is not wanted is written over by the next
            count += some[k] & (not done[m + k])
    _copy(rows, place, count, X_ROW, X, d)
    _copy(rows, place, count, Z_ROW, Z, d)
    _copy(rows, place, count, ORIGIN_ROW, ORIGIN, d)
    if moves:
        _copy(rows, place, count, MARGIN_ROW, MARGIN, d)
        _copy(rows, place, count, LEVER_X_ROW, LEVER_X, d)
        _copy(rows, place, count, LEVER_Z_ROW, LEVER_Z, d)
    return count, at


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _copy(rows: Array, place: IntArray, count: int, value: int, begin: int, d: Array) -> None:
    if begin < 0 or count > SIZE:
        return
    for r in range(count):
        d[begin + r] = rows[value, place[r]]


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _meet(
    rows: Array, m: int, around: tuple[float, float, float, float], reach: float, swept: Swept,
    some: AnyArray,
) -> None:  # fmt: skip
    """some: 1 for those of the run that begins at row m that `near_rows` wants, 0 for others."""
    if m < 0:
        return
    c1, s1, offset1, c2, s2, offset2 = swept
    for k in range(RUN):
        r = m + k
        px, pz, more = rows[X_ROW, r], rows[Z_ROW, r], max(rows[MARGIN_ROW, r], 0.0)
        left, right, below, above = around[0] - px, around[2] - px, around[1] - pz, around[3] - pz
        dx, dz = max(max(left, -right), 0.0), max(max(below, -above), 0.0)
        ux, uz = rows[FIRST_X_ROW, r], rows[FIRST_Z_ROW, r]
        nx, nz = c1 * ux - s1 * uz, s1 * ux + c1 * uz
        ahead = min(nx * left, nx * right) + min(nz * below, nz * above) - offset1
        nx, nz = c2 * ux - s2 * uz, s2 * ux + c2 * uz
        behind = min(nx * left, nx * right) + min(nz * below, nz * above) - offset2
        near = reach + more
        some[k] = (dx * dx + dz * dz <= near * near) & (max(ahead, behind) <= more)
