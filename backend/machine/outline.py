"""Plan-view outlines for drawing: what each part covers on the ground."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

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
    plan = boxes.corners()[..., :2]
    parts = np.array([machine.part_of_body(b) for b in range(len(boxes))])
    return {part: _hull(plan[parts == part].reshape(-1, 2)) for part in PARTS if part in parts}


def _hull(points: Array) -> Array:
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:  # boxes without width in plan: the two ends of the line
        along = points @ np.ptp(points, axis=0)
        return points[[int(np.argmin(along)), int(np.argmax(along))]]
