"""The frame of the joint-space view: a box with walls, ticks in degrees, and names of the axes."""

from __future__ import annotations

import numpy as np
import viser

from backend.spatial.types import Array
from cockpit.views import palette
from cockpit.views.shapes import BOX_EDGES, Float32

AXES = ("boom", "stick", "bucket")  # along x, y and z
PLACE = (0.0, 0.0, -4000.0)  # of its lowest corner: beyond what cameras at the site see [m]
SIDE = 4.0  # of the box, along every axis [m]
SIZE = np.full(3, SIDE)
TICKS = (5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0)  # [deg] from tick to tick
MOST_TICKS = 6

# The edges that carry the ticks, seen from the "joints" camera: two in front below, one at the
# left. Per axis: where it is on the other axes (x, y, z) as a share, and outwards from the box.
_EDGES = (
    (np.array([0.0, 0.0, 0.0]), np.array([0.0, -1.0, -0.25])),
    (np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, -0.25])),
    (np.array([0.0, 0.0, 0.0]), np.array([-0.75, -0.35, 0.0])),
)
# The three walls behind the cells, as (axis that is fixed, share of it).
_WALLS = ((0, 0.0), (1, 1.0), (2, 0.0))


def place(angles: Array, edges: Array) -> Array:
    """Joint angles (..., 3) as points in the box [m]. edges: (3, 2) of the volume [rad]."""
    return np.asarray(SIZE * (angles - edges[:, 0]) / (edges[:, 1] - edges[:, 0]))


def ticks(edges: Array) -> list[int]:
    """Round degrees within (2,) edges [rad], at most MOST_TICKS."""
    low, high = np.rad2deg(edges)
    step = next((s for s in TICKS if (high - low) / s <= MOST_TICKS), TICKS[-1])
    first, last = int(np.ceil(low / step - 1e-6)), int(np.floor(high / step + 1e-6))
    return [round(k * step) for k in range(first, last + 1)]


def wall_lines(edges: Array) -> Float32:
    """Lines (k, 2, 3) at the ticks on the walls behind the cells [m]."""
    lines = []
    for fixed, share in _WALLS:
        for axis in {0, 1, 2} - {fixed}:
            along = 3 - fixed - axis
            for degrees in ticks(edges[axis]):
                line = np.zeros((2, 3))
                line[:, fixed] = share * SIDE
                line[:, axis] = place(np.full(3, np.deg2rad(degrees)), edges)[axis]
                line[1, along] = SIDE
                lines.append(line)
    return np.array(lines, dtype=np.float32).reshape(-1, 2, 3)


def box_lines() -> Float32:
    """The twelve edges (12, 2, 3) of the box [m]."""
    return (SIDE * BOX_EDGES).astype(np.float32)


def on_axis(axis: int, share: float, away: float) -> tuple[float, float, float]:
    """A point `away` [m] off the edge that carries an axis, at a share of its length."""
    at, outwards = _EDGES[axis]
    point = SIDE * at + away * outwards / np.linalg.norm(outwards)
    point[axis] = share * SIDE
    return float(point[0]), float(point[1]), float(point[2])


def draw_frame(scene: viser.SceneApi, root: str, edges: Array) -> None:
    """Make the nodes under `root` for a volume's edges (3, 2) [rad]."""
    scene.add_frame(root, show_axes=False)
    for name, lines, color, width in (
        ("walls", wall_lines(edges), palette.REACH_MAX, 1.0),
        ("box", box_lines(), palette.SECONDARY, 1.8),
    ):
        scene.add_line_segments(
            f"{root}/{name}", lines, palette.line(color), thickness=width, thickness_units="screen"
        )
    for axis, joint in enumerate(AXES):
        for degrees in ticks(edges[axis]):
            share = float(place(np.full(3, np.deg2rad(degrees)), edges)[axis] / SIDE)
            scene.add_label(
                f"{root}/{joint}/{degrees}",
                f"{degrees}",
                position=on_axis(axis, share, 0.26),
                font_screen_scale=1.0,
                anchor="center-center",
            )
        scene.add_label(
            f"{root}/{joint}/name",
            f"{joint} °",
            position=on_axis(axis, 0.5, 1.05),
            font_screen_scale=1.4,
            anchor="center-center",
        )
