"""One joint moving alone: its cells, certified, for any joint of any machine.

Bodies that the joint carries turn about its axis; everything else stands. In a frame whose z is
that axis this is what `touching_swings` decides.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from backend.cspace.cells import COLLIDING, FREE, LAYER_BITS, SELF
from backend.cspace.exact import EXACT, INNER, OUTER
from backend.cspace.exact_upper import touching_swings
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.spatial import transform
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import AnyArray, Array, BoolArray


def joint_bar(
    machine: Machine,
    q: Array,
    joint: int,
    edges: Array,
    count: int,
    layers: Mapping[str, Boxes],
    eta: float = 0.0,
    slack: Array | None = None,
) -> AnyArray:
    """uint8 (count,), see backend.cspace.cells: joint values between edges (2,) [rad], others at q.

    q: (n,) [rad]; layers: "partner", "site" in the root frame; eta: growth of the bodies for "free"
    [m]; slack: (n,) what each joint may be wrong by, which matters between own bodies [rad].
    """
    q = np.asarray(q, dtype=float)
    T = link_poses(machine, q)
    T_frame_root = transform.inverse(_about(machine, T, joint))
    bodies = body_boxes(machine, T).moved(T_frame_root)
    carried: BoolArray = np.asarray(machine.body_joints[:, joint], dtype=bool)
    step = float(edges[1] - edges[0]) / count
    angles = edges[0] + (np.arange(count) + 0.5) * step - q[joint]
    turning = _Turning(bodies, carried, angles, 0.5 * step)

    cells = np.zeros(count, dtype=np.uint8)
    placed = {name: boxes.moved(T_frame_root) for name, boxes in layers.items()}
    for name, boxes in placed.items():
        cells[turning.against(boxes, EXACT)] |= LAYER_BITS[name]
    everything = concatenated(placed.values())
    inner = turning.against(everything, INNER) | turning.itself(machine, INNER)
    outer = turning.against(everything, OUTER, eta)
    wrong = np.zeros(len(bodies))
    if slack is not None:
        wrong = machine.stretched_levers @ np.asarray(slack, dtype=float)
    outer |= turning.itself(machine, OUTER, wrong)
    cells[turning.itself(machine, EXACT)] |= SELF
    cells[inner] |= COLLIDING
    cells[~outer] |= FREE
    return cells


def _about(machine: Machine, T: Array, joint: int) -> Array:
    """(4, 4) frame at the joint whose z is its axis, in the root frame. T: (L, 4, 4) link poses."""
    link = int(machine.joint_links[joint])
    z = T[link, :3, :3] @ machine.links[link].axis
    z = z / np.linalg.norm(z)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x = x / np.linalg.norm(x)
    return transform.make(np.stack([x, np.cross(z, x), z], axis=1), T[link, :3, 3])


class _Turning:
    """Bodies in the joint's frame, those that it carries, and the angles that it takes."""

    def __init__(self, bodies: Boxes, carried: BoolArray, angles: Array, half: float) -> None:
        self._bodies, self._carried = bodies, carried
        self._moving, self._still = np.flatnonzero(carried), np.flatnonzero(np.logical_not(carried))
        self._angles, self._half = angles, half

    def against(self, obstacles: Boxes, kind: int, eta: float = 0.0) -> BoolArray:
        """(n,) whether any body touches obstacles; where one that stands does, at every angle."""
        out = np.zeros(len(self._angles), dtype=bool)
        if not len(obstacles):
            return out
        grown = self._bodies.inflated(eta) if eta > 0.0 else self._bodies
        out |= self._meets(grown.take(self._moving), obstacles, kind)
        standing = grown.take(self._still)
        out |= touching_swings(
            standing, obstacles, _may_meet(standing, obstacles), np.zeros(1), 0.0, kind
        )
        return out

    def itself(self, machine: Machine, kind: int, wrong: Array | None = None) -> BoolArray:
        """(n,) whether the machine touches itself. wrong: (bodies,) growth of each body [m]."""
        out = np.zeros(len(self._angles), dtype=bool)
        if not machine.self_pairs:
            return out
        bodies = self._bodies
        if wrong is not None:
            bodies = Boxes(bodies.centers, bodies.rotations, bodies.half_extents + wrong[:, None])
        i, j = np.array(machine.self_pairs).T
        alike = self._carried[i] == self._carried[j]
        # Bodies that stand against each other touch at every angle, or at none.
        counts = np.zeros((len(bodies), len(bodies)), dtype=bool)
        counts[i[alike], j[alike]] = True
        out |= touching_swings(
            bodies, bodies, counts & _may_meet(bodies, bodies), np.zeros(1), 0.0, kind
        )
        counts[:] = False
        counts[i[~alike], j[~alike]] = counts[j[~alike], i[~alike]] = True
        pairs = counts[np.ix_(self._moving, self._still)]
        out |= self._meets(bodies.take(self._moving), bodies.take(self._still), kind, pairs)
        return out

    def _meets(
        self, own: Boxes, obstacles: Boxes, kind: int, pairs: BoolArray | None = None
    ) -> BoolArray:
        may = _ever_meet(own, obstacles)
        if pairs is not None:
            may &= pairs
        used = may.any(axis=0)
        if not used.any():
            return np.zeros(len(self._angles), dtype=bool)
        return touching_swings(
            own, obstacles.take(used), may[:, used], self._angles, self._half, kind
        )


def _may_meet(a: Boxes, b: Boxes) -> BoolArray:
    """(a, b) whether the spheres around boxes touch."""
    apart = np.linalg.norm(a.centers[:, None] - b.centers[None], axis=2)
    size = [np.linalg.norm(x.half_extents, axis=1) for x in (a, b)]
    return np.asarray(apart <= size[0][:, None] + size[1][None] + 1e-9)


def _ever_meet(own: Boxes, obstacles: Boxes) -> BoolArray:
    """(own, obstacles) whether boxes can touch while `own` turn about z: rings around the axis."""
    rings = []
    for boxes in (own, obstacles):
        reach = np.einsum("nij,nj->ni", np.abs(boxes.rotations), boxes.half_extents)
        away = np.hypot(boxes.centers[:, 0], boxes.centers[:, 1])
        across = np.hypot(reach[:, 0], reach[:, 1])
        z = boxes.centers[:, 2]
        rings.append((away - across, away + across, z - reach[:, 2], z + reach[:, 2]))
    (r0, r1, z0, z1), (s0, s1, y0, y1) = rings
    pad = 1e-9
    meet = (r0[:, None] <= s1 + pad) & (s0 <= r1[:, None] + pad)
    return np.asarray(meet & (z0[:, None] <= y1 + pad) & (y0 <= z1[:, None] + pad))
