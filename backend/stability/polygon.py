"""Where a machine stands on the ground: its support polygon, in the root frame's z = 0 plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.spatial.types import Array

_SMALLEST = 1e-3  # shortest edge, and half of the least width, of a polygon [m]


@dataclass(frozen=True)
class Polygon:
    """Convex and counter-clockwise. vertices: (k, 2) [m]; edge i leads from vertex i to i + 1;
    names: (k,) of the edges, where they have any ("front").
    """

    vertices: Array
    names: tuple[str, ...]

    @cached_property
    def normals(self) -> Array:
        """(k, 2) unit, inwards, of the edges."""
        along = np.roll(self.vertices, -1, axis=0) - self.vertices
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        return np.stack([-along[:, 1], along[:, 0]], axis=1)

    @cached_property
    def centre(self) -> Array:
        """(2,) of its area [m]."""
        a, b = self.vertices, np.roll(self.vertices, -1, axis=0)
        twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        return np.asarray(((a + b) * twice[:, None]).sum(axis=0) / (3.0 * twice.sum()))

    @cached_property
    def inradii(self) -> Array:
        """(k,) of each edge from the centre [m]: what a share of 1 is measured by."""
        return np.asarray(((self.centre - self.vertices) * self.normals).sum(axis=1))


def support_polygon(machine: Machine) -> Polygon:
    """A rectangle: as long as the tracks, as wide as both with their shoes.

    On rails (track bodies that are wheels) it is the same of the sidecar's rail table: wheelbase
    over all, gauge and tread. The sidecar's length is over all: on hard ground a track whose ends
    rise bears on less, and an own polygon says so.
    """
    tracks = machine.tracks
    x, y = 0.5 * tracks.length, 0.5 * (tracks.gauge + tracks.shoe)
    corners = np.array([[x, -y], [x, y], [-x, y], [-x, -y]])
    return Polygon(corners, ("front", "left", "rear", "right"))


def polygon(points: Array, names: tuple[str, ...] | None = None) -> Polygon:
    """The polygon with these corners (k, 2) [m], given in order either way round.

    Raises InputError unless they are three or more, finite, and make a convex polygon with an area.
    """
    try:
        corners = np.array(points, dtype=float)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.ndim != 2 or corners.shape[1:] != (2,) or len(corners) < 3:
        raise InputError("support polygon: three or more corners (x, y) in metres are needed.")
    if not np.isfinite(corners).all():
        raise InputError("support polygon: its corners must be finite numbers, in metres.")
    if names is not None and len(names) != len(corners):
        raise InputError(f"support polygon: {len(corners)} edges, but {len(names)} names.")
    following = np.roll(corners, -1, axis=0)
    if (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum() < 0.0:
        corners = corners[::-1].copy()
        # Edge i now leads from what was vertex k-1-i to k-2-i.
        names = None if names is None else (*names[-2::-1], names[-1])
    lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    if lengths.min() < _SMALLEST:
        raise InputError("support polygon: two neighbouring corners lie within 1 mm of each other.")
    made = Polygon(corners, names or tuple(f"edge {i + 1}" for i in range(len(corners))))
    inside = ((corners[None] - corners[:, None]) @ made.normals[:, :, None])[..., 0]
    narrow = inside.max(axis=1).min() < 2.0 * _SMALLEST
    if narrow or inside.min() < -1e-9 * lengths.max():
        raise InputError("support polygon: its corners must make a convex polygon with an area.")
    return made


def shrunk(whole: Polygon, share: float) -> Polygon:
    """The polygon that lies inside by `share` (0 to below 1) of the way to its centre."""
    if not 0.0 <= share < 1.0:
        raise InputError(f"share = {share}: from 0 to below 1 is allowed.")
    return Polygon(whole.centre + (1.0 - share) * (whole.vertices - whole.centre), whole.names)
