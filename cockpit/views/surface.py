"""The cells of a joint volume as surfaces. Pure; float32, as they go to the browser.

A volume is uint8 (boom, stick, bucket), a byte of backend.cspace.cells for each cell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from backend.cspace.cells import COLLIDING, FREE, PARTNER, PEOPLE, SELF, SITE, TIP_OVER
from backend.spatial.types import AnyArray, Array, BoolArray
from cockpit.views.shapes import Float32, UInt32

CAUSES: Mapping[str, int] = {
    "people": PEOPLE,
    "partner": PARTNER,
    "tip-over": TIP_OVER,
    "site": SITE,
    "self": SELF,
    "other": 32,
}
"""What a cell hits, and its bits; the first that applies gives the colour."""

UNDECIDED = "undecided"
NAMES = (*CAUSES, UNDECIDED)


@dataclass(frozen=True)
class Quads:
    """Sides of cells. corners: (n, 4, 3) lattice points, counter-clockwise from outside;
    owners: (n, 3) the cells they belong to.
    """

    corners: AnyArray
    owners: AnyArray


def causes(cells: AnyArray) -> AnyArray:
    """int8 as cells: index into CAUSES of the first thing a cell hits, -1 when it hits nothing."""
    found = np.full(cells.shape, -1, dtype=np.int8)
    # A cell that is certified colliding without a cause of its own is still drawn.
    found[(cells & COLLIDING) != 0] = len(CAUSES) - 1
    for index, bits in reversed(list(enumerate(CAUSES.values()))):
        found[(cells & bits) != 0] = index
    return found


def sides(inside: BoolArray, outside: BoolArray, border: bool) -> Quads:
    """The sides of `inside` cells next to an `outside` cell; border: also those on the volume's
    own border.
    """
    corners, owners = [], []
    for axis in range(3):
        for step in (0, 1):
            cells = np.argwhere(inside & _beyond(outside, axis, step, border))
            corners.append(cells[:, None, :] + _square(axis, step))
            owners.append(cells)
    return Quads(np.concatenate(corners), np.concatenate(owners))


def _beyond(cells: BoolArray, axis: int, step: int, border: bool) -> BoolArray:
    """Value of the next cell along an axis, upwards for step 1; `border` where there is none."""
    out = np.full(cells.shape, border)
    low, high = [slice(None)] * 3, [slice(None)] * 3
    low[axis], high[axis] = slice(None, -1), slice(1, None)
    to, source = (low, high) if step else (high, low)
    out[tuple(to)] = cells[tuple(source)]
    return out


def _square(axis: int, step: int) -> AnyArray:
    """(4, 3) corners of the unit cell's side, counter-clockwise from outside."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    square = np.zeros((4, 3), dtype=np.int64)
    square[:, axis] = step
    square[[1, 2], u] = 1
    square[[2, 3], v] = 1
    return square if step else square[::-1]


def mesh(corners: AnyArray, shape: tuple[int, ...], size: Array) -> tuple[Float32, UInt32]:
    """Shared vertices (n, 3) and triangles (m, 3) of quads (q, 4, 3) on the lattice of `shape`.

    size: (3,) of the whole volume, which begins at the origin [m].
    """
    lattice = np.array(shape) + 1
    ids = np.ravel_multi_index(tuple(np.moveaxis(corners, 2, 0)), tuple(lattice))
    used = np.zeros(int(np.prod(lattice)), dtype=bool)
    used[ids] = True
    index = np.cumsum(used, dtype=np.int64) - 1
    points = np.stack(np.unravel_index(np.flatnonzero(used), tuple(lattice)), axis=1)
    faces = index[ids][:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    vertices = points * (np.asarray(size, dtype=float) / np.array(shape))
    return vertices.astype(np.float32), faces.astype(np.uint32)


def surfaces(cells: AnyArray, size: Array) -> dict[str, tuple[Float32, UInt32]]:
    """Per name of NAMES the mesh of its cells: vertices (n, 3) [m] and faces (m, 3).

    Together the meshes of CAUSES are the closed surface of all cells whose centre touches
    something: no face lies between two of them. "undecided" is the open shell of the cells around
    it, where it faces cells that are certified free. size: (3,) of the volume [m].
    """
    cause = causes(cells)
    hit = cause >= 0
    free = (cells & FREE) != 0
    found = {}
    skin = sides(hit, ~hit, border=True)
    colors = cause[tuple(skin.owners.T)]
    for index, name in enumerate(CAUSES):
        found[name] = mesh(skin.corners[colors == index], cells.shape, size)
    shell = sides(~hit & ~free, free, border=False)
    found[UNDECIDED] = mesh(shell.corners, cells.shape, size)
    return found
