"""Oriented boxes: the convex bodies of machines and sites."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array, BoolArray, IntArray, frozen

CORNER_SIGNS: Array = np.array(
    [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
)


@dataclass(frozen=True)
class Boxes:
    """n oriented boxes in one frame.

    centers: (n, 3) [m]; rotations: (n, 3, 3), columns are the box axes; half_extents: (n, 3) [m].
    """

    centers: Array
    rotations: Array
    half_extents: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "centers", frozen(self.centers, (None, 3), "centers"))
        n = len(self.centers)
        object.__setattr__(self, "rotations", frozen(self.rotations, (n, 3, 3), "rotations"))
        object.__setattr__(self, "half_extents", frozen(self.half_extents, (n, 3), "half_extents"))
        if (self.half_extents < 0).any():
            raise ValueError("half_extents must not be negative")

    def __len__(self) -> int:
        return len(self.centers)

    def corners(self) -> Array:
        """(n, 8, 3) [m]."""
        local = CORNER_SIGNS * self.half_extents[:, None, :]
        return np.asarray(self.centers[:, None, :] + local @ np.swapaxes(self.rotations, 1, 2))

    def take(self, index: IntArray | BoolArray) -> Boxes:
        """The boxes at `index`: indices or a mask along the first axis."""
        return known_boxes(self.centers[index], self.rotations[index], self.half_extents[index])

    def inflated(self, margin: float) -> Boxes:
        """Each box grown by `margin` [m] on every side (contains the Minkowski sum with a ball)."""
        return Boxes(self.centers, self.rotations, self.half_extents + margin)

    def moved(self, T: Array) -> Boxes:
        """The boxes in another frame. T: (4, 4) from theirs to that one."""
        if not np.isfinite(T).all():
            raise ValueError("a transform must be finite numbers")
        R = T[:3, :3]
        return known_boxes(self.centers @ R.T + T[:3, 3], R @ self.rotations, self.half_extents)


def known_boxes(centers: Array, rotations: Array, half_extents: Array) -> Boxes:
    """Boxes of arrays that belong to nobody else, or are other boxes': not checked again."""
    boxes = object.__new__(Boxes)
    for name, values in (
        ("centers", centers),
        ("rotations", rotations),
        ("half_extents", half_extents),
    ):
        values.setflags(write=False)
        object.__setattr__(boxes, name, values)
    return boxes


NO_BOXES = Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))


def concatenated(parts: Iterable[Boxes]) -> Boxes:
    """All boxes of one frame, in order; none when there are no parts."""
    all_parts = [NO_BOXES, *parts]
    return known_boxes(
        np.concatenate([p.centers for p in all_parts]),
        np.concatenate([p.rotations for p in all_parts]),
        np.concatenate([p.half_extents for p in all_parts]),
    )
