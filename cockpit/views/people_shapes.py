"""Lines and triangles for people and objects: pure, in the site frame [m]."""

from __future__ import annotations

from collections.abc import Sequence

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


def turned(yaws: Array) -> Array:
    """(n, 3, 3) rotations about the vertical. yaws: (n,) [rad]."""
    c, s = np.cos(yaws), np.sin(yaws)
    R = np.zeros((len(yaws), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1], R[:, 2, 2] = c, -s, s, c, 1.0
    return R


def box_lines(positions: Array, yaws: Array, sizes: Array, status: Status) -> Float32:
    """Edges (n, k, 2, 3) of n upright boxes. positions: (n, 3) of their middles; sizes: (n, 3)
    length, width, height.
    """
    local = (BOX_EDGES - 0.5).reshape(1, -1, 3) * sizes[:, None]
    ends = local @ np.swapaxes(turned(yaws), 1, 2) + positions[:, None]
    start, end = np.moveaxis(ends.reshape(len(ends), -1, 2, 3), 2, 0)
    shares = STROKES[status][None, None, :, :, None]
    lines = start[:, :, None, None] + shares * (end - start)[:, :, None, None]
    return np.asarray(lines, dtype=np.float32).reshape(len(ends), -1, 2, 3)


def upright(positions: Array, yaws: Array, sizes: Array) -> Boxes:
    """n upright boxes. positions, sizes: (n, 3); yaws: (n,) [rad]."""
    return Boxes(positions, turned(yaws), np.maximum(sizes, 0.0) / 2.0)


def foretold(positions: Array, ahead: Array, cov: Array, z: float) -> Float32:
    """Ways (n, 33, 2, 3) to the places in a second and around these the ellipses that hold them
    with 95 %; of no size where the covariance is not known. positions: (n, 3); ahead: (n, 2); cov:
    (n, 2, 2); z: of the ground.
    """
    known = np.asarray(np.isfinite(cov).all(axis=(1, 2)))[:, None, None]
    values, vectors = np.linalg.eigh(np.where(known, (cov + np.swapaxes(cov, 1, 2)) / 2.0, 0.0))
    root = vectors * np.sqrt(MOST * np.maximum(values, 0.0))[:, None]
    lines = np.full((len(ahead), 1 + len(RING), 2, 3), z, dtype=np.float32)
    lines[:, 0, 0, :2], lines[:, 0, 1, :2] = positions[:, :2], ahead
    ring = RING[..., :2].reshape(1, -1, 2) @ np.swapaxes(root, 1, 2) + ahead[:, None]
    lines[:, 1:, :, :2] = ring.reshape(len(ahead), len(RING), 2, 2)
    return lines


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
    return np.asarray(lines + at, dtype=np.float32)


def sensor_mark(position: Array, size: float = 0.15) -> Float32:
    """Edges (12, 2, 3) of an octahedron at a LiDAR."""
    tips = np.concatenate([np.eye(3), -np.eye(3)]) * size + position
    pairs = [(a, b) for a in range(6) for b in range(a + 1, 6) if b != a + 3]
    return np.array([[tips[a], tips[b]] for a, b in pairs], dtype=np.float32)


def tails(ways: Sequence[Array], z: float) -> Float32:
    """Lines (k, 2, 3) on the ground through where each was. ways: of points (n, 2)."""
    if not ways:
        return NO_LINE[:0]
    flat = np.concatenate(ways)
    own = np.repeat(np.arange(len(ways)), [len(way) for way in ways])
    lines = np.full((max(len(flat) - 1, 0), 2, 3), z, dtype=np.float32)
    lines[:, 0, :2], lines[:, 1, :2] = flat[:-1], flat[1:]
    return np.asarray(lines[own[:-1] == own[1:]])
