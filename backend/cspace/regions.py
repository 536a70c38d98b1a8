"""Connected regions of free configurations in a joint image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from backend.spatial.types import AnyArray, Array, BoolArray, IntArray


@dataclass(frozen=True)
class Regions:
    """Free cells that are connected by moving one joint at a time.

    labels: (swing, boom, stick, bucket) int32, 0 where not free, else 1.. in descending size;
    sizes: (k,) cells; present: label of the cell asked for, 0 when that cell is not free;
    free: share of all cells that are free; share: of all cells, in the present region.
    """

    labels: AnyArray
    sizes: IntArray
    present: int
    free: float
    share: float

    @property
    def cut_off(self) -> IntArray:
        """(k,) labels of the free regions that cannot be reached from the present one."""
        every = np.arange(1, len(self.sizes) + 1)
        return np.asarray(every[every != self.present])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _run_labels(free: BoolArray, wraps: bool, parent: IntArray, labels: AnyArray) -> int:
    """Label runs of free cells along the last axis and join the runs that touch (union-find).

    free, labels: (n0, n1, n2, n3); labels holds run numbers 1.. afterwards, parent their trees.
    """
    n0, n1, n2, n3 = free.shape
    runs = 0
    for a in range(n0):
        for b in range(n1):
            for c in range(n2):
                inside = False
                for d in range(n3):
                    if not free[a, b, c, d]:
                        inside = False
                        continue
                    if not inside:
                        inside = True
                        runs += 1
                        parent[runs] = runs
                    labels[a, b, c, d] = runs
                for axis in range(4):
                    e, f, g = a, b, c
                    if axis == 0:
                        e = a - 1
                    elif axis == 1:
                        f = b - 1
                    elif axis == 2:
                        g = c - 1
                    else:  # the last swing's neighbour beyond the seam
                        if not wraps or n0 < 3 or a != n0 - 1:
                            continue
                        e = 0
                    if e < 0 or f < 0 or g < 0:
                        continue
                    last = 0
                    for d in range(n3):
                        mine, other = labels[a, b, c, d], labels[e, f, g, d]
                        if mine == 0 or other == 0:
                            last = 0
                        elif last == 0:
                            last = 1
                            _join(parent, mine, other)
    return runs


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _root(parent: IntArray, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _join(parent: IntArray, i: int, j: int) -> None:
    i, j = _root(parent, i), _root(parent, j)
    if i < j:
        parent[j] = i
    elif j < i:
        parent[i] = j


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _relabel(labels: AnyArray, table: AnyArray) -> None:
    flat = labels.reshape(-1)
    for i in range(len(flat)):
        flat[i] = table[flat[i]]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _count_runs(free: BoolArray) -> int:
    flat = free.reshape(-1, free.shape[3])
    count = 0
    for r in range(flat.shape[0]):
        before = False
        for d in range(flat.shape[1]):
            count += flat[r, d] and not before
            before = flat[r, d]
    return count


def regions(free: BoolArray, present: tuple[int, ...], wraps: bool) -> Regions:
    """The connected free regions of an image.

    free: (swing, boom, stick, bucket), for a certified answer the certified-free cells; present:
    the cell of the present configuration; wraps: whether the swing's last cell is beside its first.
    """
    free = np.ascontiguousarray(free)
    labels = np.zeros(free.shape, dtype=np.int32)
    parent = np.zeros(_count_runs(free) + 1, dtype=np.int64)
    runs = _run_labels(free, wraps, parent, labels)
    roots = _all_roots(parent, runs)
    cells = np.bincount(labels.ravel(), minlength=runs + 1)
    cells[0] = 0
    per_root = np.bincount(roots, weights=cells, minlength=runs + 1).astype(np.int64)
    order = np.argsort(-per_root, kind="stable")
    order = order[per_root[order] > 0]
    rank = np.zeros(runs + 1, dtype=np.int32)
    rank[order] = np.arange(1, len(order) + 1)
    _relabel(labels, rank[roots])
    here = int(labels[present])
    sizes = per_root[order]
    total = float(free.size)
    share = float(sizes[here - 1]) / total if here else 0.0
    return Regions(labels, sizes, here, float(cells.sum()) / total, share)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _all_roots(parent: IntArray, runs: int) -> IntArray:
    out = np.zeros(runs + 1, np.int64)
    for i in range(1, runs + 1):
        out[i] = _root(parent, i)
    return out


def cell_of(lower: Array, steps: Array, shape: tuple[int, ...], q: Array) -> tuple[int, ...]:
    """The cell that holds joint values q (n,); values beyond the grid go to its outermost cells.

    lower: (n,) the grid's edges [rad]; steps: (n,) cell widths, 0 where a joint is held [rad].
    """
    width = np.where(steps > 0.0, steps, 1.0)
    index = np.floor((np.asarray(q, dtype=float) - lower) / width).astype(int)
    return tuple(int(v) for v in np.clip(index, 0, np.array(shape) - 1))
