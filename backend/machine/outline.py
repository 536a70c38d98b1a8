"""Plan-view outlines for drawing: what each part covers on the ground."""

from __future__ import annotations

import numpy as np

from backend.machine.kinematics import body_boxes
from backend.machine.model import PARTS, Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array


def part_outlines(machine: Machine, T_site_links: Array) -> dict[str, Array]:
    """Part -> convex outline (k, 2) [m] of its boxes in the site's plan, counter-clockwise.

    T_site_links: (L, 4, 4). Parts in the order of PARTS; the outline is not closed (its first
    point is not repeated).
    """
    return outlines_of(machine, body_boxes(machine, T_site_links))


def outlines_of(machine: Machine, boxes: Boxes) -> dict[str, Array]:
    """The same from the machine's placed bodies."""
    from backend.machine.outline_kernel import convex_hull

    plan = boxes.corners()[..., :2]
    parts = machine.body_parts
    outlines = {}
    for part in PARTS:
        points = plan[parts == part].reshape(-1, 2)
        if len(points):
            outlines[part] = convex_hull(points, np.lexsort((points[:, 1], points[:, 0])))
    return outlines
