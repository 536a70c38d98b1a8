"""An independent judge of configurations: its own kinematics, and separating axes in numpy.

Nothing here calls the project's geometry; a machine is read as a table of links and boxes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from backend.machine.model import Machine
from backend.spatial.boxes import Boxes

CHUNK = 500  # configurations at a time: what a step needs stays in the cache


@dataclass(frozen=True)
class Placed:
    """Bodies of c configurations in the root frame.

    centers: (c, n, 3), rotations: (c, n, 3, 3), halves: (n, 3).
    """

    centers: np.ndarray
    rotations: np.ndarray
    halves: np.ndarray


def placed(machine: Machine, q: np.ndarray) -> Placed:
    """Bodies at q (c, joints) [rad], link by link from the root."""
    T: list[np.ndarray] = []
    for link in machine.links:
        own = np.broadcast_to(link.T_parent_joint, (len(q), 4, 4)).copy()
        if link.joint >= 0:
            turn = Rotation.from_rotvec(q[:, link.joint, None] * link.axis).as_matrix()
            own[:, :3, :3] = own[:, :3, :3] @ turn
        T.append(own if link.parent < 0 else T[link.parent] @ own)
    centers, rotations = [], []
    for b, link in enumerate(machine.body_links):
        R = T[link][:, :3, :3]
        centers.append(R @ machine.bodies.centers[b] + T[link][:, :3, 3])
        rotations.append(R @ machine.bodies.rotations[b])
    return Placed(np.stack(centers, 1), np.stack(rotations, 1), machine.bodies.half_extents)


def box_gaps(
    ca: np.ndarray,
    Ra: np.ndarray,
    ha: np.ndarray,
    cb: np.ndarray,
    Rb: np.ndarray,
    hb: np.ndarray,
    all_axes: bool = True,
) -> np.ndarray:
    """(k,) largest gap of boxes a[k], b[k] along their 15 axes [m]; <= 0 exactly when they touch.

    Gottschalk, Lin, Manocha: OBBTree, SIGGRAPH 1996. Without `all_axes` only the six face axes,
    which prove separation where they see it.
    """
    between = cb - ca
    R = np.swapaxes(Ra, 1, 2) @ Rb
    on_a = np.abs(np.einsum("kxi,kx->ki", Ra, between))
    on_b = np.abs(np.einsum("kxi,kx->ki", Rb, between))
    Q = np.abs(R)
    gap = (on_a - ha - np.einsum("kij,kj->ki", Q, hb)).max(axis=1)
    gap = np.maximum(gap, (on_b - hb - np.einsum("kij,ki->kj", Q, ha)).max(axis=1))
    if not all_axes:
        return np.asarray(gap)
    axes = np.cross(np.swapaxes(Ra, 1, 2)[:, :, None], np.swapaxes(Rb, 1, 2)[:, None])
    axes = axes.reshape(-1, 9, 3)
    length = np.linalg.norm(axes, axis=2)
    parallel = length < 1e-7  # such edges have no plane of their own: the faces decide
    axes = axes / np.where(parallel, 1.0, length)[:, :, None]
    reach = (np.abs(axes @ Ra) * ha[:, None]).sum(axis=2)
    reach += (np.abs(axes @ Rb) * hb[:, None]).sum(axis=2)
    edge = np.abs((axes @ between[:, :, None])[:, :, 0]) - reach
    return np.asarray(np.maximum(gap, np.where(parallel, -np.inf, edge).max(axis=1)))


def _beyond(c: np.ndarray, box: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """(k,) distance of points c[k] to boxes (centers, rotations, halves)."""
    local = np.abs(np.einsum("kxi,kx->ki", box[1], c - box[0])) - box[2]
    return np.asarray(np.linalg.norm(np.maximum(local, 0.0), axis=1))


def near_pairs(
    own: Placed, obstacles: Boxes, slack: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(configuration, body, obstacle) where each one's bounding sphere is within `slack` [m] of the
    other.
    """
    size = np.linalg.norm(own.halves, axis=1) + slack
    other = np.linalg.norm(obstacles.half_extents, axis=1)
    flat = own.centers.reshape(-1, 3)
    square = (flat**2).sum(axis=1)[:, None] + (obstacles.centers**2).sum(axis=1)
    square -= 2.0 * flat @ obstacles.centers.T
    # The square is good to 1e-12 m^2, so that a millimetre more covers its rounding.
    reach = size[:, None] + other + 1e-3
    c, i, j = np.nonzero(square.reshape(*own.centers.shape[:2], -1) <= reach**2)
    there = obstacles.centers[j], obstacles.rotations[j], obstacles.half_extents[j]
    near = _beyond(own.centers[c, i], there) <= size[i]
    c, i, j = c[near], i[near], j[near]
    here = own.centers[c, i], own.rotations[c, i], own.halves[i]
    near = _beyond(obstacles.centers[j], here) <= other[j] + slack
    return c[near], i[near], j[near]


