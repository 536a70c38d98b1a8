"""Plan-view outlines for drawing: what each part covers on the ground."""

from __future__ import annotations

import shapely

from backend.machine.kinematics import body_boxes
from backend.machine.model import PARTS, Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array


def part_outlines(machine: Machine, T_site_links: Array) -> dict[str, Array]:
    """Part -> convex outline (k, 2) [m] of its boxes in the site's plan.

    T_site_links: (L, 4, 4). Parts in the order of PARTS; the outline is not closed (its first
    point is not repeated).
    """
    return outlines_of(machine, body_boxes(machine, T_site_links))


def outlines_of(machine: Machine, boxes: Boxes) -> dict[str, Array]:
    """The same from the machine's placed bodies."""
    plan = boxes.corners()[..., :2]
    parts = machine.body_parts
    return {part: _hull(plan[parts == part].reshape(-1, 2)) for part in PARTS if part in parts}


def _hull(points: Array) -> Array:
    """Counter-clockwise; the two ends where boxes have no width in plan."""
    hull = shapely.convex_hull(shapely.multipoints(points))
    if isinstance(hull, shapely.Polygon):
        return shapely.get_coordinates(shapely.orient_polygons(hull))[:-1]
    return shapely.get_coordinates(hull)
