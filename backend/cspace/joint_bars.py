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
    return joint_bars(machine, q, {joint: edges}, count, layers, eta, slack)[0]


def joint_bars(
    machine: Machine,
    q: Array,
    edges: Mapping[int, Array],
    count: int,
    layers: Mapping[str, Boxes],
    eta: float = 0.0,
    slack: Array | None = None,
) -> list[AnyArray]:
    """`joint_bar` of several joints. edges: by joint."""
    everything = concatenated(layers.values())
    bits = np.repeat(
        np.array([LAYER_BITS[name] for name in layers], dtype=np.int64),
        [len(boxes) for boxes in layers.values()],
    )
    q = np.asarray(q, dtype=float)
    T = link_poses(machine, q)
    bodies = body_boxes(machine, T)
    wrong = np.zeros(len(bodies))
    if slack is not None:
        wrong = machine.stretched_levers @ np.asarray(slack, dtype=float)
    bars = []
    for joint, (low, high) in edges.items():
        T_frame_root = transform.inverse(_about(machine, T, joint))
        step = float(high - low) / count
        hits, inner, outer = bar_cells(
            _arrays(bodies, T_frame_root),
            np.ascontiguousarray(machine.body_joints[:, joint]),
            _arrays(everything, T_frame_root),
            bits,
            machine.self_pair_index,
            SELF,
            float(eta),
            wrong,
            low + (np.arange(count) + 0.5) * step - q[joint],
            0.5 * step,
        )
        cells: AnyArray = np.asarray(hits).astype(np.uint8)
        cells[inner] |= COLLIDING
        cells[~outer] |= FREE
        bars.append(cells)
    return bars


def _arrays(boxes: Boxes, T: Array) -> tuple[Array, Array, Array]:
    """Boxes in the frame that T (4, 4) leads to."""
    R = T[:3, :3]
    return boxes.centers @ R.T + T[:3, 3], R @ boxes.rotations, boxes.half_extents.copy()


def _about(machine: Machine, T: Array, joint: int) -> Array:
    """(4, 4) frame at the joint whose z is its axis, in the root frame. T: (L, 4, 4) link poses."""
    link = int(machine.joint_links[joint])
    z = T[link, :3, :3] @ machine.joint_axes[joint]
    # Any direction that is not near z makes a frame with it.
    x = np.zeros(3)
    x[np.argmin(np.abs(z))] = 1.0
    x -= (x @ z) * z
    x /= np.sqrt(x @ x)
    y = np.array([z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]])
    return transform.make(np.stack([x, y, z], axis=1), T[link, :3, 3])
