"""A manoeuvre from the side, for drawing: what each part of the machine covers over time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from backend.documents.surmount_document import SurmountDocument
from backend.machine.kinematics import body_boxes, end_point_of, link_poses
from backend.machine.model import PARTS, Machine
from backend.machine.outline_kernel import convex_hull
from backend.spatial.rotation import from_attitude, to_attitude
from backend.spatial.types import Array

MOST = 400
"""Moments that are drawn."""
MOVED = 0.05
"""A base that moves less than this [m] shows no way: then its heading does."""


def base_poses(base: Array) -> Array:
    """T_frame_root (m, 4, 4) of x, y, z, yaw, pitch, roll (m, 6) [m, rad]."""
    T = np.tile(np.eye(4), (len(base), 1, 1))
    T[:, :3, :3] = from_attitude(base[:, 3], base[:, 4], base[:, 5])
    T[:, :3, 3] = base[:, :3]
    return T


def way_across(T_frame_root: Array) -> Array:
    """(2, 3) unit vectors along the way across the edge and up, in the frame of (m, 4, 4)."""
    moved = T_frame_root[-1, :2, 3] - T_frame_root[0, :2, 3]
    if float(np.hypot(*moved)) < MOVED:
        moved = T_frame_root[0, :2, 0]
    along = moved / float(np.hypot(*moved))
    return np.array([[*along, 0.0], [0.0, 0.0, 1.0]])


def side_view(machine: Machine, document: SurmountDocument) -> dict[str, Any]:
    """What backend.documents.surmount_state.SideView describes, of a document that is ok."""
    times, q = np.array(document.time), np.array(document.joints)
    T = base_poses(np.array(document.base))
    step = max(1, math.ceil(len(times) / MOST))
    picked = np.arange(len(times))[::-step][::-1]
    axes, origin = way_across(T), T[0, :3, 3]
    poses = link_poses(machine, q[picked], T[picked])
    found = [part for part in PARTS if (machine.body_parts == part).any()]
    outlines, pivots = [], []
    arm = [k for k, joint in enumerate(machine.joints) if joint.role in ("boom", "stick", "bucket")]
    for one in poses:
        corners = (body_boxes(machine, one).corners() - origin) @ axes.T
        outlines.append([_outline(corners[machine.body_parts == part]) for part in found])
        points = [*one[machine.joint_links[arm], :3, 3], end_point_of(machine, one)]
        pivots.append(np.round((np.array(points) - origin) @ axes.T, 3).tolist())
    return {
        "time": np.round(times[picked], 3).tolist(),
        "parts": found,
        "outlines": outlines,
        "pivots": pivots,
    }


def aside(T_frame_root: Array, axes: Array, origin: Array) -> Array:
    """(m, 3) of bases (m, 4, 4): along, up [m] from origin (3,), and pitch [rad]."""
    where = (T_frame_root[:, :3, 3] - origin) @ axes.T
    _, pitch, _ = to_attitude(T_frame_root[:, :3, :3])
    return np.column_stack([where, pitch])


def _outline(corners: Array) -> list[list[float]]:
    points = corners.reshape(-1, 2)
    hull = convex_hull(points, np.lexsort((points[:, 1], points[:, 0])))
    return [[float(v) for v in point] for point in np.round(hull, 3)]
