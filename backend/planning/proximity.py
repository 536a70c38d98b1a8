"""Points of a machine and what is nearest to them: all that the methods know of the world.

Any collision server may fill the record. `near_points` fills it for limits that are boxes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.collision import box_distance
from backend.machine.kinematics import body_boxes
from backend.machine.model import Machine
from backend.planning import proximity_kernels
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

OWN_BODY = -1
"""`obstacle` of a pair of two bodies of the machine itself."""


@dataclass(frozen=True)
class Limits:
    """What must not be entered: boxes in the site frame, each with its name for the operator."""

    names: tuple[str, ...]
    boxes: Boxes


@dataclass(frozen=True)
class Proximities:
    """k close pairs: a point that moves with a body of the machine, and a point of an obstacle.

    body: (k,) index; obstacle: (k,) index into names, OWN_BODY in a self pair; other: (k,) the
    machine's body that carries the second point in a self pair, else -1. point, obstacle_point:
    (k, 3) [m], site frame. distance: (k,) [m], negative (minus the depth) on overlap. normal:
    (k, 3) unit vectors from the obstacle to the machine (Mäkinen 2021, Eq. (2.2)).
    """

    names: tuple[str, ...]
    body: IntArray
    obstacle: IntArray
    other: IntArray
    point: Array
    obstacle_point: Array
    distance: Array
    normal: Array

    def __len__(self) -> int:
        return len(self.distance)

    def take(self, index: IntArray) -> Proximities:
        return Proximities(
            self.names,
            self.body[index],
            self.obstacle[index],
            self.other[index],
            self.point[index],
            self.obstacle_point[index],
            self.distance[index],
            self.normal[index],
        )

    def words(self, machine: Machine, k: int) -> str:
        """The k-th pair for a person: "stick to adjacent track 0.31 m"."""
        part = machine.part_of_body(int(self.body[k]))
        if self.obstacle[k] == OWN_BODY:
            what = f"own {machine.part_of_body(int(self.other[k]))}"
        else:
            what = self.names[self.obstacle[k]]
        return f"{part} to {what} {self.distance[k]:.2f} m"


def posed(machine: Machine, q: Array, T_site_root: Array | None = None) -> Array:
    """(L, 4, 4) T_site_link of one posture (n,): `kinematics.link_poses`, compiled."""
    root = np.eye(4) if T_site_root is None else np.ascontiguousarray(T_site_root, dtype=float)
    return np.asarray(
        proximity_kernels.link_poses(
            machine.link_matrices, machine.link_parents, machine.link_joints, q, root
        )
    )


def gradients(machine: Machine, T_site_links: Array, near: Proximities) -> Array:
    """(k, n) how each distance changes per unit of joint motion [m/rad]: n . (J_point - J_other).

    J is that of Mäkinen 2021, Eq. (3.15). T_site_links: (L, 4, 4).
    """
    return np.asarray(
        proximity_kernels.gradients(
            T_site_links,
            machine.joint_links,
            machine.joint_axes,
            machine.body_joints,
            near.body,
            near.other,
            near.point,
            near.obstacle_point,
            near.normal,
        )
    )


@dataclass(frozen=True)
class Sight:
    """How near a pair must be to count [m]: limits (bodies,) by body, own (pairs,) by self pair."""

    limits: Array
    own: Array

    @staticmethod
    def everywhere(machine: Machine, within: float) -> Sight:
        bodies, pairs = len(machine.body_links), len(machine.self_pair_index)
        return Sight(np.full(bodies, within), np.full(pairs, within))


def near_points(
    machine: Machine,
    T_site_links: Array,
    limits: Limits,
    sight: Sight,
    corners: bool = False,
    own: bool = True,
) -> Proximities:
    """Pairs in sight of the machine's bodies and the limits, and of its own bodies.

    One pair per two boxes, their closest points; with `corners` and boxes nearer than 1.5 m also
    each corner that is near the other box, so that what is nearest does not jump where faces are
    almost parallel.
    T_site_links: (L, 4, 4). Bodies that no joint moves are not judged against limits.
    """
    mine = body_boxes(machine, T_site_links)
    bound = box_distance.lower_bounds(mine, limits.boxes)
    moving = np.asarray(machine.body_joints.any(axis=1))
    index = np.stack(np.nonzero((bound < sight.limits[:, None]) & moving[:, None]), axis=1)
    outer = _found(mine, limits.boxes, index, sight.limits[index[:, 0]], corners)
    none = np.full(len(outer[3]), -1, dtype=np.int64)
    parts = [(outer[0][:, 0], outer[0][:, 1], none, *outer[1:])]
    if own and len(machine.self_pair_index):
        # The body that more joints move comes first: it is what the joints carry about.
        pairs = machine.self_pair_index[:, ::-1]
        some = box_distance.lower_bounds(mine, mine)[pairs[:, 0], pairs[:, 1]] < sight.own
        inner = _found(mine, mine, pairs[some], sight.own[some], corners)
        none = np.full(len(inner[3]), OWN_BODY, dtype=np.int64)
        parts.append((inner[0][:, 0], none, inner[0][:, 1], *inner[1:]))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Proximities(limits.names, *columns)


def shortest(near: Proximities) -> float:
    """The shortest distance [m], infinite without pairs."""
    return float(near.distance.min(initial=np.inf))


def closest_per_group(near: Proximities, group: IntArray) -> IntArray:
    """Index of the closest pair of each group; group: (k,) labels."""
    order = np.lexsort((near.distance, group))
    first = np.flatnonzero(np.diff(group[order], prepend=-1))
    return np.asarray(order[first], dtype=np.int64)


def _found(
    a: Boxes, b: Boxes, index: IntArray, within: Array, corners: bool
) -> tuple[IntArray, Array, Array, Array, Array]:
    who, on_a, on_b, distances, normals = proximity_kernels.find(
        *(a.centers, a.rotations, a.half_extents),
        *(b.centers, b.rotations, b.half_extents),
        np.ascontiguousarray(index),
        within,
        corners,
    )
    return who, on_a, on_b, distances, normals
