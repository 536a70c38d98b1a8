"""An excavator's arm as what its kernels need: planar profiles on a chain, each in a lateral slab.

Whatever the swing, boom, stick and bucket turn about parallel axes, so every body keeps its lateral
extent and moves in the arm's plane. A box whose one axis is normal to that plane is exactly its
profile times its slab. A box that stands askew is wrapped in such a prism (`outer`) and filled with
one (`inner`): the first never frees a cell that is blocked, the second never blocks one that is
free, and the exact image asks the box itself in between.

Frame `arm`: origin and z of T_root_swing, x forward in the plane of the arm, t to its left. It
turns with the swing joint. Angles in the plane raise when positive (from x to z).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from backend.machine.kinematics import link_poses
from backend.machine.model import PARTS, Machine
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

PARALLEL = 1e-6  # [rad] joint axes off the plane's normal at most
ALIGNED = 1e-9  # [rad] a box more askew than this is not taken for a prism
GROUPS = ("boom", "stick", "bucket")


class Profiles(NamedTuple):
    """Convex profiles of n bodies about their pivots, at joint values 0; arrays for the kernels.

    group: (n,) 0 boom, 1 stick, 2 bucket and what it carries; slab: (n,) row of `slabs`; sides:
    (n,) vertices, 0 leaves a body out; radius, bearing: (n, v) polar vertices [m], [rad];
    offset, normal: (n, v) edges m . x <= offset [m], direction of m [rad]; reach: (n,) largest
    radius; depth: (n,) signed distance of the pivot to the profile, negative inside [m];
    slabs: (s, 2) lateral intervals [m].
    """

    group: IntArray
    slab: IntArray
    sides: IntArray
    radius: Array
    bearing: Array
    offset: Array
    normal: Array
    reach: Array
    depth: Array
    slabs: Array


@dataclass(frozen=True)
class PlanarArm:
    """The chain and its bodies.

    T_root_arm: (4, 4) at swing 0; swing_sign, signs (3,): +1 when the joint turns counter-clockwise
    about z, or raises; pivot: (2,) boom pivot (x, z) [m]; boom, stick: (2,) to the next pivot at
    joint values 0 [m]. bodies: (n,) indices of the arm's bodies in Machine.bodies; boxes: the same
    in the frame `arm` at joint values 0; aligned: (n,) whether the box has an axis normal to the
    plane. outer, inner: see above.
    """

    T_root_arm: Array
    swing_sign: float
    signs: Array
    pivot: Array
    boom: Array
    stick: Array
    bodies: IntArray
    boxes: Boxes
    groups: IntArray
    aligned: BoolArray
    outer: Profiles
    inner: Profiles

    @property
    def pivots(self) -> Array:
        """(3, 2) pivots of boom, stick and bucket at joint values 0 [m]."""
        return np.cumsum([self.pivot, self.boom, self.stick], axis=0)

    def T_arm_root(self, swing: Array) -> Array:
        """(..., 4, 4) of the frame that has turned with the swing joint. swing: (...) [rad]."""
        turn = transform.make(rotation.rz(self.swing_sign * np.asarray(swing)), np.zeros(3))
        return transform.inverse(self.T_root_arm @ turn)


def planar_arm(machine: Machine, rest: Array | None = None, inflation: float = 0.0) -> PlanarArm:
    """The planar description of `machine`, its bodies grown by `inflation` [m] on every side.

    rest: (n,) joint values, of which tilt and rotate are used; 0 when None. Raises ValueError when
    the axes of boom, stick and bucket are not parallel and normal to the swing axis.
    """
    q = np.zeros(len(machine.joints))
    if rest is not None:
        q[4:] = np.asarray(rest, dtype=float)[4:]
    T_root_link = link_poses(machine, q)
    joint_links = [next(i for i, k in enumerate(machine.links) if k.joint == j) for j in range(4)]
    axes = np.array([T_root_link[i, :3, :3] @ machine.links[i].axis for i in joint_links])
    z = machine.arm.T_root_swing[:3, 2]
    azimuth = machine.sun.azimuth_offset
    forward = np.cos(azimuth) * machine.arm.T_root_swing[:3, 0]
    forward = forward + np.sin(azimuth) * machine.arm.T_root_swing[:3, 1]
    left = axes[1] * np.sign(axes[1] @ np.cross(z, forward))
    off = [np.linalg.norm(np.cross(axes[0], z)), abs(left @ z)]
    off += [np.linalg.norm(np.cross(axis, left)) for axis in axes[1:]]
    if max(off) > PARALLEL:
        raise ValueError(f"{machine.name}: the axes of boom, stick and bucket are not parallel")
    left = left - (left @ z) * z
    left = left / np.linalg.norm(left)
    R = np.stack([np.cross(left, z), left, z], axis=1)
    T_root_arm = transform.make(R, machine.arm.T_root_swing[:3, 3])
    T_arm_link = transform.inverse(T_root_arm) @ T_root_link
    pivots = np.array([T_arm_link[i, [0, 2], 3] for i in joint_links[1:]])

    part = np.array([PARTS.index(machine.part_of_body(b)) for b in range(len(machine.bodies))])
    bodies = np.flatnonzero(part >= 2)
    groups = np.minimum(part[bodies], 4) - 2
    T = T_arm_link[machine.body_link_index[bodies]]
    own = machine.bodies.take(bodies).inflated(inflation)
    boxes = Boxes(
        (T[:, :3, :3] @ own.centers[:, :, None])[:, :, 0] + T[:, :3, 3],
        T[:, :3, :3] @ own.rotations,
        own.half_extents,
    )
    # The two smaller lateral components are the sines of how far the box is askew.
    aligned = np.sort(np.abs(boxes.rotations[:, 1, :]), axis=1)[:, 1] < ALIGNED
    outer = [outer_prism(boxes, i) for i in range(len(boxes))]
    inner = [outer[i] if aligned[i] else inner_prism(boxes, i) for i in range(len(boxes))]
    return PlanarArm(
        T_root_arm=T_root_arm,
        swing_sign=float(np.sign(axes[0] @ z)),
        signs=-np.sign(axes[1:] @ left),
        pivot=pivots[0],
        boom=pivots[1] - pivots[0],
        stick=pivots[2] - pivots[1],
        bodies=bodies.astype(np.int64),
        boxes=boxes,
        groups=groups.astype(np.int64),
        aligned=aligned,
        outer=_profiles(outer, groups, pivots),
        inner=_profiles(inner, groups, pivots),
    )


def outer_prism(boxes: Boxes, i: int) -> tuple[Array, Array]:
    """Profile (v, 2) counter-clockwise and slab (2,) of the smallest prism around box i."""
    corners = boxes.take(np.array([i])).corners()[0]
    slab = np.array([corners[:, 1].min(), corners[:, 1].max()])
    return hull(corners[:, [0, 2]]), slab


def inner_prism(boxes: Boxes, i: int) -> tuple[Array, Array]:
    """Profile and slab of a prism inside box i, (0, 2) when there is none."""
    R, half = boxes.rotations[i], boxes.half_extents[i]
    across = int(np.argmax(np.abs(R[1])))
    u, v = (k for k in range(3) if k != across)
    e1 = np.array([R[0, u], R[2, u]]) / np.hypot(R[0, u], R[2, u])
    frame = np.zeros((3, 3))
    frame[[0, 2], u] = e1
    frame[[0, 2], v] = [-e1[1], e1[0]]
    frame[1, across] = 1.0
    # |R^T frame| size <= half holds the prism inside; the proportions of the box are kept.
    need = np.abs(R.T @ frame) @ half
    if (need <= 0.0).any():
        return np.zeros((0, 2)), np.zeros(2)
    size = half * float((half / need).min()) * (1.0 - 1e-12)
    center = boxes.centers[i]
    corners = [s * size[u] * frame[:, u] + r * size[v] * frame[:, v] for s, r in _SQUARE]
    slab = center[1] + size[across] * np.array([-1.0, 1.0])
    return hull(np.array(corners)[:, [0, 2]] + center[[0, 2]]), slab


_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def hull(points: Array) -> Array:
    """Convex hull (k, 2) of points (n, 2), counter-clockwise (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    chains = []
    for run in (ordered, ordered[::-1]):
        chain: list[Array] = []
        for p in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 1e-15:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    return np.array(chains)


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _profiles(prisms: list[tuple[Array, Array]], groups: IntArray, pivots: Array) -> Profiles:
    n = len(prisms)
    width = max([len(p) for p, _ in prisms], default=0) or 1
    radius, bearing, offset, normal = (np.zeros((n, width)) for _ in range(4))
    count, reach, depth = np.zeros(n, np.int64), np.zeros(n), np.zeros(n)
    for i, (polygon, _) in enumerate(prisms):
        k = len(polygon)
        count[i] = k
        if k == 0:
            continue
        p = polygon - pivots[groups[i]]
        edge = np.roll(p, -1, axis=0) - p
        m = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        m = m / np.linalg.norm(m, axis=1, keepdims=True)
        radius[i, :k] = np.linalg.norm(p, axis=1)
        bearing[i, :k] = np.arctan2(p[:, 1], p[:, 0])
        # The edge's line must not cut off its own vertices by rounding.
        offset[i, :k] = (m @ p.T).max(axis=1)
        normal[i, :k] = np.arctan2(m[:, 1], m[:, 0])
        reach[i] = radius[i].max()
        depth[i] = _signed_distance(p, edge, m)
    keys = np.round([slab for _, slab in prisms], 12).reshape(-1, 2)
    slabs, index = np.unique(keys, axis=0, return_inverse=True)
    slab = index.reshape(-1).astype(np.int64)
    group = np.asarray(groups, dtype=np.int64)
    return Profiles(
        group, slab, count, radius, bearing, offset, normal, reach, depth, slabs.astype(float)
    )


def _signed_distance(p: Array, edge: Array, m: Array) -> float:
    """Distance of the origin to the polygon p, negative inside."""
    beyond = -(m * p).sum(axis=1)
    if (beyond <= 0.0).all():
        return float(beyond.max())
    share = -(p * edge).sum(axis=1) / np.maximum((edge * edge).sum(axis=1), 1e-300)
    nearest = p + np.clip(share, 0.0, 1.0)[:, None] * edge
    return float(np.linalg.norm(nearest, axis=1).min())
