"""The image kernel: for each swing the boom's row, for each boom the stick's, for each stick the
bucket's, all against the polygons of that swing.

What a link touches blocks everything further out. Rows are handed to `rows_batch` by pairs of a
body and a polygon, those only that are within the body's reach. The same kernel makes the exact
image and both bounds of the certified one; the levels say which.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.cspace.exact_levels import EXACT, RUN, Level
from backend.cspace.exact_slices import slices
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows import ALL, Polygons, rectangle_distance, touched
from backend.cspace.rows_batch import SIZE, Batch, new_batch, touched_rows
from backend.spatial.types import AnyArray, Array, BoolArray


class Chain(NamedTuple):
    """T_arm_root: (3, 4) at swing 0; links: (3, 2) the boom's pivot, and from pivot to pivot at
    joint values 0; pivots: (3, 2) of boom, stick and bucket there; reach: (3,) of their bodies from
    the boom's pivot [m]. Boxes of the bodies in the frame `arm` at joint values 0, for those whose
    prism is not exact: centers (n, 3), rotations (n, 3, 3), halves (n, 3), askew (n,).
    """

    T_arm_root: Array
    links: Array
    pivots: Array
    reach: Array
    centers: Array
    rotations: Array
    halves: Array
    askew: BoolArray


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _box_touches(
    chain: Chain,
    group: int,
    b: int,
    boxes: tuple[Array, Array, Array],
    j: int,
    px: float,
    pz: float,
    angle: float,
) -> bool:
    """Whether the box of body b, turned by `angle` about its pivot (px, pz), touches obstacle j."""
    c, s = math.cos(angle), math.sin(angle)
    center, R = np.empty(3), np.empty((3, 3))
    x = chain.centers[b, 0] - chain.pivots[group, 0]
    z = chain.centers[b, 2] - chain.pivots[group, 1]
    center[0], center[1], center[2] = px + c * x - s * z, chain.centers[b, 1], pz + s * x + c * z
    for k in range(3):
        R[0, k] = c * chain.rotations[b, 0, k] - s * chain.rotations[b, 2, k]
        R[1, k] = chain.rotations[b, 1, k]
        R[2, k] = s * chain.rotations[b, 0, k] + c * chain.rotations[b, 2, k]
    return bool(gap(center, R, chain.halves[b], boxes[0][j], boxes[1][j], boxes[2][j], 0.0) <= 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def full_words(n: int) -> AnyArray:
    """Words with the first n bits set."""
    words = (n + 63) // 64
    out = np.full(words, ALL, np.uint64)
    if n % 64:
        out[words - 1] = ALL >> np.uint64(64 - n % 64)
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _keep_box(
    chain: Chain,
    group: int,
    b: int,
    boxes: tuple[Array, Array, Array],
    j: int,
    level: Level,
    batch: Batch,
    r: int,
    full: AnyArray,
    row: AnyArray,
) -> None:
    """Clear the bits of row r of the batch in which the box itself does not touch obstacle j; those
    of `row` are known already.
    """
    for w in range(len(row)):
        batch.blocked[w, r] &= full[w] & ~row[w]
        for bit in range(64):
            if not (batch.blocked[w, r] >> np.uint64(bit)) & np.uint64(1):
                continue
            angle = batch.origin[r] + (64 * w + bit) * level.step
            if not _box_touches(chain, group, b, boxes, j, batch.x[r], batch.z[r], angle):
                batch.blocked[w, r] &= ~(np.uint64(1) << np.uint64(bit))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _finish(
    chain: Chain,
    group: int,
    b: int,
    body: Profiles,
    polygons: Polygons,
    p: int,
    boxes: tuple[Array, Array, Array],
    level: Level,
    batch: Batch,
    count: int,
    full: AnyArray,
    done: BoolArray,
    out: AnyArray,
) -> None:
    """Write the rows of a batch to out (m, words); those that are full now are done."""
    count = touched_rows(body, b, polygons, p, level, batch, count, full)
    for r in range(count):
        row = out[batch.place[r]]
        if batch.doubt[r] < 0.0:
            batch.blocked[:, r] = 0
            touched(
                body, b, polygons, p, batch.x[r], batch.z[r], batch.origin[r], level.step,
                level.cells, batch.margin[r], level.turn, batch.blocked[:, r],
            )  # fmt: skip
        if level.kind == EXACT and chain.askew[b]:
            _keep_box(chain, group, b, boxes, polygons.obstacle[p], level, batch, r, full, row)
        every = True
        for w in range(len(row)):
            row[w] |= batch.blocked[w, r] & full[w]
            every = every and row[w] == full[w]
        done[batch.place[r]] = every


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _rows(
    chain: Chain,
    group: int,
    body: Profiles,
    polygons: Polygons,
    pairs: BoolArray,
    boxes: tuple[Array, Array, Array],
    level: Level,
    done: BoolArray,
    batch: Batch,
    full: AnyArray,
    out: AnyArray,
) -> None:
    """Set the bits of out (m, words) that the bodies of the group block, but for rows `done`; rows
    that get full are done, too.
    """
    for turn in range(2):
        for b in range(len(body.group)):
            # Boxes that are not prisms are dear: they come last, and only for what is still free.
            late = level.kind == EXACT and chain.askew[b]
            if body.group[b] != group or body.sides[b] == 0 or late != (turn == 1):
                continue
            within = body.reach[b] + level.widest
            for p in range(len(polygons.slab)):
                if polygons.slab[p] != body.slab[b] or not pairs[b, polygons.obstacle[p]]:
                    continue
                low, high = polygons.low[p], polygons.high[p]
                count = 0
                for run in range(len(level.low)):
                    dx = max(low[0] - level.high[run, 0], 0.0, level.low[run, 0] - high[0])
                    dz = max(low[1] - level.high[run, 1], 0.0, level.low[run, 1] - high[1])
                    if dx * dx + dz * dz > within * within:
                        continue
                    for m in range(run * RUN, min(run * RUN + RUN, len(level.x))):
                        if done[m]:
                            continue
                        x, z = level.x[m], level.z[m]
                        near = body.reach[b] + max(level.margin[m], 0.0)
                        if rectangle_distance(low, high, x, z) > near * near:
                            continue
                        batch.x[count], batch.z[count], batch.place[count] = x, z, m
                        batch.origin[count], batch.margin[count] = level.origin[m], level.margin[m]
                        if level.kind != EXACT:
                            batch.lever_x[count] = level.lever_x[m]
                            batch.lever_z[count] = level.lever_z[m]
                        count += 1
                        if count == SIZE:
                            _finish(
                                chain, group, b, body, polygons, p, boxes, level, batch,
                                count, full, done, out,
                            )  # fmt: skip
                            count = 0
                if count > 0:
                    _finish(
                        chain, group, b, body, polygons, p, boxes, level, batch, count, full,
                        done, out,
                    )  # fmt: skip


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _pass_on(
    row: AnyArray, n: int, share: int, full: AnyArray, done: BoolArray, out: AnyArray
) -> None:
    """Block the `share` rows of out (m, words) behind each of the first n bits set in row."""
    for i in range(n):
        if (row[i // 64] >> np.uint64(i % 64)) & np.uint64(1):
            out[i * share : (i + 1) * share] = full
            done[i * share : (i + 1) * share] = True


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def swing_block(
    chain: Chain,
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    pairs: BoolArray,
    level: tuple[Level, Level, Level],
    spread: float,
    out: AnyArray,
) -> None:
    """One swing of an image. boxes: obstacles in the frame `arm` of that swing; spread: half a cell
    of the swing [rad]; out: (boom * stick, words), 0.
    """
    boom, stick, bucket = level
    polygons = slices(body, boxes, pairs, boom.kind, spread, chain.pivots[0], chain.reach)
    if len(polygons.slab) == 0:
        return
    full1, full2, full3 = full_words(boom.cells), full_words(stick.cells), full_words(bucket.cells)
    corners = polygons.x.shape[1]
    row1, done1 = np.zeros((1, len(full1)), np.uint64), np.zeros(1, np.bool_)
    _rows(
        chain, 0, body, polygons, pairs, boxes, boom, done1, new_batch(len(full1), corners),
        full1, row1,
    )  # fmt: skip
    rows2, done2 = np.zeros((boom.cells, len(full2)), np.uint64), np.zeros(boom.cells, np.bool_)
    _pass_on(row1[0], boom.cells, 1, full2, done2, rows2)
    _rows(
        chain, 1, body, polygons, pairs, boxes, stick, done2, new_batch(len(full2), corners),
        full2, rows2,
    )  # fmt: skip
    done3 = np.zeros(len(out), np.bool_)
    n = stick.cells
    for i in range(boom.cells):
        _pass_on(rows2[i], n, 1, full3, done3[i * n : (i + 1) * n], out[i * n : (i + 1) * n])
    _rows(
        chain, 2, body, polygons, pairs, boxes, bucket, done3, new_batch(len(full3), corners),
        full3, out,
    )  # fmt: skip
