"""What of the site a machine stands on: that is its ground, and no obstacle of its own."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from backend.pipeline.records import MachineState
from backend.site.named_bodies import SiteBodies
from backend.spatial.identity import ByIdentity
from backend.spatial.types import BoolArray

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
    under = np.flatnonzero(_under(around, state))
    if not len(under):
        return around
    return _without(ByIdentity(around), tuple(int(k) for k in under))


def _under(around: SiteBodies, state: MachineState) -> BoolArray:
    """(n,) whether the middle of the tracks' plane is on the top of a box."""
    assert state.body is not None
    T, boxes = state.body.link_poses[0], around.boxes
    steep = np.abs(boxes.rotations[:, 2])  # of each axis, its upward part
    up = steep.argmax(axis=1)
    rows = np.arange(len(up))
    axis = boxes.rotations[rows, :, up] * np.sign(boxes.rotations[rows, 2, up])[:, None]
    level = axis @ T[:3, 2] > math.cos(LEVEL)
    away = np.einsum("nij,ni->nj", boxes.rotations, T[:3, 3] - boxes.centers)
    inside = np.abs(away) <= boxes.half_extents
    inside[rows, up] = True
    height = np.abs(away[rows, up]) - boxes.half_extents[rows, up]
    over = (T[:3, 3] - boxes.centers) @ T[:3, 2] > 0.0
    site = np.array([not name.startswith("gauge:") for name in around.names], dtype=bool)
    return np.asarray(level & inside.all(axis=1) & (np.abs(height) < NEAR) & over & site)


@lru_cache(maxsize=64)
def _without(around: ByIdentity[SiteBodies], under: tuple[int, ...]) -> SiteBodies:
    site = around.value
    kept = np.ones(len(site.names), dtype=bool)
    kept[list(under)] = False
    names = tuple(name for name, keep in zip(site.names, kept, strict=True) if keep)
    return replace(site, boxes=site.boxes.take(kept), names=names)
