"""The cells of one joint moving alone, compiled: pair by pair, leaping over what is far."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.exact_upper import PAD, decided, turned_gap
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

BoxArrays = tuple[Array, Array, Array]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _radii(boxes: BoxArrays) -> Array:
    """(n,) largest distance of each box's corners from the z axis."""
    out = np.zeros(len(boxes[0]))
    for i in range(len(out)):
        for v in range(8):
            x, y = boxes[0][i, 0], boxes[0][i, 1]
            for a in range(3):
                h = boxes[2][i, a] if (v >> a) & 1 else -boxes[2][i, a]
                x += h * boxes[1][i, 0, a]
                y += h * boxes[1][i, 1, a]
            out[i] = max(out[i], math.hypot(x, y))
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _rings(boxes: BoxArrays) -> Array:
    """(n, 4) least and largest distance from the z axis, least and largest z, at least."""
    out = np.empty((len(boxes[0]), 4))
    for i in range(len(out)):
        r = np.zeros(3)
        for k in range(3):
            for a in range(3):
                r[k] += abs(boxes[1][i, k, a]) * boxes[2][i, a]
        away, wide = math.hypot(boxes[0][i, 0], boxes[0][i, 1]), math.hypot(r[0], r[1])
        out[i, 0], out[i, 1] = away - wide - PAD, away + wide + PAD
        out[i, 2], out[i, 3] = boxes[0][i, 2] - r[2] - PAD, boxes[0][i, 2] + r[2] + PAD
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _standing(a: BoxArrays, i: int, b: BoxArrays, j: int) -> float:
    """Gap of two boxes that do not move against each other; above PAD as soon as it is."""
    return float(turned_gap(a[0][i], a[1][i], a[2][i], b[0][j], b[1][j], b[2][j], 1.0, 0.0, PAD))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _sweep(
    built: BoxArrays,
    grown: BoxArrays,
    radius: Array,
    i: int,
    others: BoxArrays,
    others_grown: BoxArrays,
    j: int,
    bit: int,
    angles: Array,
    half: float,
    hits: AnyArray,
    inner: BoolArray,
    outer: BoolArray,
) -> None:
    """What body i does to the cells as it turns by `angles` past obstacle j."""
    chord = 2.0 * math.sin(0.5 * min(half, math.pi))
    moved, step = radius[i] * chord + PAD, 2.0 * half
    pair = np.array([[i, j]])
    s = 0
    while s < len(angles):
        if inner[s] and outer[s] and hits[s] & bit:
            s += 1
            continue
        cos, sin = math.cos(angles[s]), math.sin(angles[s])
        g = turned_gap(
            grown[0][i], grown[1][i], grown[2][i],
            others_grown[0][j], others_grown[1][j], others_grown[2][j], cos, sin, moved,
        )  # fmt: skip
        if g > moved:
            # Nothing moves faster than on the largest circle: the next cells are clear, too.
            s += 1 + int(max((g - PAD) / max(radius[i] * step, 1e-12) - 0.5, 0.0))
            continue
        outer[s] = outer[s] or decided(grown, others_grown, pair, radius, angles[s], half, False)
        g = turned_gap(
            built[0][i], built[1][i], built[2][i], others[0][j], others[1][j], others[2][j],
            cos, sin, moved,
        )  # fmt: skip
        if g <= 0.0:
            hits[s] |= bit
        inner[s] = inner[s] or g < -moved
        s += 1


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def bar_cells(
    bodies: BoxArrays,
    carried: BoolArray,
    others: BoxArrays,
    bits: IntArray,
    itself: IntArray,
    self_bit: int,
    eta: float,
    wrong: Array,
    angles: Array,
    half: float,
) -> tuple[IntArray, BoolArray, BoolArray]:
    """(bits of what is hit at the cells' middles, whether a cell surely collides, may collide).

    In a frame whose z is the joint's axis: bodies at the joint's present value, carried: (n,) which
    of them turn; others: obstacles, bits: (m,) theirs; itself: (p, 2) bodies that count against
    each other; eta: growth of the bodies against obstacles, wrong: (n,) against each other [m];
    angles: (cells,) of the middles from the present value, half: of a cell [rad].
    """
    n, m = len(bodies[0]), len(others[0])
    hits = np.zeros(len(angles), np.int64)
    inner, outer = np.zeros(len(angles), np.bool_), np.zeros(len(angles), np.bool_)
    grown = (bodies[0], bodies[1], bodies[2] + eta)
    doubted = (bodies[0], bodies[1], bodies[2] + wrong.reshape(-1, 1))
    radius, grown_radius, doubted_radius = _radii(bodies), _radii(grown), _radii(doubted)
    rings, around, own = _rings(grown), _rings(others), _rings(doubted)
    # Pairs that meet in a cell by turns keep it colliding, though none does throughout.
    turning, count = np.empty((n * m + len(itself), 2), np.int64), 0
    for i in range(n):
        for j in range(m):
            if carried[i]:
                if _meet(rings[i], around[j]):
                    turning[count, 0], turning[count, 1] = i, j
                    count += 1
                    _sweep(
                        bodies, grown, grown_radius, i, others, others, j, bits[j], angles, half,
                        hits, inner, outer,
                    )  # fmt: skip
                continue
            if _standing(grown, i, others, j) <= PAD:
                outer[:] = True
                g = _standing(bodies, i, others, j)
                if g <= 0.0:
                    hits |= bits[j]
                if g < -PAD:
                    inner[:] = True
    against = count
    for k in range(len(itself)):
        i, j = itself[k, 0], itself[k, 1]
        if carried[i] == carried[j]:
            if _standing(doubted, i, doubted, j) <= PAD:
                outer[:] = True
                g = _standing(bodies, i, bodies, j)
                if g <= 0.0:
                    hits |= self_bit
                if g < -PAD:
                    inner[:] = True
            continue
        if carried[j]:
            i, j = j, i
        if _meet(own[i], own[j]):
            turning[count, 0], turning[count, 1] = i, j
            count += 1
            _sweep(
                bodies, doubted, doubted_radius, i, bodies, doubted, j, self_bit, angles, half,
                hits, inner, outer,
            )  # fmt: skip
    for s in range(len(angles)):
        if hits[s] and not inner[s]:
            inner[s] = decided(
                bodies, others, turning[:against], radius, angles[s], half, True
            ) or decided(bodies, bodies, turning[against:count], radius, angles[s], half, True)
    return hits, inner, outer


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _meet(a: Array, b: Array) -> bool:
    """Whether two rings share a point."""
    return bool(a[0] <= b[1] and b[0] <= a[1] and a[2] <= b[3] and b[2] <= a[3])