def near_self_pairs(
    machine: Machine, own: Placed, slack: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `near_pairs`, among machine.self_pairs."""
    pairs = np.array(machine.self_pairs, dtype=np.int64).reshape(-1, 2)
    size = np.linalg.norm(own.halves, axis=1)
    between = own.centers[:, pairs[:, 0]] - own.centers[:, pairs[:, 1]]
    reach = size[pairs[:, 0]] + size[pairs[:, 1]] + slack
    c, p = np.nonzero((between**2).sum(axis=2) <= reach**2)
    i, j = pairs[p, 0], pairs[p, 1]
    there = own.centers[c, j], own.rotations[c, j], own.halves[j]
    near = _beyond(own.centers[c, i], there) <= size[i] + slack
    c, i, j = c[near], i[near], j[near]
    here = own.centers[c, i], own.rotations[c, i], own.halves[i]
    near = _beyond(own.centers[c, j], here) <= size[j] + slack
    return c[near], i[near], j[near]


def _touching(
    a: tuple[np.ndarray, np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> np.ndarray:
    """(k,) whether boxes a[k] and b[k] touch, by the faces' axes first."""
    out = np.zeros(len(a[0]), dtype=bool)
    near = np.flatnonzero(box_gaps(*a, *b, all_axes=False) <= 0.0)
    a, b = tuple(v[near] for v in a), tuple(v[near] for v in b)  # type: ignore[assignment]
    out[near[box_gaps(*a, *b) <= 0.0]] = True
    return out


def touching(
    machine: Machine, q: np.ndarray, obstacles: Boxes, shifts: np.ndarray | None = None
) -> np.ndarray:
    """(c, 2) whether the machine at q (c, joints) touches an obstacle, and itself.

    shifts: (c, obstacles, 3) where each obstacle really is, beside where it is said to be [m].
    """
    out = np.zeros((len(q), 2), dtype=bool)
    slack = 0.0 if shifts is None else float(np.linalg.norm(shifts, axis=2).max(initial=0.0))
    for start in range(0, len(q), CHUNK):
        part = slice(start, start + CHUNK)
        own = placed(machine, q[part])
        c, i, j = near_pairs(own, obstacles, slack)
        at = obstacles.centers[j]
        if shifts is not None:
            at = at + shifts[part][c, j]
        a = own.centers[c, i], own.rotations[c, i], own.halves[i]
        hit = _touching(a, (at, obstacles.rotations[j], obstacles.half_extents[j]))
        out[start + c[hit], 0] = True
        c, i, j = near_self_pairs(machine, own)
        a = own.centers[c, i], own.rotations[c, i], own.halves[i]
        hit = _touching(a, (own.centers[c, j], own.rotations[c, j], own.halves[j]))
        out[start + c[hit], 1] = True
    return out


def clearance(machine: Machine, q: np.ndarray, obstacles: Boxes) -> float:
    """The smallest gap of all pairs at q (joints,) [m]; minus the penetration on overlap."""
    own = placed(machine, q[None])
    i, j = (g.ravel() for g in np.meshgrid(*map(np.arange, (len(own.halves), len(obstacles)))))
    against = box_gaps(
        own.centers[0, i], own.rotations[0, i], own.halves[i],
        obstacles.centers[j], obstacles.rotations[j], obstacles.half_extents[j],
    )  # fmt: skip
    i, j = np.array(machine.self_pairs, dtype=np.int64).reshape(-1, 2).T
    itself = box_gaps(
        own.centers[0, i], own.rotations[0, i], own.halves[i],
        own.centers[0, j], own.rotations[0, j], own.halves[j],
    )  # fmt: skip
    return float(min(against.min(initial=np.inf), itself.min(initial=np.inf)))
