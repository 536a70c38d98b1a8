"""The image kernel: for each swing the boom's row, for each boom the stick's, for each stick the
bucket's, all against the polygons of that swing.

What a link touches blocks everything further out, so most of the image is written in whole blocks;
and a block of boom and stick cells that no bucket body reaches is left as it is. The same kernel
makes the exact image and both bounds of the certified one; `Cells` says which.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.cspace.exact_slices import EXACT, ROUNDING, Cells, placed, slices
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows import ALL, Polygons, Row, rectangle_distance, touched
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray


class Chain(NamedTuple):
    """pivot, boom, stick: (2,) as in PlanarArm [m]. Boxes of the bodies in the frame `arm` at joint
    values 0, for those whose prism is not exact: centers (n, 3), rotations (n, 3, 3), halves
    (n, 3), askew (n,).
    """

    pivot: Array
    boom: Array
    stick: Array
    centers: Array
    rotations: Array
    halves: Array
    askew: BoolArray


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _pairs_of(body: Profiles, polygons: Polygons, pairs: BoolArray, group: int) -> IntArray:
    """(k, 2) bodies of the group and the polygons in their slabs that they must not touch."""
    out = np.empty((len(body.group) * len(polygons.slab), 2), np.int64)
    k = 0
    for b in range(len(body.group)):
        if body.group[b] != group or body.sides[b] == 0:
            continue
        for p in range(len(polygons.slab)):
            if polygons.slab[p] == body.slab[b] and pairs[b, polygons.obstacle[p]]:
                out[k, 0], out[k, 1] = b, p
                k += 1
    return out[:k]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _row(
    chosen: IntArray,
    chain: Chain,
    group: int,
    body: Profiles,
    polygons: Polygons,
    boxes: tuple[Array, Array, Array],
    px: float,
    pz: float,
    row: Row,
    margin: float,
    turn: float,
    kind: int,
    full: AnyArray,
    work: Array,
    scratch: AnyArray,
    out: AnyArray,
) -> None:
    """Set the bits of `out` that the chosen pairs block. work, scratch: see `touched`."""
    askew = False
    for i in range(len(chosen)):
        b, p = chosen[i, 0], chosen[i, 1]
        if kind == EXACT and chain.askew[b]:
            askew = True
            continue
        within = body.reach[b] + max(margin, 0.0)
        if rectangle_distance(polygons.low[p], polygons.high[p], px, pz) > within * within:
            continue
        touched(
            body, b, polygons, p, px, pz, row, margin, turn, full, work, scratch, out
        )  # fmt: skip
        done = True
        for w in range(len(out)):
            out[w] &= full[w]
            done = done and out[w] == full[w]
        if done:
            return
    if not askew:
        return
    for i in range(len(chosen)):
        b, p = chosen[i, 0], chosen[i, 1]
        if not chain.askew[b]:
            continue
        within = body.reach[b]
        if rectangle_distance(polygons.low[p], polygons.high[p], px, pz) > within * within:
            continue
        maybe = scratch[2]
        maybe[:] = 0
        touched(body, b, polygons, p, px, pz, row, 0.0, 0.0, full, work, scratch, maybe)
        for w in range(len(out)):
            rest = maybe[w] & full[w] & ~out[w]
            for bit in range(64):
                if not (rest >> np.uint64(bit)) & np.uint64(1):
                    continue
                angle = row.start + (64 * w + bit) * row.step
                if _box_touches(chain, group, b, boxes, polygons.obstacle[p], px, pz, angle):
                    out[w] |= np.uint64(1) << np.uint64(bit)


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
    ox, oz = chain.pivot[0], chain.pivot[1]
    if group > 0:
        ox, oz = ox + chain.boom[0], oz + chain.boom[1]
    if group > 1:
        ox, oz = ox + chain.stick[0], oz + chain.stick[1]
    c, s = math.cos(angle), math.sin(angle)
    center, R = np.empty(3), np.empty((3, 3))
    x, z = chain.centers[b, 0] - ox, chain.centers[b, 2] - oz
    center[0], center[1], center[2] = px + c * x - s * z, chain.centers[b, 1], pz + s * x + c * z
    for k in range(3):
        R[0, k] = c * chain.rotations[b, 0, k] - s * chain.rotations[b, 2, k]
        R[1, k] = chain.rotations[b, 1, k]
        R[2, k] = s * chain.rotations[b, 0, k] + c * chain.rotations[b, 2, k]
    return bool(gap(center, R, chain.halves[b], boxes[0][j], boxes[1][j], boxes[2][j], 0.0) <= 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _full(n: int) -> AnyArray:
    """Words with the first n bits set."""
    words = (n + 63) // 64
    out = np.full(words, ALL, np.uint64)
    if n % 64:
        out[words - 1] = ALL >> np.uint64(64 - n % 64)
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _needed(
    chosen: IntArray,
    body: Profiles,
    polygons: Polygons,
    px: float,
    pz: float,
    row: Row,
    margin: float,
    turn: float,
    full: AnyArray,
    work: Array,
    scratch: AnyArray,
    out: IntArray,
) -> int:
    """The chosen pairs that are not free in all cells of a row within margin and turn; how many."""
    count = 0
    maybe = scratch[2]
    for i in range(len(chosen)):
        b, p = chosen[i, 0], chosen[i, 1]
        within = body.reach[b] + margin
        if rectangle_distance(polygons.low[p], polygons.high[p], px, pz) > within * within:
            continue
        maybe[:] = 0
        touched(body, b, polygons, p, px, pz, row, margin, turn, full, work, scratch, maybe)
        for w in range(len(full)):
            if maybe[w] & full[w]:
                out[count, 0], out[count, 1] = b, p
                count += 1
                break
    return count


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bucket_rows(
    chain: Chain,
    body: Profiles,
    polygons: Polygons,
    boxes: tuple[Array, Array, Array],
    cells: Cells,
    pairs: IntArray,
    full: AnyArray,
    work: Array,
    blocked: BoolArray,
    out: AnyArray,
) -> None:
    """Fill the bucket's rows: blocks of boom and stick cells, halved as long as a pair may touch.

    pairs: (k, 2) bodies and polygons; blocked: (boom, stick) rows that are full already; out:
    (boom, stick, words).
    """
    levels = 2
    while 1 << (levels - 2) < cells.boom.n * cells.stick.n:
        levels += 1
    # The pairs that matter to the halves of a block at one level stand at the next.
    lists = np.empty((2 * levels + 1, len(pairs), 2), np.int64)
    counts = np.zeros(2 * levels + 1, np.int64)
    lists[0], counts[0] = pairs, len(pairs)
    stack = np.empty((4 * levels, 5), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, cells.boom.n, 0, cells.stick.n
    stack[0, 4] = 0
    size = 1
    scratch = np.empty((3, len(full)), np.uint64)
    reach = math.hypot(chain.stick[0], chain.stick[1])
    pad, sign = 0.0 if cells.kind == EXACT else ROUNDING, float(cells.kind)
    while size > 0:
        size -= 1
        first1, n1, first2, n2 = stack[size, 0], stack[size, 1], stack[size, 2], stack[size, 3]
        level = stack[size, 4]
        single = n1 == 1 and n2 == 1
        if single and blocked[first1, first2]:
            continue
        angle1 = cells.boom.start + (first1 + 0.5 * (n1 - 1)) * cells.boom.step
        angle2 = angle1 + cells.stick.start + (first2 + 0.5 * (n2 - 1)) * cells.stick.step
        c1, s1, c2, s2 = math.cos(angle1), math.sin(angle1), math.cos(angle2), math.sin(angle2)
        dx = c1 * chain.boom[0] - s1 * chain.boom[1] + c2 * chain.stick[0] - s2 * chain.stick[1]
        dz = s1 * chain.boom[0] + c1 * chain.boom[1] + s2 * chain.stick[0] + c2 * chain.stick[1]
        px, pz = chain.pivot[0] + dx, chain.pivot[1] + dz
        row = Row(cells.bucket.start + angle2, cells.bucket.step, cells.bucket.n)
        # The boom turns the bucket's pivot about the boom's, the stick about its own.
        half1 = cells.halves[1] + 0.5 * (n1 - 1) * abs(cells.boom.step)
        half2 = cells.halves[2] + 0.5 * (n2 - 1) * abs(cells.stick.step)
        moved = reach * half2
        margin = (math.hypot(dx, dz) + moved) * half1 + moved
        turn = half1 + half2 + cells.halves[3]
        chosen = lists[level, : counts[level]]
        if single:
            _row(
                chosen, chain, 2, body, polygons, boxes, px, pz, row, sign * (margin + pad),
                sign * (turn + pad), cells.kind, full, work, scratch, out[first1, first2],
            )  # fmt: skip
            continue
        # To ask at every halving costs more than it saves: it is done for blocks of 8, 64, ...
        halvings = 0
        while 1 << halvings < n1 * n2:
            halvings += 1
        if halvings % 3 == 0:
            counts[level + 1] = _needed(
                chosen, body, polygons, px, pz, row, margin + ROUNDING, turn + ROUNDING, full,
                work, scratch, lists[level + 1],
            )  # fmt: skip
            level += 1
            if counts[level] == 0:
                continue
        for part in range(2):
            stack[size, 0], stack[size, 1] = first1, n1
            stack[size, 2], stack[size, 3] = first2, n2
            stack[size, 4] = level
            longer = 0 if n1 >= n2 else 2
            whole = max(n1, n2)
            half = whole // 2
            if part == 1:
                stack[size, longer] += half
            stack[size, longer + 1] = whole - half if part == 1 else half
            size += 1


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _swing_block(
    chain: Chain,
    body: Profiles,
    obstacles: tuple[Array, Array, Array],
    pairs: BoolArray,
    T: Array,
    cells: Cells,
    out: AnyArray,
) -> None:
    """One swing of the image. out: (boom, stick, words)."""
    kind, sign = cells.kind, float(cells.kind)
    l1 = math.hypot(chain.boom[0], chain.boom[1])
    l2 = math.hypot(chain.stick[0], chain.stick[1])
    far = np.zeros(3)
    for b in range(len(body.group)):
        far[body.group[b]] = max(far[body.group[b]], body.reach[b])
    reach = max(far[0], l1 + far[1], l1 + l2 + far[2])
    boxes = placed(obstacles, T)
    polygons = slices(body, boxes, pairs, cells.kind, cells.halves[0], chain.pivot, reach)
    if len(polygons.slab) == 0:
        return
    boom_pairs = _pairs_of(body, polygons, pairs, 0)
    stick_pairs = _pairs_of(body, polygons, pairs, 1)
    bucket_pairs = _pairs_of(body, polygons, pairs, 2)
    pad = ROUNDING if kind != EXACT else 0.0

    full1, full2, full3 = _full(cells.boom.n), _full(cells.stick.n), _full(cells.bucket.n)
    work = np.empty((3, polygons.x.shape[1]))
    scratch1 = np.empty((3, len(full1)), np.uint64)
    scratch2 = np.empty((3, len(full2)), np.uint64)
    row1, row2 = np.zeros(len(full1), np.uint64), np.zeros(len(full2), np.uint64)
    blocked = np.zeros((cells.boom.n, cells.stick.n), np.bool_)
    px, pz = chain.pivot[0], chain.pivot[1]
    _row(
        boom_pairs, chain, 0, body, polygons, boxes, px, pz, cells.boom, sign * pad,
        sign * (cells.halves[1] + pad), kind, full1, work, scratch1, row1,
    )  # fmt: skip
    for i in range(cells.boom.n):
        if (row1[i // 64] >> np.uint64(i % 64)) & np.uint64(1):
            out[i, :, :] = full3
            blocked[i] = True
            continue
        if len(stick_pairs) == 0:
            continue
        angle = cells.boom.start + i * cells.boom.step
        c, s = math.cos(angle), math.sin(angle)
        qx = px + c * chain.boom[0] - s * chain.boom[1]
        qz = pz + s * chain.boom[0] + c * chain.boom[1]
        row2[:] = 0
        _row(
            stick_pairs, chain, 1, body, polygons, boxes, qx, qz,
            Row(cells.stick.start + angle, cells.stick.step, cells.stick.n),
            sign * (l1 * cells.halves[1] + pad), sign * (cells.halves[1] + cells.halves[2] + pad),
            kind, full2, work, scratch2, row2,
        )  # fmt: skip
        for k in range(cells.stick.n):
            if (row2[k // 64] >> np.uint64(k % 64)) & np.uint64(1):
                out[i, k, :] = full3
                blocked[i, k] = True
    _bucket_rows(
        chain, body, polygons, boxes, cells, bucket_pairs, full3, work, blocked, out
    )  # fmt: skip


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def image_kernel(
    chain: Chain,
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    pairs: BoolArray,
    T_arm_root: Array,
    cells: Cells,
    base: BoolArray,
    first: int,
    last: int,
    out: AnyArray,
) -> None:
    """Fill swings first..last-1 of out (swing, boom, stick, words), which must be 0, with the
    blocked cells. Without the GIL, so that threads can share the swings.

    boxes: obstacles in the root frame, centers (m, 3), rotations (m, 3, 3), halves (m, 3); pairs:
    (n, m) which body must not touch which obstacle; T_arm_root: (swing, 3, 4); base: (swing,)
    where everything is blocked.
    """
    full = _full(cells.bucket.n)
    for s in range(first, last):
        if base[s]:
            for i in range(out.shape[1]):
                for k in range(out.shape[2]):
                    out[s, i, k, :] = full
        else:
            _swing_block(chain, body, boxes, pairs, T_arm_root[s], cells, out[s])
