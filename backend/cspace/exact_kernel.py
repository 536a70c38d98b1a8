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
from backend.cspace.exact_levels import COUNT, EXACT, RUN, Level
from backend.cspace.exact_slices import slices, slices_wanted
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows import ALL, Polygons, touched
from backend.cspace.rows_batch import (
    Batch,
    Sizes,
    cells_of,
    new_batch,
    set_body,
    set_polygon,
    touched_rows,
)
from backend.cspace.rows_near import near_rows, near_runs
from backend.cspace.rows_vector import BLOCKED, DOUBT, MARGIN, ORIGIN, WORD, X, Z
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

_USUAL = 16  # more corners than most polygons have


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


@njit(cache=True, nogil=True, _nrt=True)  # type: ignore[untyped-decorator]
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
    px, pz, origin = batch.d[X + r], batch.d[Z + r], batch.d[ORIGIN + r]
    for w in range(len(row)):
        bits = batch.w[w * WORD + BLOCKED + r] & full[w] & ~row[w]
        for bit in range(64):
            if not (bits >> np.uint64(bit)) & np.uint64(1):
                continue
            angle = origin + (64 * w + bit) * level.step
            if not _box_touches(chain, group, b, boxes, j, px, pz, angle):
                bits &= ~(np.uint64(1) << np.uint64(bit))
        batch.w[w * WORD + BLOCKED + r] = bits


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _decide(
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
    out: AnyArray,
) -> None:
    """Decide what is in doubt in the first `count` rows of a batch, or a box that is no prism."""
    d, words, size = batch.d, batch.w, len(full)
    room, sure = batch.room[:2, :size], batch.room[2, :size]
    for r in range(count):
        if batch.s[DOUBT + r] < 0.0:
            for w in range(size):
                sure[w] = np.uint64(0)
            touched(
                body, b, polygons, p, d[X + r], d[Z + r], d[ORIGIN + r], level.step,
                level.cells, d[MARGIN + r], level.turn, room, batch.polar, sure,
            )  # fmt: skip
            for w in range(size):
                words[w * WORD + BLOCKED + r] = sure[w]
        if level.kind == EXACT and chain.askew[b]:
            row = out[batch.place[r]]
            _keep_box(chain, group, b, boxes, polygons.obstacle[p], level, batch, r, full, row)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _doubted(s: AnyArray, count: int) -> bool:
    some = False
    for r in range(count):
        some |= s[DOUBT + r] < 0.0
    return some


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _write(
    words: AnyArray, place: IntArray, count: int, full: AnyArray, done: BoolArray, out: AnyArray
) -> None:
    """Add BLOCKED of the first `count` rows to out (m, words); those that are full now are done."""
    for r in range(count):
        m, every = place[r], True
        for w in range(len(full)):
            bits = out[m, w] | (words[w * WORD + BLOCKED + r] & full[w])
            out[m, w] = bits
            every = every and bits == full[w]
        done[m] = every


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _rows(
    chain: Chain,
    group: int,
    body: Profiles,
    polygons: Polygons,
    pairs: BoolArray,
    boxes: tuple[Array, Array, Array],
    level: Level,
    swept: Array,
    done: BoolArray,
    batch: Batch,
    full: AnyArray,
    out: AnyArray,
) -> None:
    """Set the bits of out (m, words) that the bodies of the group block, but for rows `done`; rows
    that get full are done, too.
    """
    d, singles, words, place = batch.d, batch.s, batch.w, batch.place
    rows, runs, some, found = level.rows, level.runs, batch.some, batch.found
    moves = level.kind != EXACT
    groups, sides, slabs = body.group, body.sides, body.slab
    of_slab, obstacles, lows, highs = polygons.slab, polygons.obstacle, polygons.low, polygons.high
    cells = cells_of(level)
    for turn in range(2):
        for b in range(len(groups)):
            # Boxes that are not prisms are dear: they come last, and only for what is still free.
            late = level.kind == EXACT and chain.askew[b]
            if groups[b] != group or sides[b] == 0 or late != (turn == 1):
                continue
            set_body(batch, body, b)
            reach, depth = body.reach[b], body.depth[b]
            lines = (swept[b, 0], swept[b, 1], swept[b, 2], swept[b, 3], swept[b, 4], swept[b, 5])
            for p in range(len(of_slab)):
                if of_slab[p] != slabs[b] or not pairs[b, obstacles[p]]:
                    continue
                set_polygon(batch, polygons, p)
                sizes = Sizes(sides[b], depth, reach, polygons.sides[p], len(full))
                around = (lows[p, 0], lows[p, 1], highs[p, 0], highs[p, 1])
                near, at = near_runs(runs, around, reach + level.widest, some, found), 0
                while at < near:
                    count, at = near_rows(
                        rows, found, near, at, around, reach, lines, moves, done, d, place, some
                    )
                    if count == 0:
                        continue
                    count = touched_rows(sizes, cells, batch, count, full, out)
                    if late or _doubted(singles, count):
                        _decide(
                            chain, group, b, body, polygons, p, boxes, level, batch, count, full,
                            out,
                        )  # fmt: skip
                    _write(words, place, count, full, done, out)


