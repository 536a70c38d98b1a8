"""Boxes moved a little at a time so that the one that sticks out most does so less.

Where points are inside and where sides stick out is linear in small motions of the boxes; so a
linear program finds the best small motion of all boxes at once, and so on while it helps
(sequential linear programming with a trust region: Griffith and Stewart 1961).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.optimize import linprog
from scipy.sparse import coo_array

from backend.machine.fitting_field import Field, box_surface
from backend.spatial.rotation import about_axis
from backend.spatial.types import Array, IntArray

_PER_BOX = 9  # unknowns: shift (3), turn (3), half extents (3)
_OUTSIDE = 3.0  # price of a metre by which points stay outside, against one of sticking out
_EACH = 0.02  # price of a metre by which each single box sticks out
_THIN, _THIN_POINTS = 0.07, 0.08  # [m] of constraints closer together only the tightest is kept
_STEP, _LONGEST, _SHORTEST = 0.03, 0.06, 4e-4  # [m] trust region: first, most, least


@dataclass(frozen=True)
class Set:
    """Boxes {c + R q: |q| <= h}: R (k, 3, 3), c (k, 3), h (k, 3) [m]."""

    R: Array
    c: Array
    h: Array

    def away(self, points: Array) -> Array:
        """(k, n) how far points (n, 3) are outside of each box across its nearest side, < 0 in."""
        q = np.einsum("kji,knj->kni", self.R, points[None] - self.c[:, None])
        return np.asarray((np.abs(q) - self.h[:, None]).max(axis=2))

    def surface(self, spacing: float) -> tuple[Array, Array, IntArray]:
        """Points of all sides, at most `spacing` [m] apart: in their box (n, 3), in the common
        frame (n, 3), and whose they are (n,)."""
        local = [box_surface(-h, h, spacing) for h in self.h]
        owner = np.repeat(np.arange(len(self.h)), [len(q) for q in local])
        q = np.concatenate(local)
        return q, self.c[owner] + np.einsum("nij,nj->ni", self.R[owner], q), owner


def polished(
    boxes: Set, points: Array, room: Field, wanted: float, rounds: int, spacing: float = 0.03
) -> Set:
    """The boxes after at most `rounds` steps, ended early where none helps or `wanted` is reached.

    points: (n, 3) to be inside; room: the field of `fitting_field.room` at `wanted` [m].
    """
    reach, value = _STEP, _judged(boxes, points, room, wanted, spacing)
    for _ in range(rounds):
        if reach < _SHORTEST or value[1] <= wanted + 2e-4:
            break
        moved = _moved(boxes, points, room, wanted, reach, spacing)
        new = None if moved is None else _judged(moved, points, room, wanted, spacing)
        if moved is not None and new is not None and new[0] < value[0] - 1e-5:
            boxes, value, reach = moved, new, min(1.3 * reach, _LONGEST)
        else:
            reach /= 2.0
    return boxes


def _judged(
    boxes: Set, points: Array, room: Field, wanted: float, spacing: float
) -> tuple[float, float]:
    """(what the steps lower, how far points are outside plus how far boxes stick out [m])."""
    left = max(0.0, float(boxes.away(points).min(axis=0).max()))
    _, at, owner = boxes.surface(spacing)
    each = np.full(len(boxes.h), wanted)
    np.maximum.at(each, owner, _values(room, at))
    most = float(each.max())
    return most + _OUTSIDE / 2.0 * left + _EACH * float(each.sum()), most + left


def _values(room: Field, points: Array) -> Array:
    index = (points - room.origin).T / room.step
    return np.asarray(map_coordinates(room.values, index, order=1, mode="nearest"))


class _Rows:
    """Rows of the linear program: sums of coefficient * unknown <= bound."""

    def __init__(self) -> None:
        self.entries: list[tuple[IntArray, IntArray, Array]] = []
        self.bounds: list[Array] = []
        self.count = 0

    def add(self, bound: Array, *terms: tuple[IntArray, Array]) -> None:
        """n rows; each term is n unknowns and their n coefficients."""
        rows = self.count + np.arange(len(bound))
        self.entries += [(rows, unknowns, factors) for unknowns, factors in terms]
        self.bounds.append(bound)
        self.count += len(bound)

    def matrix(self, unknowns: int) -> Any:  # scipy's stubs know no sparse A_ub
        rows, columns, factors = (
            np.concatenate(parts) for parts in zip(*self.entries, strict=True)
        )
        return coo_array((factors, (rows, columns)), shape=(self.count, unknowns))


def _moved(
    boxes: Set, points: Array, room: Field, wanted: float, reach: float, spacing: float
) -> Set | None:
    """The best motion by at most `reach` [m], were all of it linear; None where none is found."""
    k = len(boxes.h)
    most, left, each = _PER_BOX * k, _PER_BOX * k + 1, _PER_BOX * k + 2
    rows = _Rows()
    _inside(rows, boxes, points, reach, left)
    _near(rows, boxes, room, wanted - 3.0 * reach, spacing, each)
    numbers = np.arange(k)
    rows.add(np.zeros(k), (each + numbers, np.ones(k)), (np.full(k, most), -np.ones(k)))
    cost = np.zeros(each + k)
    cost[most], cost[left], cost[each:] = 1.0, _OUTSIDE, _EACH
    cost[:most].reshape(k, _PER_BOX)[:, 6:] = 1e-4  # among equals the smaller boxes
    low, high = np.full(each + k, -reach), np.full(each + k, reach)
    turn = reach / np.maximum(np.linalg.norm(boxes.h, axis=1), 0.2)
    for bound, sign in ((low, -1.0), (high, 1.0)):
        bound[:most].reshape(k, _PER_BOX)[:, 3:6] = sign * turn[:, None]
    low[:most].reshape(k, _PER_BOX)[:, 6:] = np.maximum(-reach, 0.005 - boxes.h)
    low[[most, left]], low[each:], high[most:] = (wanted, 0.0), wanted, 2.0
    found = linprog(
        cost,
        A_ub=rows.matrix(each + k),
        b_ub=np.concatenate(rows.bounds),
        bounds=list(zip(low, high, strict=True)),
        method="highs",
    )
    if found.x is None:
        return None
    x = found.x[:most].reshape(k, _PER_BOX)
    R = boxes.R.copy()
    for i, w in enumerate(x[:, 3:6]):
        angle = float(np.linalg.norm(w))
        if angle > 1e-12:
            R[i] = about_axis(w / angle, angle) @ R[i]
    return Set(R, boxes.c + x[:, :3], np.maximum(boxes.h + x[:, 6:], 1e-3))


def _inside(rows: _Rows, boxes: Set, points: Array, reach: float, left: int) -> None:
    """Each point stays in the box in which it is deepest, or outside by no more than `left`."""
    deepest = boxes.away(points).argmin(axis=0)
    for k, (R, c, h) in enumerate(zip(boxes.R, boxes.c, boxes.h, strict=True)):
        own = points[deepest == k]
        r = own - c
        q = r @ R
        for a in range(3):
            sign = np.where(q[:, a] >= 0.0, 1.0, -1.0)
            slack = h[a] - sign * q[:, a]
            near = np.flatnonzero(slack < 2.5 * reach + 0.005)
            if not len(near):
                continue
            near = near[_tightest(own[near], -slack[near], _THIN_POINTS)]
            # q = R^T (p - c), so dq = -R^T dc - (r x axis) . turn
            s, n = sign[near], len(near)
            by_turn = np.cross(r[near], R[:, a])
            terms = [(np.full(n, _PER_BOX * k + b), -s * R[b, a]) for b in range(3)]
            terms += [(np.full(n, _PER_BOX * k + 3 + b), -s * by_turn[:, b]) for b in range(3)]
            terms += [(np.full(n, _PER_BOX * k + 6 + a), -np.ones(n))]
            rows.add(slack[near], *terms, (np.full(n, left), -np.ones(n)))


def _near(rows: _Rows, boxes: Set, room: Field, above: float, spacing: float, each: int) -> None:
    """Each point of a side keeps within what its box may stick out."""
    q, at, owner = boxes.surface(spacing)
    value = _values(room, at)
    some = np.flatnonzero(value > above)
    if not len(some):
        return
    some = some[_tightest(at[some], value[some], _THIN, owner[some])]
    q, at, owner, value = q[some], at[some], owner[some], value[some]
    steps = room.step * np.eye(3)
    slope = np.stack([_values(room, at + e) - _values(room, at - e) for e in steps], axis=1)
    slope /= 2.0 * room.step
    by_turn = np.cross(at - boxes.c[owner], slope)
    by_size = np.einsum("nij,ni->nj", boxes.R[owner], slope) * q / boxes.h[owner]
    terms = [
        (_PER_BOX * owner + offset + b, factors[:, b])
        for offset, factors in ((0, slope), (3, by_turn), (6, by_size))
        for b in range(3)
    ]
    rows.add(-value, *terms, (each + owner, -np.ones(len(some))))


def _tightest(points: Array, value: Array, cell: float, group: IntArray | None = None) -> IntArray:
    """Of each group in each cube of edge `cell` [m] the index of the point of largest value."""
    index = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    size = index.max(axis=0) + 1
    key = (index[:, 0] * size[1] + index[:, 1]) * size[2] + index[:, 2]
    if group is not None:
        key = key * (int(group.max()) + 1) + group
    order = np.lexsort((-value, key))
    return order[np.flatnonzero(np.diff(key[order], prepend=-1))]
