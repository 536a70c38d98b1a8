"""What of the site a machine stands on: that is its ground, and no obstacle of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from backend.pipeline.records import Body3D, MachineState
from backend.site.named_bodies import SiteBodies
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array, BoolArray, IntArray

NEAR = 0.10
"""Its top this near to the plane of the tracks [m]."""
LEVEL = math.radians(5.0)
"""And no more turned against it than this."""


def but_ground(around: SiteBodies, state: MachineState) -> SiteBodies:
    """The site without the bodies that the machine stands on; the same object for the same ones.

    The working gauge is never stood on.
    """
    if state.body is None or not len(around.boxes):
        return around
    return _but_ground(ByIdentity(around), ByIdentity(state.body))


@lru_cache(maxsize=32)
def _but_ground(around: ByIdentity[SiteBodies], body: ByIdentity[Body3D]) -> SiteBodies:
    """Asked for more than once a cycle."""
    under = _under(around.value, body.value.link_poses[0])
    return _without(around, tuple(under)) if under else around.value


@dataclass(frozen=True)
class _Tops:
    """Of n boxes the axis that is nearest to the vertical: its number and, upwards, its unit
    vector (n, 3), with the middle of the top (n, 3) [m]; standable: (n,) of the site, no gauge.
    """

    number: IntArray
    axis: Array
    middle: Array
    standable: BoolArray


@lru_cache(maxsize=16)
def _tops(around: ByIdentity[SiteBodies]) -> _Tops:
    boxes = around.value.boxes
    steep = np.abs(boxes.rotations[:, 2])  # of each axis, its upward part
    up = steep.argmax(axis=1)
    rows = np.arange(len(up))
    axis = boxes.rotations[rows, :, up] * np.sign(boxes.rotations[rows, 2, up])[:, None]
    site = np.array([not name.startswith("gauge:") for name in around.value.names], dtype=bool)
    middle = boxes.centers + boxes.half_extents[rows, up][:, None] * axis
    return _Tops(up, axis, middle, site)


def _under(around: SiteBodies, T: Array) -> list[int]:
    """Boxes on the top of which the middle of the tracks' plane is. T: (4, 4) of the tracks."""
    tops, boxes = _tops(ByIdentity(around)), around.boxes
    height = np.abs(((T[:3, 3] - tops.middle) * tops.axis).sum(axis=1))
    level = tops.axis @ T[:3, 2] > math.cos(LEVEL)
    found = []
    for k in np.flatnonzero(level & (height < NEAR) & tops.standable).tolist():
        off = T[:3, 3] - boxes.centers[k]
        inside = np.abs(boxes.rotations[k].T @ off) <= boxes.half_extents[k]
        inside[tops.number[k]] = True
        if inside.all() and off @ T[:3, 2] > 0.0:
            found.append(k)
    return found


@lru_cache(maxsize=64)
def _without(around: ByIdentity[SiteBodies], under: tuple[int, ...]) -> SiteBodies:
    site = around.value
    kept = np.ones(len(site.names), dtype=bool)
    kept[list(under)] = False
    names = tuple(name for name, keep in zip(site.names, kept, strict=True) if keep)
    return replace(site, boxes=site.boxes.take(kept), names=names)
