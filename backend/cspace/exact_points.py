"""Whether single configurations touch something: every pair of boxes, no grid, no slices."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

_BATCH = 4096


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _hits(
    T: Array,
    own: tuple[Array, Array, Array],
    links: IntArray,
    others: tuple[Array, Array, Array],
    self_pairs: IntArray,
    counts: BoolArray,
    against: BoolArray,
    itself: BoolArray,
) -> None:
    """T: (k, L, 4, 4); own in the links' frames, others in the root frame; counts: (n,) own bodies
    that others matter to; sets against, itself.
    """
    n, m = len(links), len(others[0])
    centers, rotations = np.empty((n, 3)), np.empty((n, 3, 3))
    size, other_size = np.empty(n), np.empty(m)
    for i in range(n):
        size[i] = math.sqrt((own[2][i] ** 2).sum())
    for j in range(m):
        other_size[j] = math.sqrt((others[2][j] ** 2).sum())
    for c in range(len(T)):
        for i in range(n):
            pose = T[c, links[i]]
            for a in range(3):
                centers[i, a] = pose[a, 3]
                for b in range(3):
                    centers[i, a] += pose[a, b] * own[0][i, b]
                    total = 0.0
                    for k in range(3):
                        total += pose[a, k] * own[1][i, k, b]
                    rotations[i, a, b] = total
        for i in range(n):
            for j in range(m):
                if against[c] or not counts[i]:
                    break
                d = 0.0
                for a in range(3):
                    d += (centers[i, a] - others[0][j, a]) ** 2
                if d > (size[i] + other_size[j]) ** 2:
                    continue
                g = gap(
                    centers[i], rotations[i], own[2][i],
                    others[0][j], others[1][j], others[2][j], 0.0,
                )  # fmt: skip
                against[c] = g <= 0.0
        for p in range(len(self_pairs)):
            i, j = self_pairs[p, 0], self_pairs[p, 1]
            d = 0.0
            for a in range(3):
                d += (centers[i, a] - centers[j, a]) ** 2
            if d > (size[i] + size[j]) ** 2:
                continue
            g = gap(
                centers[i], rotations[i], own[2][i], centers[j], rotations[j], own[2][j], 0.0
            )  # fmt: skip
            if g <= 0.0:
                itself[c] = True
                break


def touching(
    machine: Machine,
    q: Array,
    obstacles: Boxes,
    standing: bool = False,
    ask_itself: bool = True,
) -> tuple[BoolArray, BoolArray]:
    """(touches an obstacle, touches itself), each (k,), at q (k, n) [rad]; bodies as built.

    obstacles in the machine's root frame; standing: the tracks stand on them, which does not count;
    ask_itself: False leaves the second answer at False.
    """
    q = np.asarray(q, dtype=float)
    against, itself = np.zeros(len(q), dtype=bool), np.zeros(len(q), dtype=bool)
    itself_pairs = machine.self_pairs if ask_itself else ()
    pairs = np.array(itself_pairs, dtype=np.int64).reshape(-1, 2)
    own = (
        machine.bodies.centers.copy(),
        machine.bodies.rotations.copy(),
        machine.bodies.half_extents.copy(),
    )
    others = (
        obstacles.centers.copy(),
        obstacles.rotations.copy(),
        obstacles.half_extents.copy(),
    )
    counts = machine.body_joints.any(axis=1) | (not standing)
    for start in range(0, len(q), _BATCH):
        part = slice(start, start + _BATCH)
        T = link_poses(machine, q[part])
        _hits(T, own, machine.body_link_index, others, pairs, counts, against[part], itself[part])
    return against, itself
