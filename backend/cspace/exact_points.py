"""Whether single configurations touch something: every pair of boxes, no grid, no slices."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
from backend.cspace.ground import GROUND
from backend.machine.chain_kernel import set_link_poses, set_placed
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array, BoolArray, IntArray


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _hits(
    chain: tuple[Array, IntArray, IntArray],
    q: Array,
    own: tuple[Array, Array, Array],
    links: IntArray,
    others: tuple[Array, Array, Array],
    first: IntArray,
    counts: BoolArray,
    self_pairs: IntArray,
    against: BoolArray,
    itself: BoolArray,
) -> None:
    """chain: Machine.link_matrices, .link_parents, .link_joints; q: (k, n); own in the links'
    frames; others in the root frame, those of layer l from first[l] to first[l + 1]; counts:
    (layers, n) own bodies that a layer matters to; sets against (layers, k), itself (k,).
    """
    n, m = len(links), len(others[0])
    centers, rotations = np.empty((n, 3)), np.empty((n, 3, 3))
    T, root = np.empty((len(chain[1]), 3, 4)), np.eye(4)
    size, other_size = np.empty(n), np.empty(m)
    for i in range(n):
        size[i] = math.sqrt((own[2][i] ** 2).sum())
    for j in range(m):
        other_size[j] = math.sqrt((others[2][j] ** 2).sum())
    low, high = np.full((len(against), 3), math.inf), np.full((len(against), 3), -math.inf)
    for layer in range(len(against)):
        for j in range(first[layer], first[layer + 1]):
            for a in range(3):
                low[layer, a] = min(low[layer, a], others[0][j, a] - other_size[j])
                high[layer, a] = max(high[layer, a], others[0][j, a] + other_size[j])
    for c in range(len(q)):
        set_link_poses(chain[0], chain[1], chain[2], q[c], root, T)
        set_placed(own, links, T, centers, rotations)
        for layer in range(len(against)):
            for i in range(n):
                if against[layer, c] or not counts[layer, i]:
                    continue
                away = 0.0
                for a in range(3):
                    x = centers[i, a]
                    away += max(low[layer, a] - x, 0.0, x - high[layer, a]) ** 2
                if away > size[i] ** 2:
                    continue
                for j in range(first[layer], first[layer + 1]):
                    d = 0.0
                    for a in range(3):
                        d += (centers[i, a] - others[0][j, a]) ** 2
                    if d > (size[i] + other_size[j]) ** 2:
                        continue
                    g = gap(
                        centers[i], rotations[i], own[2][i],
                        others[0][j], others[1][j], others[2][j], 0.0,
                    )  # fmt: skip
                    if g <= 0.0:
                        against[layer, c] = True
                        break
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


def touching(machine: Machine, q: Array, obstacles: Boxes) -> tuple[BoolArray, BoolArray]:
    """(touches an obstacle, touches itself), each (k,), at q (k, n) [rad]; bodies as built.

    obstacles in the machine's root frame.
    """
    against, itself = touching_layers(machine, q, {"": obstacles})
    return against[""], itself


def touching_layers(
    machine: Machine, q: Array, layers: Mapping[str, Boxes]
) -> tuple[dict[str, BoolArray], BoolArray]:
    """(which layers are touched, touches itself), each (k,), at q (k, n) [rad]; bodies as built.

    layers in the machine's root frame; the tracks stand on the layer "ground": that does not count.
    """
    q = np.ascontiguousarray(q, dtype=float)
    against = np.zeros((len(layers), len(q)), dtype=bool)
    itself = np.zeros(len(q), dtype=bool)
    arm: BoolArray = np.asarray(machine.body_joints.any(axis=1), dtype=bool)
    counts = [arm if name == GROUND else np.ones_like(arm) for name in layers]
    _hits(
        (machine.link_matrices, machine.link_parents, machine.link_joints),
        q,
        _arrays(machine.bodies),
        machine.body_link_index,
        _arrays(concatenated(layers.values())),
        np.cumsum([0, *map(len, layers.values())], dtype=np.int64),
        np.array(counts, dtype=bool).reshape(-1, len(arm)),
        machine.self_pair_index,
        against,
        itself,
    )
    return dict(zip(layers, against, strict=True)), itself


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()
