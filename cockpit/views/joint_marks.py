"""Where a machine is among the cells of its joint volume, and how far it still moves. Pure."""

from __future__ import annotations

import numpy as np

from backend.cspace.cells import FREE
from backend.spatial.types import AnyArray, Array
from cockpit.views import palette
from cockpit.views.joint_frame import SIDE, place
from cockpit.views.shapes import BOX_EDGES, Float32

STILL = np.deg2rad(0.2)  # a shorter stopping distance is not drawn
TEE = 0.16  # half the length of a T's strokes [m]
DASHES = 9  # along an edge of the full-speed box, every second one drawn


def stops_free(cells: AnyArray, edges: Array, q: Array, axis: int, stop: float) -> bool:
    """Whether every cell from q (3,) to q + stop [rad] along an axis is certified free."""
    span = edges[:, 1] - edges[:, 0]
    path = np.repeat(q[None], 64, axis=0)
    path[:, axis] += np.linspace(0.0, stop, 64)
    index = np.floor((path - edges[:, 0]) / span * cells.shape).astype(int)
    index = np.clip(index, 0, np.array(cells.shape) - 1)
    return bool((cells[tuple(index.T)] & FREE).all())


def stop_bars(
    cells: AnyArray, edges: Array, q: Array, stop: Array, stale: bool = False
) -> tuple[Float32, AnyArray]:
    """Lines (k, 2, 3) [m] from q to a T along each axis, and their colours, uint8 (k, 2, 3).

    edges: (3, 2), q, stop: (3,) boom, stick, bucket at the present rates, signed [rad]. Red where
    it passes through or ends in what is not certified free, or is stopped by the joint's limit.
    """
    lines: list[Array] = []
    colors: list[palette.Rgb] = []
    here = place(q, edges)
    for axis in range(3):
        if not abs(stop[axis]) > STILL:
            continue
        end = q.copy()
        end[axis] = np.clip(q[axis] + stop[axis], *edges[axis])
        there = place(end, edges)
        strokes = [np.stack([here, there])]
        for across in {0, 1, 2} - {axis}:
            offset = TEE * np.eye(3)[across]
            strokes.append(np.stack([there - offset, there + offset]))
        free = stops_free(cells, edges, q, axis, float(stop[axis]))
        within = abs(end[axis] - q[axis] - stop[axis]) < 1e-9
        color = palette.TEXT if free and within else palette.BLOCKED
        lines += strokes
        colors += [palette.line(palette.STALE if stale else color)] * len(strokes)
    points = np.array(lines, dtype=np.float32).reshape(-1, 2, 3)
    return points, np.repeat(np.array(colors, dtype=np.uint8).reshape(-1, 1, 3), 2, axis=1)


def full_box(edges: Array, q: Array, full: Array) -> Float32:
    """Dashed edges (k, 2, 3) [m] of what is within a stop from full speed either way.

    edges: (3, 2), q, full: (3,) [rad].
    """
    low = place(np.clip(q - np.abs(full), edges[:, 0], edges[:, 1]), edges)
    high = place(np.clip(q + np.abs(full), edges[:, 0], edges[:, 1]), edges)
    ends = low + BOX_EDGES * (high - low)
    shares = np.arange(DASHES + 1) / DASHES
    points = ends[:, :1] + shares[None, :, None] * (ends[:, 1:] - ends[:, :1])
    dashes = np.stack([points[:, :-1:2], points[:, 1::2]], axis=2)
    return dashes.reshape(-1, 2, 3).astype(np.float32)


def plumb_lines(here: Array) -> Float32:
    """Lines (3, 2, 3) [m] from a point to the walls behind: x = 0, y = SIDE, z = 0."""
    feet = np.repeat(here[None], 3, axis=0)
    feet[[0, 1, 2], [0, 1, 2]] = 0.0, SIDE, 0.0
    return np.stack([np.repeat(here[None], 3, axis=0), feet], axis=1).astype(np.float32)
