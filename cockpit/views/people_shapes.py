"""Lines and triangles for people and objects: pure, in the site frame [m]."""

from __future__ import annotations

import numpy as np

from backend.safety.swing_risk import Risk
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.tracking.records import Status
from cockpit.views.shapes import BOX_EDGES, NO_LINE, Float32, circle, polyline

MOST = 5.991
"""Squared distance within which 95 % of a normal distribution in the plane lies."""
RING = circle(32)
# Shares of an edge that are drawn: all of it, dashes, or only the corners.
STROKES: dict[Status, Array] = {
    Status.CONFIRMED: np.array([[0.0, 1.0]]),
    Status.COASTING: np.array([[0.0, 0.2], [0.4, 0.6], [0.8, 1.0]]),
    Status.TENTATIVE: np.array([[0.0, 0.2], [0.8, 1.0]]),
}
CORNERS = {Risk.WARNING: 3, Risk.EMERGENCY: 8}
LOST = np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]]], dtype=np.float32)


def box_lines(position: Array, yaw: float, size: Array, status: Status) -> Float32:
    """Edges (k, 2, 3) of an upright box. position: (3,) its middle; size: length, width, height."""
    c, s = np.cos(yaw), np.sin(yaw)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    ends = ((BOX_EDGES - 0.5) * size) @ R.T + position
    shares = STROKES[status]
    start, way = ends[:, None, :1], ends[:, None, 1:] - ends[:, None, :1]
    return (start + shares[None, :, :, None] * way).reshape(-1, 2, 3).astype(np.float32)


def upright(positions: Array, yaws: Array, sizes: Array) -> Boxes:
    """n upright boxes. positions, sizes: (n, 3); yaws: (n,) [rad]."""
    c, s = np.cos(yaws), np.sin(yaws)
    R = np.zeros((len(yaws), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1], R[:, 2, 2] = c, -s, s, c, 1.0
    return Boxes(positions, R, np.maximum(sizes, 0.0) / 2.0)


def foretold(position: Array, ahead: Array, cov: Array, z: float) -> Float32:
    """The way (1, 2, 3) to the place in a second and around it the ellipse that holds it with 95 %;
    the way alone where the covariance is not known. ahead: (2,); cov: (2, 2); z: of the ground.
    """
    way = np.array([[*position[:2], z], [*ahead, z]], dtype=np.float32)[None]
    if not np.isfinite(cov).all():
        return way
    values, vectors = np.linalg.eigh((cov + cov.T) / 2.0)
    root = vectors * np.sqrt(MOST * np.maximum(values, 0.0))
    ring = RING.astype(float)
    ring[..., :2] = RING[..., :2] @ root.T + ahead
    ring[..., 2] = z
    return np.concatenate([way, ring.astype(np.float32)])


def level_mark(position: Array, radius: float, risk: Risk, z: float) -> Float32:
    """A triangle or an octagon on the ground about somebody; nothing when safe."""
    if risk not in CORNERS:
        return NO_LINE[:0]
    n = CORNERS[risk]
    angles = np.pi / 2.0 + (np.arange(n) + (0.5 if n == 8 else 0.0)) * 2.0 * np.pi / n
    reach = radius * (1.5 if n == 3 else 1.1)
    return polyline(
        position[:2] + reach * np.column_stack([np.cos(angles), np.sin(angles)]), True, z
    )


def lost_mark(position: Array, z: float) -> Float32:
    """A dashed circle of half a metre with a cross: somebody was last seen here."""
    at = np.array([position[0], position[1], z])
    lines = np.concatenate([0.5 * circle(32, dashed=True), 0.2 * LOST])
    return (lines + at).astype(np.float32)


def sensor_mark(position: Array, size: float = 0.15) -> Float32:
    """Edges (12, 2, 3) of an octahedron at a LiDAR."""
    tips = np.concatenate([np.eye(3), -np.eye(3)]) * size + position
    pairs = [(a, b) for a in range(6) for b in range(a + 1, 6) if b != a + 3]
    return np.array([[tips[a], tips[b]] for a, b in pairs], dtype=np.float32)


def tail(points: Array, z: float) -> Float32:
    """Lines (k, 2, 3) on the ground through where somebody was. points: (n, 2)."""
    return polyline(points, False, z) if len(points) > 1 else NO_LINE[:0]
