"""Exact distance between oriented boxes by enumerating their features.

The closest points of two separated convex polyhedra lie on a vertex and a face, or on two edges.
Boxes have 8 vertices and 12 edges, so all cases are tried: slower than GJK and free of its
tolerances, which is why it decides where python-fcl only proposes.
"""

from __future__ import annotations

import numpy as np

from backend.spatial.boxes import CORNER_SIGNS, Boxes
from backend.spatial.types import Array, IntArray

_EDGES: IntArray = np.array(
    [
        (i, j)
        for i in range(8)
        for j in range(i + 1, 8)
        if np.count_nonzero(CORNER_SIGNS[i] != CORNER_SIGNS[j]) == 1
    ]
)
_EDGE_A, _EDGE_B = (grid.ravel() for grid in np.meshgrid(range(12), range(12), indexing="ij"))
_PARALLEL = 1e-12


def separations(a: Boxes, b: Boxes) -> Array:
    """Largest gap of each pair along the 15 separating axes: a[k] against b[k] -> (k,) [m].

    A positive gap is a lower bound of the distance and proves separation; a negative one is minus
    the penetration depth.
    """
    R_ab = np.swapaxes(a.rotations, 1, 2) @ b.rotations
    offset = _in_frame(a, b.centers)
    axes_a = np.broadcast_to(np.eye(3), R_ab.shape)
    axes_b = np.swapaxes(R_ab, 1, 2)
    crossed = np.cross(axes_a[:, :, None, :], axes_b[:, None, :, :]).reshape(len(a), 9, 3)
    axes = np.concatenate([axes_a, axes_b, crossed], axis=1)
    norms = np.linalg.norm(axes, axis=2, keepdims=True)
    # Parallel edges give no axis of their own; the face axes already cover them.
    unit = axes / np.where(norms > 1e-9, norms, 1.0)
    reach_a = np.einsum("kij,kj->ki", np.abs(unit), a.half_extents)
    reach_b = np.einsum("kij,kj->ki", np.abs(unit @ R_ab), b.half_extents)
    gaps = np.abs(np.einsum("kij,kj->ki", unit, offset)) - reach_a - reach_b
    gaps = np.where(norms[..., 0] > 1e-9, gaps, -np.inf)
    return np.asarray(gaps.max(axis=1))


def distances(a: Boxes, b: Boxes) -> tuple[Array, Array]:
    """Distance of a[k] and b[k] with the closest points.

    Returns distance (k,) [m], negative (minus the penetration depth) on overlap, and points
    (k, 2, 3) on a and on b; on overlap both are one point near the middle of the overlap.
    """
    if len(a) != len(b):
        raise ValueError(f"pairs need equally many boxes, not {len(a)} and {len(b)}")
    if len(a) == 0:
        return np.zeros(0), np.zeros((0, 2, 3))
    corners_a, corners_b = a.corners(), b.corners()
    candidates = [
        _corners_to_box(corners_b, a)[..., ::-1, :],
        _corners_to_box(corners_a, b),
        _edges_to_edges(corners_a, corners_b),
    ]
    points = np.concatenate(candidates, axis=1)
    lengths = np.linalg.norm(points[:, :, 0] - points[:, :, 1], axis=2)
    best = np.argmin(lengths, axis=1)
    row = np.arange(len(a))
    distance, closest = lengths[row, best], points[row, best]
    gap = separations(a, b)
    overlap = gap <= 0.0
    middle = 0.5 * (a.centers + b.centers)
    inside = 0.5 * (_clamp_into(a, middle) + _clamp_into(b, middle))
    closest = np.where(overlap[:, None, None], inside[:, None, :], closest)
    return np.where(overlap, gap, distance), closest


def _in_frame(box: Boxes, points: Array) -> Array:
    """Points (k, 3) in the frames of box[k]."""
    return np.asarray(np.einsum("kji,kj->ki", box.rotations, points - box.centers))


def _clamp_into(box: Boxes, points: Array) -> Array:
    """The point of box[k] closest to points[k]: (k, 3)."""
    local = np.clip(_in_frame(box, points), -box.half_extents, box.half_extents)
    return np.asarray(box.centers + np.einsum("kij,kj->ki", box.rotations, local))


def _corners_to_box(corners: Array, box: Boxes) -> Array:
    """Each corner (k, 8, 3) and its closest point in box[k]: (k, 8, 2, 3)."""
    local = (corners - box.centers[:, None]) @ box.rotations
    half = box.half_extents[:, None]
    nearest = np.clip(local, -half, half) @ np.swapaxes(box.rotations, 1, 2) + box.centers[:, None]
    return np.stack([corners, nearest], axis=2)


def _edges_to_edges(corners_a: Array, corners_b: Array) -> Array:
    """Closest points of all 144 edge pairs: (k, 144, 2, 3)."""
    p = corners_a[:, _EDGES[_EDGE_A, 0]]
    u = corners_a[:, _EDGES[_EDGE_A, 1]] - p
    q = corners_b[:, _EDGES[_EDGE_B, 0]]
    v = corners_b[:, _EDGES[_EDGE_B, 1]] - q
    w = p - q
    uu, vv, uv = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    uu, vv = np.maximum(uu, 1e-300), np.maximum(vv, 1e-300)
    det = uu * vv - uv * uv
    skew = det > _PARALLEL * uu * vv
    # Closest points of two segments: solve for s, clamp, solve for t, clamp, correct s.
    s = np.where(skew, (uv * vw - vv * uw) / np.where(skew, det, 1.0), 0.0)
    s = np.clip(s, 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return np.stack([p + s[..., None] * u, q + t[..., None] * v], axis=2)
