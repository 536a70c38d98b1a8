"""The bar along the bucket's edge, with which a machine holds on to the ground."""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine

EDGE = 0.022
"""Its radius, of the length from the bucket's pivot to its edge."""


def edge_radius(machine: Machine) -> float:
    """Of the bar along the bucket's edge [m]; it lies around the end point."""
    return EDGE * machine.sun.lengths[3]


def edge_half_width(machine: Machine) -> float:
    """Half of the bucket's width [m]: of the bodies that the last of the arm's joints moves."""
    last = [k for k, link in enumerate(machine.body_links) if link == machine.end_link]
    if not last:
        return 0.1 * machine.sun.lengths[3]
    return 0.5 * float(np.ptp(machine.body_corners[last][..., 1]))
