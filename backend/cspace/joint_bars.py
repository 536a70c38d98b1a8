"""One joint moving alone: its cells, certified, for any joint of any machine.

Bodies that the joint carries turn about its axis; everything else stands. In a frame whose z is
that axis this is what `joint_bars_kernel` decides.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from backend.cspace.cells import COLLIDING, FREE, LAYER_BITS, SELF
from backend.cspace.joint_bars_kernel import bar_cells
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.spatial import transform
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import AnyArray, Array


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
    everything = concatenated(layers.values())
    bits = np.repeat(
        np.array([LAYER_BITS[name] for name in layers], dtype=np.int64),
        [len(boxes) for boxes in layers.values()],
    )
    q = np.asarray(q, dtype=float)
    T = link_poses(machine, q)
    T_frame_root = transform.inverse(_about(machine, T, joint))
    step = float(edges[1] - edges[0]) / count
    wrong = np.zeros(len(machine.bodies))
    if slack is not None:
        wrong = machine.stretched_levers @ np.asarray(slack, dtype=float)
    hits, inner, outer = bar_cells(
        _arrays(body_boxes(machine, T).moved(T_frame_root)),
        np.ascontiguousarray(machine.body_joints[:, joint]),
        _arrays(everything.moved(T_frame_root)),
        bits,
        machine.self_pair_index,
        SELF,
        float(eta),
        wrong,
        edges[0] + (np.arange(count) + 0.5) * step - q[joint],
        0.5 * step,
    )
    cells: AnyArray = np.asarray(hits).astype(np.uint8)
    cells[inner] |= COLLIDING
    cells[~outer] |= FREE
    return cells


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()


def _about(machine: Machine, T: Array, joint: int) -> Array:
    """(4, 4) frame at the joint whose z is its axis, in the root frame. T: (L, 4, 4) link poses."""
    link = int(machine.joint_links[joint])
    z = T[link, :3, :3] @ machine.links[link].axis
    z = z / np.linalg.norm(z)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x = x / np.linalg.norm(x)
    return transform.make(np.stack([x, np.cross(z, x), z], axis=1), T[link, :3, 3])
