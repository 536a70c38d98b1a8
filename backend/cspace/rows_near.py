"""Which rows a body and a polygon can meet in.

Those whose pivots are within the body's reach of the polygon, and in which it is not beside all
that the body sweeps: from a row's first cell to its last it stays on one side of two lines that
turn with the row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from backend.cspace.exact_levels import RUN, Level
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows_vector import LEVER_X, LEVER_Z, MARGIN, ORIGIN, SIZE, X, Z
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

_SLACK = 1e-9  # [m] more than rounding moves anything here


class Swept(NamedTuple):
    """What holds a body in all cells of a row, about its pivot: the disc of `reach`, and the
    half-planes n . x <= offset ahead of the last cell and behind the first; the normals n are the
    direction of the row's first cell turned by an angle with this cosine and sine.
    """

    reach: float
    ahead: tuple[float, float, float]
    behind: tuple[float, float, float]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def swept_of(body: Profiles, b: int, level: Level) -> Swept:
    """Of body b; with all that the angle can differ from its cell's, see Level."""
    way = math.copysign(1.0, level.step)
    span, more = abs(level.step) * (level.cells - 1), abs(level.turn)
    ahead, behind = (1.0, 0.0, math.inf), (1.0, 0.0, math.inf)
    for j in range(body.sides[b]):
        normal = body.normal[b, j]
        # Ahead, the line turns with the last cell; seen from the body, it comes from farther on.
        offset = _support(body, b, normal, way * (span + more), -way * more)
        if offset < ahead[2]:
            turn = normal + way * span
            ahead = (math.cos(turn), math.sin(turn), offset + _SLACK)
        offset = _support(body, b, normal, -way * (span + more), way * more)
        if offset < behind[2]:
            behind = (math.cos(normal), math.sin(normal), offset + _SLACK)
    return Swept(body.reach[b], ahead, behind)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _support(body: Profiles, b: int, normal: float, far: float, near: float) -> float:
    """How far the body reaches in any direction from normal + near to normal + far."""
    middle, half = normal + 0.5 * (far + near), 0.5 * abs(far - near)
    most = -math.inf
    for v in range(body.sides[b]):
        off = abs(body.bearing[b, v] - middle) % (2.0 * math.pi)
        off = max(min(off, 2.0 * math.pi - off) - half, 0.0)
        most = max(most, body.radius[b, v] * math.cos(min(off, math.pi)))
    return most


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def near_rows(
    x: Array, z: Array, origin: Array, margin: Array, first_x: Array, first_z: Array,
    lever_x: Array, lever_z: Array, runs: tuple[Array, Array],
    around: tuple[float, float, float, float], swept: Swept, widest: float, done: BoolArray,
    m: int, d: Array, place: IntArray, some: AnyArray,
) -> tuple[int, int]:  # fmt: skip
    """Fill a batch with the rows from m on in which the body can meet what is within the rectangle
    `around`: left, below, right, above; but for rows `done`. How many, and where to go on. See
    Level. some: (RUN,) room to work.
    """
    left, below, right, above = around
    low, high = runs
    count, within, levers = 0, swept.reach + widest, len(lever_x) > 0
    while m < len(x) and count <= SIZE - RUN:
        run = m // RUN
        dx = max(left - high[run, 0], 0.0, low[run, 0] - right)
        dz = max(below - high[run, 1], 0.0, low[run, 1] - above)
        if dx * dx + dz * dz > within * within:
            m += RUN
            continue
        n = min(RUN, len(x) - m)
        if not _meet(x, z, margin, first_x, first_z, done, m, n, around, swept, some):
            m += n
            continue
        for k in range(n):
            # What is not wanted is written over by the next.
            d[X + count], d[Z + count], place[count] = x[m], z[m], m
            d[ORIGIN + count] = origin[m]
            if levers:  # else margins are 0, as they are from the beginning
                d[MARGIN + count] = margin[m]
                d[LEVER_X + count], d[LEVER_Z + count] = lever_x[m], lever_z[m]
            count += some[k]
            m += 1
    return count, m


@njit(cache=True, nogil=True, _nrt=False, fastmath={"nnan", "nsz"})  # type: ignore[untyped-decorator]
def _meet(
    x: Array, z: Array, margin: Array, first_x: Array, first_z: Array, done: BoolArray, m: int,
    n: int, around: tuple[float, float, float, float], swept: Swept, some: AnyArray,
) -> bool:  # fmt: skip
    """some: 1 for those of the rows m, m + 1, ... that `near_rows` wants, 0 for the others; whether
    there are any.
    """
    if m < 0 or n > RUN:
        return False
    any_row = False
    reach, (c1, s1, offset1), (c2, s2, offset2) = swept.reach, swept.ahead, swept.behind
    for k in range(n):
        r = m + k
        px, pz, more = x[r], z[r], max(margin[r], 0.0)
        left, right, below, above = around[0] - px, around[2] - px, around[1] - pz, around[3] - pz
        dx, dz = max(max(left, -right), 0.0), max(max(below, -above), 0.0)
        ux, uz = first_x[r], first_z[r]
        nx, nz = c1 * ux - s1 * uz, s1 * ux + c1 * uz
        ahead = min(nx * left, nx * right) + min(nz * below, nz * above) - offset1
        nx, nz = c2 * ux - s2 * uz, s2 * ux + c2 * uz
        behind = min(nx * left, nx * right) + min(nz * below, nz * above) - offset2
        near = reach + more
        meet = (dx * dx + dz * dz <= near * near) & (max(ahead, behind) <= more)
        meet &= not done[r]
        some[k] = meet
        any_row |= meet
    return any_row
