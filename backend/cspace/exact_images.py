"""Whole images, compiled: of all swings against obstacles, and against the machine itself.

Without the GIL, so that threads can share the swings: each takes the next one, since some cost many
times as much as others.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from backend.cspace.exact_kernel import Chain, batch_of, full_words, swing_block
from backend.cspace.exact_levels import COUNT, HALF, START, STEP, levels
from backend.cspace.exact_slices import placed
from backend.cspace.exact_upper import turned_touches
from backend.cspace.planar_arm import Profiles
from backend.cspace.rows_near import swept_of
from backend.cspace.taking_turns import taken
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray


class Standing(NamedTuple):
    """Bodies that do not move with the arm, in the frame `arm` at swing 0: centers (n, 3),
    rotations (n, 3, 3), halves (n, 3), radius (n,) about the swing axis [m].
    """

    centers: Array
    rotations: Array
    halves: Array
    radius: Array


class Itself(NamedTuple):
    """Bodies of the machine as obstacles to what is farther out, in parts by how many joints carry
    them: where they stand at joint values 0, in the root frame, as built.

    held: (p,) joints; first: (p + 1,) where the parts begin in centers (m, 3), rotations (m, 3, 3),
    halves (m, 3); pairs: (n, m) which of the arm's bodies count against them.
    """

    held: IntArray
    first: IntArray
    centers: Array
    rotations: Array
    halves: Array
    pairs: BoolArray


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _turned(T: Array, angle: float) -> Array:
    """(3, 4) into the frame that has turned about z by `angle`."""
    c, s = math.cos(angle), math.sin(angle)
    out = T.copy()
    for k in range(4):
        out[0, k] = c * T[0, k] + s * T[1, k]
        out[1, k] = c * T[1, k] - s * T[0, k]
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _touches(
    bodies: Standing,
    others: tuple[Array, Array, Array],
    angle: float,
    half: float,
    kind: int,
) -> bool:
    pairs, m = np.empty((len(bodies.centers) * len(others[0]), 2), np.int64), len(others[0])
    for k in range(len(pairs)):
        pairs[k, 0], pairs[k, 1] = k // m, k % m
    own = (bodies.centers, bodies.rotations, bodies.halves)
    return bool(turned_touches(own, others, pairs, bodies.radius, angle, half, kind))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def image_kernel(
    chain: Chain,
    body: Profiles,
    tracks: Standing,
    upper: Standing,
    boxes: tuple[Array, Array, Array],
    axes: Array,
    kind: int,
    standing: bool,
    fresh: bool,
    next_swing: IntArray,
    out: AnyArray,
) -> None:
    """Fill out (swing, boom * stick, words) with the blocked cells, together with all who are given
    the same next_swing (1,), 0 before. fresh: out is all 0.

    boxes: obstacles in the root frame, centers (m, 3), rotations (m, 3, 3), halves (m, 3); axes:
    (4, 4) see exact_levels; standing: the tracks stand on the obstacles, which does not count.
    """
    full = full_words(int(axes[3, COUNT]))
    around = placed(boxes, chain.T_arm_root)
    if not standing and _touches(tracks, around, 0.0, 0.0, kind):
        s = taken(next_swing)
        while s < len(out):
            out[s] = full
            s = taken(next_swing)
        return
    level, batch = levels(chain.links, axes, kind), batch_of(body, axes)
    swept = swept_of(body, level)
    pairs = np.ones((len(body.group), len(boxes[0])), np.bool_)
    s = taken(next_swing)
    while s < len(out):
        angle = axes[0, START] + s * axes[0, STEP]
        if _touches(upper, around, angle, axes[0, HALF], kind):
            out[s] = full
        else:
            if not fresh:
                out[s] = 0
            there = placed(boxes, _turned(chain.T_arm_root, angle))
            swing_block(chain, body, there, pairs, level, swept, axes[0, HALF], batch, out[s])
        s = taken(next_swing)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def self_kernel(
    chain: Chain,
    body: Profiles,
    itself: Itself,
    axes: Array,
    kind: int,
    first: int,
    every: int,
    out: AnyArray,
) -> None:
    """The same where the machine touches itself, for the swings first, first + every, ..."""
    cells = axes[:, COUNT].astype(np.int64)
    full = full_words(cells[3])
    for p in range(len(itself.held)):
        held, low, high = itself.held[p], itself.first[p], itself.first[p + 1]
        pairs = itself.pairs[:, low:high].copy()
        boxes = (
            itself.centers[low:high],
            itself.rotations[low:high],
            itself.halves[low:high],
        )
        # The bodies stand still against each other while these joints move: one cell for all.
        still = axes.copy()
        for j in range(held):
            still[j, START], still[j, COUNT], still[j, HALF] = 0.0, 1.0, 0.0
        level, batch = levels(chain.links, still, kind), batch_of(body, still)
        swept = swept_of(body, level)
        booms, sticks = int(still[1, COUNT]), int(still[2, COUNT])
        part = np.zeros((booms * sticks, len(full_words(int(still[3, COUNT])))), np.uint64)
        for s in range(first, len(out), every):
            if held == 0 or s == first:
                part[:] = 0
                angle = still[0, START] + s * still[0, STEP] if held == 0 else 0.0
                there = placed(boxes, _turned(chain.T_arm_root, angle))
                swing_block(chain, body, there, pairs, level, swept, still[0, HALF], batch, part)
            if held == 4:
                if part[0, 0] & np.uint64(1):
                    out[s] = full
                continue
            for i in range(cells[1]):
                for j in range(cells[2]):
                    row = out[s, i * cells[2] + j]
                    more = part[(i if booms > 1 else 0) * sticks + (j if sticks > 1 else 0)]
                    for w in range(len(row)):
                        row[w] |= more[w]
