"""Homogeneous transforms (..., 4, 4). `T_a_b` maps coordinates in frame b to frame a."""

from __future__ import annotations

import numpy as np

from backend.spatial.types import Array


def make(R: Array, p: Array) -> Array:
    """T (..., 4, 4) from R (..., 3, 3) and p (..., 3) [m]; leading axes broadcast."""
    R, p = np.asarray(R, dtype=float), np.asarray(p, dtype=float)
    batch = np.broadcast_shapes(R.shape[:-2], p.shape[:-1])
    T = np.zeros((*batch, 4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = p
    T[..., 3, 3] = 1.0
    return T


def inverse(T: Array) -> Array:
    """T_b_a from T_a_b, both (..., 4, 4)."""
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    return make(Rt, -(Rt @ T[..., :3, 3:])[..., 0])


def apply(T: Array, points: Array) -> Array:
    """Points (..., n, 3) in frame b mapped to frame a by T_a_b (..., 4, 4)."""
    moved = points @ np.swapaxes(T[..., :3, :3], -1, -2) + T[..., None, :3, 3]
    return np.asarray(moved)
