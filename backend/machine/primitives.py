"""Boxes and cylinders as triangles, faces outward."""

from __future__ import annotations

import numpy as np

from backend.spatial.types import AnyArray, Array

SECTIONS = 24  # of a cylinder's circumference
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""Corners of each side, counter-clockwise from outside; corner k is at the bits of k, x first."""


def box(x: float, y: float, z: float) -> tuple[Array, AnyArray]:
    """Vertices (8, 3) [m] and faces (12, 3) of a box of these lengths about the origin."""
    corners = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)], dtype=float)
    faces = [corner for a, b, c, d in _SIDES for corner in ((a, b, c), (a, c, d))]
    return (corners - 0.5) * np.array([x, y, z]), np.array(faces, dtype=np.int64)


def cylinder(radius: float, height: float) -> tuple[Array, AnyArray]:
    """Vertices (n, 3) [m] and faces (m, 3) of a cylinder about z, its middle at the origin."""
    angles = np.linspace(0.0, 2.0 * np.pi, SECTIONS, endpoint=False)
    rim = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    rings = [np.column_stack([rim, np.full(SECTIONS, z)]) for z in (-height / 2.0, height / 2.0)]
    poles = np.array([[0.0, 0.0, -height / 2.0], [0.0, 0.0, height / 2.0]])
    a = np.arange(SECTIONS)
    b = (a + 1) % SECTIONS
    below, above = np.full(SECTIONS, 2 * SECTIONS), np.full(SECTIONS, 2 * SECTIONS + 1)
    a_up, b_up = a + SECTIONS, b + SECTIONS
    kinds = [(a, b, b_up), (a, b_up, a_up), (below, b, a), (above, a_up, b_up)]
    faces = np.concatenate([np.column_stack(kind) for kind in kinds])
    return np.concatenate([*rings, poles]), faces.astype(np.int64)
