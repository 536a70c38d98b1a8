"""The surface of a set of cells, for the joint-space view. Pure; float32 for browsers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cockpit.views.shapes import Float32, UInt32

Bool = NDArray[np.bool_]

# Corners of the face of a unit cell towards +x, +y and +z, counter-clockwise seen from outside.
_FACES = np.array(
    [
        [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]],
        [[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]],
        [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    ],
    dtype=np.float32,
)


def exposed_faces(shown: Bool, solid: Bool) -> tuple[Float32, UInt32]:
    """Faces of the cells `shown` towards cells that are not `solid`, or out of the grid.

    shown, solid: (a, b, c), shown within solid. Vertices (4n, 3) in units of cells from the grid's
    lower corner, faces (2n, 3) facing outwards.
    """
    corners = []
    padded = np.pad(solid, 1)
    inner = (slice(1, -1),) * 3
    for axis in range(3):
        for side in (1, -1):
            beyond = np.roll(padded, -side, axis=axis)[inner]
            cells = np.argwhere(shown & ~beyond)
            face = _FACES[axis] if side == 1 else _FACES[axis][::-1] - np.eye(3)[axis]
            corners.append(cells[:, None, :] + face)
    quads = np.concatenate(corners).astype(np.float32)
    start = 4 * np.arange(len(quads), dtype=np.uint32)[:, None, None]
    faces = start + np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)
    return quads.reshape(-1, 3), faces.reshape(-1, 3)


def layer_masks(cells: NDArray[np.uint8], bits: tuple[int, ...]) -> list[Bool]:
    """One mask per bit: the first bit that a cell has. cells: see backend.cspace.cells."""
    left = np.ones(cells.shape, dtype=bool)
    masks = []
    for bit in bits:
        masks.append(left & ((cells & bit) != 0))
        left &= ~masks[-1]
    return masks