@njit(cache=True, nogil=True, _nrt=False)  # type: ignore[untyped-decorator]
def _pass_on(
    row: AnyArray, n: int, share: int, full: AnyArray, done: BoolArray, out: AnyArray
) -> None:
    """Block the `share` rows of out (m, words) behind each of the first n bits set in row."""
    for i in range(n):
        if (row[i // 64] >> np.uint64(i % 64)) & np.uint64(1):
            for m in range(i * share, (i + 1) * share):
                done[m] = True
                for w in range(len(full)):
                    out[m, w] = full[w]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def batch_of(body: Profiles, axes: Array) -> Batch:
    """Room for the rows of all joints, see Level, and polygons of usual size."""
    words = 1
    for joint in range(1, 4):
        words = max(words, (int(axes[joint, COUNT]) + 63) // 64)
    rows = int(axes[1, COUNT]) * int(axes[2, COUNT])
    batch: Batch = new_batch(words, max(_USUAL, body.radius.shape[1]), rows // RUN + 1)
    return batch


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def swing_block(
    chain: Chain,
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    pairs: BoolArray,
    level: tuple[Level, Level, Level],
    swept: Array,
    spread: float,
    batch: Batch,
    out: AnyArray,
) -> None:
    """One swing of an image. boxes: obstacles in the frame `arm` of that swing; spread: half a cell
    of the swing [rad]; swept: see `swept_of`; batch: see `batch_of`; out: (boom * stick, words), 0.
    """
    boom, stick, bucket = level
    pivot = chain.pivots[0]
    wanted, some = slices_wanted(body, boxes, pairs, boom.kind, spread, pivot, chain.reach)
    if not some:
        return
    polygons = slices(body, boxes, wanted, boom.kind, spread, pivot)
    if len(polygons.slab) == 0:
        return
    corners = polygons.x.shape[1]
    if corners > batch.shape.shape[1]:
        batch = new_batch(len(batch.w) // WORD, corners, len(batch.found))
    full1, full2, full3 = full_words(boom.cells), full_words(stick.cells), full_words(bucket.cells)
    row1, done1 = np.zeros((1, len(full1)), np.uint64), np.zeros(boom.rows.shape[1], np.bool_)
    _rows(chain, 0, body, polygons, pairs, boxes, boom, swept, done1, batch, full1, row1)
    rows2 = np.zeros((boom.cells, len(full2)), np.uint64)
    done2 = np.zeros(stick.rows.shape[1], np.bool_)
    _pass_on(row1[0], boom.cells, 1, full2, done2, rows2)
    _rows(chain, 1, body, polygons, pairs, boxes, stick, swept, done2, batch, full2, rows2)
    done3 = np.zeros(bucket.rows.shape[1], np.bool_)
    n = stick.cells
    for i in range(boom.cells):
        _pass_on(rows2[i], n, 1, full3, done3[i * n : (i + 1) * n], out[i * n : (i + 1) * n])
    _rows(chain, 2, body, polygons, pairs, boxes, bucket, swept, done3, batch, full3, out)
