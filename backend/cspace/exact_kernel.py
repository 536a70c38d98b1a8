"""The image kernel: for each swing the boom's row, for each boom the stick's, for each stick the
bucket's, all against the polygons of that swing.

What a link touches blocks everything further out, so most of the image is written in whole blocks.
The same kernel makes the exact image and both bounds of the certified one; `Cells` says which.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.cspace.planar_arm import Profiles
from backend.cspace.planar_slices import POINTS, inner_slice, outer_slice
from backend.cspace.rows import ALL, Polygons, Row, rectangle_distance, touched
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

EXACT, OUTER, INNER = 0, 1, -1
ROUNDING = 1e-9
"""[m], [rad]: certified bounds are moved outward by more than the kernels round."""

_BLOCK = 8  # stick cells that are asked about together first


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


class Cells(NamedTuple):
    """The grid. boom, stick, bucket: rows of cell centres in the arm's plane.

    kind: EXACT at the centres; OUTER all that is not surely free; INNER only what is surely
    blocked; halves: (4,) half a cell of swing, boom, stick, bucket [rad], 0 where the value is
    exact.
    """

    boom: Row
    stick: Row
    bucket: Row
    kind: int
    halves: Array


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _slices(
    body: Profiles,
    boxes: tuple[Array, Array, Array],
    pairs: BoolArray,
    cells: Cells,
    pivot: Array,
    reach: float,
) -> Polygons:
    """Polygons of all obstacles that the arm can meet, for every slab that needs them."""
    centers, rotations, halves = boxes
    m, slabs = len(centers), len(body.slabs)
    spread, kind = cells.halves[0], cells.kind
    pad = ROUNDING * kind
    wide = max(abs(body.slabs.min()), abs(body.slabs.max())) + abs(pad)
    wanted = np.zeros((slabs, m), np.bool_)
    for j in range(m):
        size = math.sqrt(halves[j, 0] ** 2 + halves[j, 1] ** 2 + halves[j, 2] ** 2) + 1e-6
        x, t, z = centers[j, 0], centers[j, 1], centers[j, 2]
        beside = abs(t) * math.cos(spread) - abs(x) * math.sin(spread) - size
        # The swing moves a point on a circle about z: its distance from the pivot is at least
        # that of the nearest point of the circle.
        away = math.hypot(max(abs(math.hypot(x, t) - abs(pivot[0])) - wide, 0.0), z - pivot[1])
        if beside > wide or away - size > reach + wide:
            continue
        for b in range(len(body.group)):
            if body.sides[b] > 0 and pairs[b, j]:
                wanted[body.slab[b], j] = True
    room = 0
    for s in range(slabs):
        for j in range(m):
            if wanted[s, j]:
                room += 2 if kind == OUTER and spread > 0.0 else 1
    slab, obstacle = np.empty(room, np.int64), np.empty(room, np.int64)
    count = np.zeros(room, np.int64)
    xs, zs = np.empty((room, POINTS)), np.empty((room, POINTS))
    corners, work = np.empty((8, 3)), np.empty((2, 12, 3))
    points = np.empty((POINTS, 3))
    k = 0
    for j in range(m):
        made = False
        for s in range(slabs):
            if not wanted[s, j]:
                continue
            if not made:
                made = True
                for v in range(8):
                    for i in range(3):
                        corners[v, i] = centers[j, i]
                        for a in range(3):
                            half = halves[j, a] if (v >> a) & 1 else -halves[j, a]
                            corners[v, i] += half * rotations[j, i, a]
            low, high = body.slabs[s, 0] - pad, body.slabs[s, 1] + pad
            if kind == INNER and spread > 0.0:
                n = inner_slice(corners, low, high, spread, points, work, xs[k], zs[k])
                if n >= 3:
                    slab[k], obstacle[k], count[k] = s, j, n
                    k += 1
                continue
            for front in (True, False):
                n = outer_slice(corners, low, high, spread, front, points, work, xs[k], zs[k])
                if n > 0:
                    slab[k], obstacle[k], count[k] = s, j, n
                    k += 1
                if spread == 0.0:
                    break
    widest = 1
    for i in range(k):
        widest = max(widest, count[i])
    normal_x, normal_z = np.zeros((k, widest)), np.zeros((k, widest))
    offset, low_corner, high_corner = np.zeros((k, widest)), np.empty((k, 2)), np.empty((k, 2))
    for i in range(k):
        n = count[i]
        low_corner[i, 0], high_corner[i, 0] = xs[i, :n].min(), xs[i, :n].max()
        low_corner[i, 1], high_corner[i, 1] = zs[i, :n].min(), zs[i, :n].max()
        for v in range(n):
            u = v + 1 if v + 1 < n else 0
            dx, dz = xs[i, u] - xs[i, v], zs[i, u] - zs[i, v]
            length = math.hypot(dx, dz)
            if length > 0.0:
                normal_x[i, v], normal_z[i, v] = dz / length, -dx / length
            else:
                normal_x[i, v] = 1.0
            offset[i, v] = -math.inf
            for w in range(n):
                reached = normal_x[i, v] * xs[i, w] + normal_z[i, v] * zs[i, w]
                offset[i, v] = max(offset[i, v], reached)
    return Polygons(
        slab[:k], obstacle[:k], count[:k], xs[:k, :widest].copy(), zs[:k, :widest].copy(),
        normal_x, normal_z, offset, low_corner, high_corner,
    )  # fmt: skip


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
def _near(
    chosen: IntArray, body: Profiles, polygons: Polygons, px: float, pz: float, extra: float
) -> IntArray:
    """The pairs whose polygon is within reach of the body, its pivot within extra of (px, pz)."""
    out = np.empty_like(chosen)
    k = 0
    for i in range(len(chosen)):
        b, p = chosen[i, 0], chosen[i, 1]
        within = body.reach[b] + extra
        if rectangle_distance(polygons.low[p], polygons.high[p], px, pz) <= within * within:
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
            body, b, polygons, p, px, pz, row, margin, turn, work, scratch, out
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
        touched(body, b, polygons, p, px, pz, row, 0.0, 0.0, work, scratch, maybe)
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
def _placed(boxes: tuple[Array, Array, Array], T: Array) -> tuple[Array, Array, Array]:
    """The obstacles in the frame `arm`. T: (3, 4)."""
    m = len(boxes[0])
    centers, rotations = np.empty((m, 3)), np.zeros((m, 3, 3))
    for j in range(m):
        for i in range(3):
            centers[j, i] = T[i, 3]
            for k in range(3):
                centers[j, i] += T[i, k] * boxes[0][j, k]
                for a in range(3):
                    rotations[j, i, a] += T[i, k] * boxes[1][j, k, a]
    return centers, rotations, boxes[2]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _full(n: int) -> AnyArray:
    """Words with the first n bits set."""
    words = (n + 63) // 64
    out = np.full(words, ALL, np.uint64)
    if n % 64:
        out[words - 1] = ALL >> np.uint64(64 - n % 64)
    return out


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
    boxes = _placed(obstacles, T)
    polygons = _slices(body, boxes, pairs, cells, chain.pivot, reach)
    if len(polygons.slab) == 0:
        return
    boom_pairs = _pairs_of(body, polygons, pairs, 0)
    stick_pairs = _pairs_of(body, polygons, pairs, 1)
    bucket_pairs = _pairs_of(body, polygons, pairs, 2)
    turn_boom = cells.halves[1]
    turn_stick = turn_boom + cells.halves[2]
    turn_bucket = turn_stick + cells.halves[3]
    pad = ROUNDING if kind != EXACT else 0.0

    full1, full2, full3 = _full(cells.boom.n), _full(cells.stick.n), _full(cells.bucket.n)
    work = np.empty((3, polygons.x.shape[1]))
    scratch1 = np.empty((3, len(full1)), np.uint64)
    scratch2 = np.empty((3, len(full2)), np.uint64)
    scratch3 = np.empty((3, len(full3)), np.uint64)
    blocked1, blocked2 = np.zeros(len(full1), np.uint64), np.zeros(len(full2), np.uint64)
    needed, count = np.empty((len(bucket_pairs), 2), np.int64), 0
    px, pz = chain.pivot[0], chain.pivot[1]
    _row(
        boom_pairs, chain, 0, body, polygons, boxes, px, pz, cells.boom,
        sign * pad, sign * (turn_boom + pad), kind, full1, work, scratch1, blocked1,
    )  # fmt: skip
    for i in range(cells.boom.n):
        if (blocked1[i // 64] >> np.uint64(i % 64)) & np.uint64(1):
            out[i, :, :] = full3
            continue
        angle1 = cells.boom.start + i * cells.boom.step
        c, s = math.cos(angle1), math.sin(angle1)
        qx = px + c * chain.boom[0] - s * chain.boom[1]
        qz = pz + s * chain.boom[0] + c * chain.boom[1]
        # The stick's pivot is at most this far from where it is at the boom cell's centre.
        margin = l1 * turn_boom + pad
        row2 = Row(cells.stick.start + angle1, cells.stick.step, cells.stick.n)
        blocked2[:] = 0
        _row(
            stick_pairs, chain, 1, body, polygons, boxes, qx, qz, row2,
            sign * margin, sign * (turn_stick + pad), kind, full2, work, scratch2, blocked2,
        )  # fmt: skip
        most = l2 + (l1 + 2.0 * l2) * turn_boom + l2 * cells.halves[2] + pad
        near = _near(bucket_pairs, body, polygons, qx, qz, most)
        count = 0
        for k in range(cells.stick.n):
            if k % _BLOCK == 0 and len(near) > 0:
                # What is free of a pair for a whole block of stick cells need not be asked again.
                size = min(_BLOCK, cells.stick.n - k)
                angle2 = row2.start + (k + 0.5 * (size - 1)) * row2.step
                span = 0.5 * (size - 1) * abs(row2.step)
                c, s = math.cos(angle2), math.sin(angle2)
                rx = qx + c * chain.stick[0] - s * chain.stick[1]
                rz = qz + s * chain.stick[0] + c * chain.stick[1]
                moved = l2 * (cells.halves[2] + span)
                lever = math.hypot(rx - px, rz - pz) + moved
                row3 = Row(cells.bucket.start + angle2, cells.bucket.step, cells.bucket.n)
                count = _needed(
                    near, body, polygons, rx, rz, row3, lever * turn_boom + moved + ROUNDING,
                    turn_bucket + span + ROUNDING, full3, work, scratch3, needed,
                )  # fmt: skip
            if (blocked2[k // 64] >> np.uint64(k % 64)) & np.uint64(1):
                out[i, k, :] = full3
                continue
            if count == 0:
                continue
            angle2 = row2.start + k * row2.step
            c, s = math.cos(angle2), math.sin(angle2)
            rx = qx + c * chain.stick[0] - s * chain.stick[1]
            rz = qz + s * chain.stick[0] + c * chain.stick[1]
            # Boom turns the bucket's pivot about the boom's, stick about its own.
            lever = math.hypot(rx - px, rz - pz) + l2 * cells.halves[2]
            margin = lever * turn_boom + l2 * cells.halves[2] + pad
            row3 = Row(cells.bucket.start + angle2, cells.bucket.step, cells.bucket.n)
            _row(
                needed[:count], chain, 2, body, polygons, boxes, rx, rz, row3,
                sign * margin, sign * (turn_bucket + pad), kind, full3, work, scratch3, out[i, k],
            )  # fmt: skip


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
        touched(body, b, polygons, p, px, pz, row, margin, turn, work, scratch, maybe)
        some = False
        for w in range(len(full)):
            some = some or (maybe[w] & full[w]) != 0
        if some:
            out[count, 0], out[count, 1] = b, p
            count += 1
    return count


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
