"""How stages of detection look: colours of clusters, the ground's patch. Pure; the site frame."""

from __future__ import annotations

import colorsys

import numpy as np

from backend.perception.ground import Plane
from backend.spatial.types import AnyArray, Array, IntArray
from cockpit.views.shapes import NO_LINE, Float32

HUES = 10
"""As many clusters differ in colour; more of them share one."""
SAME = 1.0  # a cluster this near to one of the scan before keeps its colour [m]
CELL = 2.0  # of the ground's patch [m]
RAISED = 0.015  # over the ground [m]
FAR = 60.0  # from the middle, where the patch ends at the latest [m]


def cluster_colors() -> AnyArray:
    """(HUES, 3) uint8: green to violet, as red and amber are levels' colours; neighbours differ."""
    steps = np.arange(HUES) * 3 % HUES / (HUES - 1)
    found = [
        colorsys.hls_to_rgb((110.0 + 200.0 * step) / 360.0, (0.62, 0.76)[k % 2], 0.7)
        for k, step in enumerate(steps)
    ]
    return np.round(255.0 * np.array(found)).astype(np.uint8)


def hues(centers: Array, before: Array, used: IntArray) -> IntArray:
    """(k,) colours of clusters at (k, 3), each 0 to HUES - 1: what was there before keeps its own.

    before: (m, 3) of the last scan; used: (m,) their colours.
    """
    found = np.full(len(centers), -1, np.int64)
    if len(centers) and len(before):
        apart = np.linalg.norm(centers[:, None, :2] - before[None, :, :2], axis=2)
        for _ in range(min(apart.shape)):
            k, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
            if apart[k, j] > SAME:
                break
            found[k] = used[j]
            apart[k], apart[:, j] = np.inf, np.inf
    taken = np.bincount(found[found >= 0], minlength=HUES)
    for k in np.flatnonzero(found < 0):
        found[k] = int(np.argmin(taken))
        taken[found[k]] += 1
    return found


def patch(plane: Plane, points: Array) -> Float32:
    """Lines (k, 2, 3) of a grid on the plane about points (n, 3) that lie on it; none of none."""
    if not len(points):
        return NO_LINE[:0]
    middle = np.median(points[:, :2], axis=0)
    low = np.maximum(points[:, :2].min(axis=0), middle - FAR)
    high = np.minimum(points[:, :2].max(axis=0), middle + FAR)
    low, high = CELL * np.floor(low / CELL), CELL * np.ceil(high / CELL)
    x, y = (np.arange(a, b + 0.5 * CELL, CELL) for a, b in zip(low, high, strict=True))
    lines = np.zeros((len(x) + len(y), 2, 3))
    lines[: len(x), :, 0], lines[: len(x), :, 1] = x[:, None], [low[1], high[1]]
    lines[len(x) :, :, 0], lines[len(x) :, :, 1] = [low[0], high[0]], y[:, None]
    lines[..., 2] = (plane.offset - lines[..., :2] @ plane.normal[:2]) / plane.normal[2] + RAISED
    return lines.astype(np.float32)
