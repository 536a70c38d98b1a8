"""Rotation matrices (..., 3, 3). Base attitude: R = Rz(yaw) Ry(-pitch) Rx(roll)."""

from __future__ import annotations

import numpy as np

from backend.spatial.types import Array


def rx(angle: Array | float) -> Array:
    """Rotation about x. angle: (...) [rad] -> (..., 3, 3)."""
    return _about(angle, 1, 2)


def ry(angle: Array | float) -> Array:
    """Rotation about y. angle: (...) [rad] -> (..., 3, 3)."""
    return _about(angle, 2, 0)


def rz(angle: Array | float) -> Array:
    """Rotation about z. angle: (...) [rad] -> (..., 3, 3)."""
    return _about(angle, 0, 1)


def _about(angle: Array | float, i: int, j: int) -> Array:
    a = np.asarray(angle, dtype=float)
    R = np.zeros((*a.shape, 3, 3))
    k = 3 - i - j
    c, s = np.cos(a), np.sin(a)
    R[..., k, k] = 1.0
    R[..., i, i] = c
    R[..., j, j] = c
    R[..., i, j] = -s
    R[..., j, i] = s
    return R


def from_attitude(
    yaw: Array | float, pitch: Array | float = 0.0, roll: Array | float = 0.0
) -> Array:
    """R_site_base from yaw (CCW from grid east), pitch (positive raises the front), roll [rad]."""
    return np.asarray(rz(yaw) @ ry(-np.asarray(pitch, dtype=float)) @ rx(roll))


def to_attitude(R: Array) -> tuple[Array, Array, Array]:
    """(yaw, pitch, roll) [rad] of R (..., 3, 3); undoes `from_attitude` for |pitch| < pi/2."""
    yaw = np.arctan2(R[..., 1, 0], R[..., 0, 0])
    pitch = np.arcsin(np.clip(R[..., 2, 0], -1.0, 1.0))
    roll = np.arctan2(R[..., 2, 1], R[..., 2, 2])
    return yaw, pitch, roll


def about_axis(axis: Array, angle: Array | float) -> Array:
    """Rodrigues' rotation. axis: (3,) unit vector; angle: (...) [rad] -> (..., 3, 3)."""
    a = np.asarray(angle, dtype=float)[..., None, None]
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(a) * K + (1.0 - np.cos(a)) * (K @ K))


def to_quaternion(R: Array) -> Array:
    """Unit quaternions (..., 4) in (w, x, y, z) order, w >= 0, of R (..., 3, 3)."""
    m = np.asarray(R, dtype=float)
    t = np.stack(
        [
            1.0 + m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2],
            1.0 + m[..., 0, 0] - m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] + m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] - m[..., 1, 1] + m[..., 2, 2],
        ],
        axis=-1,
    )
    yz = m[..., 2, 1], m[..., 1, 2]
    zx = m[..., 0, 2], m[..., 2, 0]
    xy = m[..., 1, 0], m[..., 0, 1]
    rows = [
        [t[..., 0], yz[0] - yz[1], zx[0] - zx[1], xy[0] - xy[1]],
        [yz[0] - yz[1], t[..., 1], xy[0] + xy[1], zx[0] + zx[1]],
        [zx[0] - zx[1], xy[0] + xy[1], t[..., 2], yz[0] + yz[1]],
        [xy[0] - xy[1], zx[0] + zx[1], yz[0] + yz[1], t[..., 3]],
    ]
    candidates = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    best = np.argmax(t, axis=-1)
    q = np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0.0, -q, q))


def from_quaternion(wxyz: Array) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), (w, x, y, z), of any length > 0."""
    q = np.asarray(wxyz, dtype=float)
    w, x, y, z = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
