"""Few boxes that contain all boxes of a scene near a machine: enough to judge its braking by.

What is near stands for itself, what is far is taken together, as in a tree code for far masses:
nothing is left out, and what is kept clear of is never smaller than what is there.
"""

from __future__ import annotations

import numpy as np

from backend.collision import cover_kernels
from backend.collision.kinds import BOXES
from backend.collision.scene import Scene
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated

GRAIN = 0.5
"""Boxes are taken together where that is farther away than this times their common size."""


def cover(
    scene: Scene, around: Boxes, reach: float, near: float, grain: float = GRAIN
) -> tuple[Boxes, tuple[str, ...]]:
    """Boxes that contain every box of the scene within `reach` [m] of any box `around`.

    Those within `near` [m] are always as they are. The names: "site:wall", "site:wall + 3 more".
    """
    if not scene.sets or scene.sets[0].kind != BOXES:
        return NO_BOXES, ()
    one = scene.sets[0]
    held = around.centers.copy(), around.rotations.copy(), around.half_extents.copy()
    index, begin, many = cover_kernels.cover(
        one.tree.arrays, held, float(reach), float(near), grain
    )
    item, node = index[many == 0], index[many > 0]
    low, high = one.tree.lows[node], one.tree.highs[node]
    apart = Boxes(one.centers[item], one.rotations[item], one.half_extents[item])
    turns = np.tile(np.eye(3), (len(node), 1, 1))
    together = Boxes(0.5 * (low + high), turns, 0.5 * (high - low))
    names = [scene.names[k] for k in item.tolist()]
    for first, count in zip(begin[many > 0].tolist(), many[many > 0].tolist(), strict=True):
        names.append(f"{scene.names[first]} + {count - 1} more")
    return concatenated([apart, together]), tuple(names)
