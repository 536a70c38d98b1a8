"""Bodies turned about an axis, as solids of revolution between two radii at every height.

A body that turns all the way round covers, at height z along the axis, every radius between the
nearest and the farthest point of its slice. Both are convex in z between the heights of a box's
corners (a maximum of norms of linear functions; the distance from the axis to a convex set), so a
chord bounds the outer one from above, and a chord lowered by twice its error in the middle bounds
the inner one from below. Radii are never too small outside nor too large inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from backend.spatial.boxes import CORNER_SIGNS, Boxes
from backend.spatial.types import Array, IntArray, frozen

EDGES: IntArray = np.array(
    [(i, j) for i in range(8) for j in (i ^ 1, i ^ 2, i ^ 4) if i < j], dtype=np.int64
)
"""The 12 edges of a box by the indices of its corners (CORNER_SIGNS counts in binary)."""

_THIN = 1e-5
"""Flat boxes get this half thickness [m]: a region without area would vanish from a union."""
_SPLITS = 24

Radii: TypeAlias = Callable[[IntArray, Array], tuple[Array, Array]]
"""(bands, heights) -> inner and outer radius [m]."""


@dataclass(frozen=True)
class Revolved:
    """Solids of revolution about the z axis of a frame, as runs stored one after the other.

    Run k has the heights z[start[k]:start[k+1]] [m], ascending; between them the radii are linear.
    outer: concave in z within a run [m]; inner: 0 or less where the solid reaches the axis [m].
    """

    z: Array
    inner: Array
    outer: Array
    start: IntArray

    def __post_init__(self) -> None:
        n = len(np.asarray(self.z))
        for name in ("z", "inner", "outer"):
            object.__setattr__(self, name, frozen(getattr(self, name), (n,), name))
        start = np.array(self.start, dtype=np.int64)
        start.setflags(write=False)
        object.__setattr__(self, "start", start)
        if start[0] != 0 or start[-1] != n or (np.diff(start) < 2).any():
            raise ValueError("start must lead from 0 to the number of heights, two or more a run")

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def radius(self) -> float:
        """The largest outer radius [m]."""
        return float(self.outer.max(initial=0.0))


def joined(parts: list[Revolved]) -> Revolved:
    """All runs of several solids about the same axis."""
    parts = [p for p in parts if len(p)]
    ends = np.cumsum([0, *(n for p in parts for n in np.diff(p.start))])
    z, inner, outer = (
        np.concatenate([getattr(p, name) for p in parts] or [np.zeros(0)])
        for name in ("z", "inner", "outer")
    )
    return Revolved(z, inner, outer, ends)


def thickened(boxes: Boxes) -> Boxes:
    """The boxes with no half extent below 10 micrometres."""
    return Boxes(boxes.centers, boxes.rotations, np.maximum(boxes.half_extents, _THIN))


def revolve(boxes: Boxes, tolerance: float) -> Revolved:
    """The boxes turned all the way about the z axis of their frame.

    Contains the true solid; the radii are at most `tolerance` [m] beyond it.
    """
    boxes = thickened(boxes)
    corners = boxes.corners()
    heights = np.sort(corners[..., 2], axis=1)
    box = np.repeat(np.arange(len(boxes)), 7)
    low, high = heights[:, :-1].ravel(), heights[:, 1:].ravel()
    real = high - low > 1e-9
    # A step of less than a nanometre is bridged by its neighbours: stretch to close the gap.
    box, low, high = box[real], low[real], high[real]

    def radii(index: IntArray, z: Array) -> tuple[Array, Array]:
        return slice_radii(boxes, corners, box[index], z)

    pieces = subdivide(low, high, radii, 0.5 * tolerance)
    which = box[pieces.index]
    runs = []
    for k in range(len(boxes)):
        mine = np.flatnonzero(which == k)
        mine = mine[np.argsort(pieces.low[mine], kind="stable")]
        runs.append(
            make_runs(
                pieces.low[mine],
                pieces.high[mine],
                pieces.inner[mine],
                pieces.outer[mine],
                0.5 * tolerance,
            )
        )
    return joined(runs)


@dataclass(frozen=True)
class Bands:
    """Bands low..high (n,) [m] of the band index[k]; inner, outer: (n, 2) radii at both ends."""

    index: IntArray
    low: Array
    high: Array
    inner: Array
    outer: Array


def subdivide(low: Array, high: Array, radii: Radii, tolerance: float) -> Bands:
    """Bands halved until linear radii are within `tolerance` of the true ones.

    low, high: (n,) [m]; radii(index, z) -> (inner, outer) at heights z of bands `index`, both
    convex in z within a band.
    """
    index = np.arange(len(low))
    done: list[tuple[Array, ...]] = []
    for split in range(_SPLITS):
        ends = [radii(index, low), radii(index, high)]
        middle = 0.5 * (low + high)
        inner_mid, outer_mid = radii(index, middle)
        inner = np.stack([ends[0][0], ends[1][0]], axis=1)
        outer = np.stack([ends[0][1], ends[1][1]], axis=1)
        # For a convex function the chord's error is concave, 0 at both ends: at most twice its
        # value in the middle.
        sag_in = 2.0 * np.maximum(inner.mean(axis=1) - inner_mid, 0.0)
        sag_out = 2.0 * np.maximum(outer.mean(axis=1) - outer_mid, 0.0)
        fine = np.maximum(sag_in, sag_out) <= tolerance
        if split == _SPLITS - 1:
            fine[:] = True
        lowered = inner - sag_in[:, None]
        done.append((index[fine], low[fine], high[fine], lowered[fine], outer[fine]))
        rest = ~fine
        if not rest.any():
            break
        index = np.tile(index[rest], 2)
        low, high = (
            np.concatenate([low[rest], middle[rest]]),
            np.concatenate([middle[rest], high[rest]]),
        )
    index, low, high, inner, outer = (np.concatenate(c) for c in zip(*done, strict=True))
    return Bands(index.astype(np.int64), low, high, inner, outer)


def make_runs(low: Array, high: Array, inner: Array, outer: Array, tolerance: float) -> Revolved:
    """Stacked bands (n,) with radii (n, 2) at their ends, as runs of concave outer radius.

    Bands must follow each other in height. Where the concave hull of the outer radii would exceed
    them by more than `tolerance` [m], a new run begins.
    """
    n = len(low)
    if n == 0:
        return Revolved(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(1, np.int64))
    z = np.append(low, high[-1])
    least = np.minimum(np.append(inner[:, 0], np.inf), np.append(np.inf, inner[:, 1]))
    most = np.maximum(np.append(outer[:, 0], -np.inf), np.append(-np.inf, outer[:, 1]))
    zs, ins, outs, ends = [], [], [], [0]
    i = 0
    while i < n:
        # The error only grows with the length of the run: double it, then bisect.
        fits, fails = i + 1, n + 1
        step = 1
        while fits < n and fails > fits + 1:
            j = min(fits + step, n) if fails > n else (fits + fails) // 2
            span = slice(i, j + 1)
            if (_concave(z[span], most[span]) - most[span]).max() <= 0.5 * tolerance:
                fits, step = j, 2 * step
            else:
                fails = j
        span = slice(i, fits + 1)
        run = _thinned(z[span], least[span], _concave(z[span], most[span]), 0.5 * tolerance)
        zs.append(run[0])
        ins.append(run[1])
        outs.append(run[2])
        ends.append(ends[-1] + len(run[0]))
        i = fits
    z, inner, outer = (np.concatenate(v) for v in (zs, ins, outs))
    return Revolved(z, inner, outer, np.array(ends, dtype=np.int64))


def _thinned(z: Array, inner: Array, outer: Array, tolerance: float) -> tuple[Array, Array, Array]:
    """Fewer heights for a run: radii moved outward and inward by at most `tolerance` [m]."""
    keep = {0, len(z) - 1}
    stack = [(0, len(z) - 1)]
    while stack:
        i, j = stack.pop()
        if j < i + 2:
            continue
        s = (z[i : j + 1] - z[i]) / (z[j] - z[i])
        error = np.maximum(
            np.abs(outer[i : j + 1] - outer[i] - s * (outer[j] - outer[i])),
            np.where(
                inner[i : j + 1].max() > 0.0,
                np.abs(inner[i : j + 1] - inner[i] - s * (inner[j] - inner[i])),
                0.0,
            ),
        )
        k = int(np.argmax(error))
        if error[k] > tolerance:
            keep.add(i + k)
            stack += [(i, i + k), (i + k, j)]
    chosen = np.array(sorted(keep))
    low = np.interp(z, z[chosen], inner[chosen])
    high = np.interp(z, z[chosen], outer[chosen])
    lift = float(np.maximum(outer - high, 0.0).max())
    drop = float(np.maximum(low - inner, 0.0).max())
    return z[chosen], inner[chosen] - drop, outer[chosen] + lift


def _concave(z: Array, r: Array) -> Array:
    """The least concave function above the points, at their heights."""
    kept: list[int] = []
    for k in range(len(z)):
        while len(kept) > 1:
            p, q = kept[-2], kept[-1]
            if (r[q] - r[p]) * (z[k] - z[p]) > (r[k] - r[p]) * (z[q] - z[p]):
                break
            kept.pop()
        kept.append(k)
    return np.asarray(np.interp(z, z[kept], r[kept]))


def slice_radii(boxes: Boxes, corners: Array, box: IntArray, z: Array) -> tuple[Array, Array]:
    """Nearest and farthest distance (k,) [m] from the z axis of box[k]'s slice at height z[k].

    corners: (n, 8, 3) of the boxes.
    """
    p, q = corners[box][:, EDGES[:, 0]], corners[box][:, EDGES[:, 1]]
    rise = q[..., 2] - p[..., 2]
    steep = np.abs(rise) > 1e-12
    s = (z[:, None] - p[..., 2]) / np.where(steep, rise, 1.0)
    cut = steep & (s >= -1e-9) & (s <= 1.0 + 1e-9)
    at = p[..., :2] + np.clip(s, 0.0, 1.0)[..., None] * (q - p)[..., :2]
    # Edges that miss the height repeat the first one that does not.
    first = np.argmax(cut, axis=1)
    at = np.where(cut[..., None], at, at[np.arange(len(z)), first][:, None])
    outer = np.linalg.norm(at, axis=2).max(axis=1)
    # Outside the slice the nearest point lies on one of its edges, all of them joining two cuts.
    a, b = at[:, _PAIRS[:, 0]], at[:, _PAIRS[:, 1]]
    d = b - a
    along = np.clip(-(a * d).sum(-1) / np.maximum((d * d).sum(-1), 1e-300), 0.0, 1.0)
    inner = np.linalg.norm(a + along[..., None] * d, axis=2).min(axis=1)
    on_axis = np.zeros((len(z), 3))
    on_axis[:, 2] = z
    local = np.einsum("kji,kj->ki", boxes.rotations[box], on_axis - boxes.centers[box])
    pierced = (np.abs(local) <= boxes.half_extents[box] + 1e-12).all(axis=1)
    return np.where(pierced, 0.0, inner), outer


_PAIRS: IntArray = np.stack(np.triu_indices(12, 1), axis=1).astype(np.int64)
assert CORNER_SIGNS[1, 2] == 1.0
