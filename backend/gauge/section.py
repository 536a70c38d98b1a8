"""Cross-sections of a kinematic envelope, in convex parts that may be widened."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.gauge.convex import convex_parts, polygon_of
from backend.spatial.types import Array


@dataclass(frozen=True)
class Section:
    """A convex part of a cross-section: y to the left, z up from the tops of the rails [m].

    points: (m, 2), counter-clockwise; shift: (m,) +1 or -1, where a widening moves each point in y;
    normals: (m, 2) outward, of the side from each point to the next, once widened.
    """

    points: Array
    shift: Array
    normals: Array

    def widened(self, by: Array) -> Array:
        """(k, m, 2): the part and all within `by` (k,) [m] to its left and right.

        This is its Minkowski sum with a level segment of twice that length.
        """
        points = np.repeat(self.points[None], len(by), axis=0)
        points[..., 0] += self.shift * by[:, None]
        return points

    @property
    def is_rectangle(self) -> bool:
        """Upright, so that a box along a line is its sweep."""
        return len(self.points) == 4 and bool((np.abs(self.normals) > 1.0 - 1e-12).any(1).all())


def rectangle(half_width: float, bottom: float, top: float) -> tuple[Section, ...]:
    """`half_width` to both sides of the centreline, from `bottom` to `top` [m]."""
    y = half_width
    return (_section(np.array([[-y, bottom], [y, bottom], [y, top], [-y, top]])),)


def sections(profile: Array, where: str) -> tuple[Section, ...]:
    """The convex parts of a profile polygon (k, 2). Raises InputError if it crosses itself."""
    return tuple(_section(part) for part in convex_parts(polygon_of(profile, where)))


def _section(ring: Array) -> Section:
    side = np.roll(ring, -1, axis=0) - ring
    # The outward normal of a side (a, b) is (b, -a): its first part tells left from right.
    after = np.where(np.abs(side[:, 1]) < 1e-9, 0.0, side[:, 1])
    before = np.roll(after, 1)
    points, shift = [], []
    for point, a, b in zip(ring, before, after, strict=True):
        # A lone highest or lowest point becomes a level side.
        signs = [np.sign(a), np.sign(b)] if a * b < 0.0 else [np.sign(a + b)]
        points += [point] * len(signs)
        shift += signs
    wide = np.array(points) + np.stack([shift, np.zeros(len(shift))], axis=1)
    side = np.roll(wide, -1, axis=0) - wide
    normals = np.stack([side[:, 1], -side[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Section(np.array(points), np.array(shift), normals)
