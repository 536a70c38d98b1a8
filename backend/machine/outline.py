"""Plan-view outlines for drawing: what each part covers on the ground."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.machine.kinematics import body_boxes
from backend.machine.model import PARTS, Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray


def part_outlines(machine: Machine, T_site_links: Array) -> dict[str, Array]:
    """Part -> convex outline (k, 2) [m] of its boxes in the site's plan, counter-clockwise.

    T_site_links: (L, 4, 4). Parts in the order of PARTS; the outline is not closed (its first
    point is not repeated).
    """
    return outlines_of(machine, body_boxes(machine, T_site_links))


def outlines_of(machine: Machine, boxes: Boxes) -> dict[str, Array]:
    """The same from the machine's placed bodies."""
    plan = boxes.corners()[..., :2]
    parts = machine.body_parts
    outlines = {}
    for part in PARTS:
        points = plan[parts == part].reshape(-1, 2)
        if len(points):
            outlines[part] = convex_hull(points, np.lexsort((points[:, 1], points[:, 0])))
    return outlines


@njit(cache=True, nogil=True)
def convex_hull(points: Array, order: IntArray) -> Array:
    """Andrew's monotone chain: hull (k, 2) of points (n, 2), counter-clockwise.

    order: indices that sort the points by x, then y. Two points where all lie on a line.
    """
    n = len(order)
    hull = np.empty((2 * n, 2))
    k = 0
    for turn in range(2):
        first = k
        for step in range(n):
            p = points[order[step if turn == 0 else n - 1 - step]]
            while k >= first + 2:
                ax, ay = hull[k - 1, 0] - hull[k - 2, 0], hull[k - 1, 1] - hull[k - 2, 1]
                bx, by = p[0] - hull[k - 2, 0], p[1] - hull[k - 2, 1]
                if ax * by - ay * bx > 1e-12:
                    break
                k -= 1
            hull[k] = p
            k += 1
        k -= 1  # the last point begins the other chain, or closes the hull
    return hull[:k].copy()
