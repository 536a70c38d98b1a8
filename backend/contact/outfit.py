"""The bar along the bucket's edge, with which a machine holds on to the ground."""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine

EDGE = 0.022
"""Its least radius, of the length from the bucket's pivot to its edge."""


def edge_radius(machine: Machine) -> float:
    """Of the bar along the bucket's edge [m]; it lies around the end point, and is as thick as what
    of the bucket reaches below that when it stands upright.
    """
    return max(EDGE * machine.sun.lengths[3], lowest(machine, -0.5 * np.pi))


def edge_half_width(machine: Machine) -> float:
    """Half of the bucket's width [m]: of the bodies that the last of the arm's joints moves."""
    last = [k for k, link in enumerate(machine.body_links) if link == machine.end_link]
    if not last:
        return 0.1 * machine.sun.lengths[3]
    return 0.5 * float(np.ptp(machine.body_corners[last][..., 1]))


def lowest(machine: Machine, attitude: float) -> float:
    """How far the bucket's bodies reach below its edge when it stands on that, with its line from
    pivot to edge `attitude` [rad] above the horizontal [m]; 0 or less where only the edge touches.
    """
    last = [k for k, link in enumerate(machine.body_links) if link == machine.end_link]
    corners = machine.body_corners[last].reshape(-1, 3)
    # In the bucket link's frame: the direction from pivot to edge, and the joint's axis.
    axis = machine.joint_axes[3]
    out = machine.end_point - (machine.end_point @ axis) * axis
    along = out / np.linalg.norm(out)
    across = np.cross(machine.sun.signs[2] * axis, along)
    up = np.sin(attitude) * along + np.cos(attitude) * across
    heights = (corners - machine.end_point) @ up
    return float(-heights.min()) if len(heights) else 0.0
