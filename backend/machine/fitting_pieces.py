"""Boxes around pieces of a mesh: split into many, merge to few, trade splits for merges.

For meshes that boxes cannot cover within the tolerance: it weighs what has to stick out.

A piece is a set of points of the mesh with the box around them. The cost of a set of boxes counts
the points of their surface that lie too far from the mesh and inside no other box, so a box may
close the gap that its neighbour leaves, and a cut through a hollow part costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from backend.machine import fitting_piece_kernels as kernels
from backend.machine.fitting_field import Field
from backend.spatial.rotation import about_axis
from backend.spatial.types import Array, BoolArray, IntArray

VOLUME = 1e-6  # cost of a cubic metre: among sets that exceed the mesh alike, the smaller
KEPT = 6  # sets looked at closely in the end
_ANGLES: Array = np.radians(np.arange(0.0, 90.0, 3.0))
_NONE: IntArray = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Piece:
    """A box {p: low <= R^T p <= high} around points[members], and where it exceeds the mesh.

    far: (m, 3) points of its surface beyond the tolerance; cost: (m,) of each.
    """

    key: int
    members: IntArray
    R: Array
    low: Array
    high: Array
    far: Array
    cost: Array

    @property
    def volume(self) -> float:
        return float(np.prod(self.high - self.low))

    @property
    def total(self) -> float:
        """The cost of this box alone."""
        return float(self.cost.sum()) + VOLUME * self.volume

    def holds(self, points: Array) -> BoolArray:
        """(n,) whether points (n, 3) are in the box."""
        local = points @ self.R
        inside = (local >= self.low - 1e-9) & (local <= self.high + 1e-9)
        return np.asarray(inside.all(axis=1), dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class Search:
    """One search over fixed points (n, 3) and their distance field; tolerance [m].

    Merged and split pieces are remembered, since the same pairs come up round after round.
    """

    points: Array
    distance: Field
    tolerance: float
    keys: count[int] = field(default_factory=count)
    pairs: dict[tuple[int, int], Piece] = field(default_factory=dict)
    cuts: dict[int, list[tuple[Piece, Piece]]] = field(default_factory=dict)

    def piece(self, members: IntArray, hints: tuple[Array, ...] = ()) -> Piece:
        """The box of least cost around points[members] over likely orientations and `hints`."""
        Rs = np.array([*_orientations(self.points, members), *hints])
        lows, highs = kernels.extents(self.points, members, Rs)
        totals = [self._rough(*box) for box in zip(Rs, lows, highs, strict=True)]
        k = int(np.argmin(totals))
        return self.box(members, Rs[k], lows[k], highs[k])

    def boxed(self, members: IntArray, R: Array) -> Piece:
        """The box around points[members] with axes R."""
        low, high = kernels.extents(self.points, members, R[None])
        return self.box(members, R, low[0], high[0])

    def box(self, members: IntArray, R: Array, low: Array, high: Array) -> Piece:
        spacing = float(np.clip(np.sqrt(_area(high - low) / 1500.0), 0.03, 0.07))
        far, cost = self._beyond(R, low, high, spacing)
        return Piece(next(self.keys), members, R, low, high, far, cost)

    def _rough(self, R: Array, low: Array, high: Array) -> float:
        spacing = float(np.clip(np.sqrt(_area(high - low) / 400.0), 0.04, 0.15))
        _, cost = self._beyond(R, low, high, spacing)
        return float(cost.sum()) + VOLUME * float(np.prod(high - low))

    def _beyond(self, R: Array, low: Array, high: Array, spacing: float) -> tuple[Array, Array]:
        f = self.distance
        R = np.ascontiguousarray(R)
        far, cost = kernels.beyond(
            R, low, high, spacing, self.tolerance, f.origin, f.step, f.values
        )
        return far, cost

    def shares(self, pieces: list[Piece]) -> Array:
        """(k,) each box's share of the cost: its far points that no other box hides."""
        owner = np.repeat(np.arange(len(pieces)), [len(p.far) for p in pieces])
        far = np.concatenate([p.far for p in pieces])
        cost = np.concatenate([p.cost for p in pieces])
        seen = kernels.open_shares(*_stacked(pieces), far, cost, owner, _NONE)[:-1]
        return np.asarray(seen + VOLUME * np.array([p.volume for p in pieces]))

    def cost(self, pieces: list[Piece]) -> float:
        """What sticks out of the mesh over the whole union of boxes."""
        return float(self.shares(pieces).sum())

    def worst(self, pieces: list[Piece]) -> float:
        """The largest distance to the mesh over the union's surface [m]; 0 within tolerance."""
        largest = 0.0
        for p in pieces:
            far = p.far
            for other in pieces:
                if other is not p and len(far):
                    far = far[~other.holds(far)]
            if len(far):
                f = self.distance
                i, j, k = np.rint((far - f.origin) / f.step).astype(np.int64).T
                top = np.array(f.values.shape) - 1
                near = f.values[i.clip(0, top[0]), j.clip(0, top[1]), k.clip(0, top[2])]
                largest = max(largest, float(near.max()))
        return largest

    def splits(self, p: Piece) -> list[tuple[Piece, Piece]]:
        """Pairs that replace a piece, best first: cuts across its own axes and the frame's."""
        if p.key not in self.cuts:
            normals = [p.R[:, a] for a in range(3)]
            normals += [e for e in np.eye(3) if max(abs(float(e @ n)) for n in normals) < 0.98]
            found: list[tuple[float, int, tuple[Piece, Piece]]] = []
            for n in normals:
                d = self.points[p.members] @ n
                low, high = float(d.min()), float(d.max())
                steps = int(np.clip((high - low) / 0.08, 3, 9))
                for level in np.linspace(low, high, steps + 2)[1:-1]:
                    below = d <= level
                    if below.all() or not below.any():
                        continue
                    a = self.piece(p.members[below], (p.R,))
                    b = self.piece(p.members[~below], (p.R,))
                    found.append((self.cost([a, b]), len(found), (a, b)))
            found.sort(key=lambda item: item[:2])
            self.cuts[p.key] = [pair for _, _, pair in found]
        return self.cuts[p.key]

    def merged(self, a: Piece, b: Piece) -> Piece:
        """The box around both, remembered."""
        key = (min(a.key, b.key), max(a.key, b.key))
        if key not in self.pairs:
            self.pairs[key] = self.piece(np.concatenate([a.members, b.members]), (a.R, b.R))
        return self.pairs[key]

    def with_one_less(self, pieces: list[Piece]) -> list[Piece]:
        """The set after the merge that costs least."""
        shares, stacked = self.shares(pieces), _stacked(pieces)
        ranked: list[tuple[float, int, int]] = []
        for i in range(len(pieces)):
            for j in range(i):
                m = self.merged(pieces[i], pieces[j])
                nobody = np.full(len(m.far), len(pieces))
                seen = kernels.open_shares(*stacked, m.far, m.cost, nobody, np.array([i, j]))[-1]
                rise = float(seen) + VOLUME * m.volume - shares[i] - shares[j]
                ranked.append((rise, i, j))
        ranked.sort()
        options = []
        for _, i, j in ranked[:5]:
            rest = [p for k, p in enumerate(pieces) if k not in (i, j)]
            options.append([*rest, self.merged(pieces[i], pieces[j])])
        return min(options, key=self.cost)

    def turned(self, pieces: list[Piece]) -> list[Piece]:
        """Small rotations of single boxes that lower the cost."""
        pieces, least = list(pieces), self.cost(pieces)
        for k in range(len(pieces)):
            for degrees in (8.0, 3.0, 1.0):
                for axis in np.eye(3):
                    for sign in (-1.0, 1.0):
                        p = pieces[k]
                        R = p.R @ about_axis(axis, np.radians(sign * degrees))
                        trial = [*pieces[:k], self.boxed(p.members, R), *pieces[k + 1 :]]
                        if (value := self.cost(trial)) < least - 1e-12:
                            pieces, least = trial, value
        return pieces

    def shrunk(self, pieces: list[Piece]) -> list[Piece]:
        """Boxes that hand the points which others hold over to them, the costliest first."""
        pieces, least = list(pieces), self.cost(pieces)
        for k in np.argsort(-self.shares(pieces), kind="stable"):
            p = pieces[k]
            points = self.points[p.members]
            others = [j for j in range(len(pieces)) if j != k]
            held = np.array([pieces[j].holds(points) for j in others])
            shared = held.any(axis=0) if len(held) else np.zeros(len(points), dtype=bool)
            if not shared.any() or shared.all():
                continue
            trial = list(pieces)
            trial[k] = self.piece(p.members[~shared], (p.R,))
            value = self.cost(trial)
            if value < least - 1e-12:
                taker = np.argmax(held, axis=0)
                for row, j in enumerate(others):
                    taken = p.members[shared & (taker == row)]
                    if len(taken):
                        o = trial[j]
                        members = np.concatenate([o.members, taken])
                        trial[j] = Piece(
                            next(self.keys), members, o.R, o.low, o.high, o.far, o.cost
                        )
                pieces, least = trial, value
        return pieces

    def start(self, boxes: int, pieces: int, alone: bool) -> list[Piece]:
        """Split to `pieces`, then merge to `boxes`. alone: judge pieces without their neighbours,
        which finds the plates of a hollow part; else as a union, which finds solid blocks."""
        current = [self.piece(np.arange(len(self.points)))]
        while len(current) < pieces:
            shares = np.array([p.total for p in current]) if alone else self.shares(current)
            worst = int(np.argmax(shares))
            options = self.splits(current[worst])
            if not options:
                break
            rest = current[:worst] + current[worst + 1 :]
            if alone:
                pair = min(options, key=lambda ab: ab[0].total + ab[1].total)
            else:
                pair = min(options[:6], key=lambda ab: self.cost([*rest, *ab]))
            current = [*rest, *pair]
        while len(current) > boxes:
            current = self.with_one_less(current)
        return current

    def improved(self, pieces: list[Piece], rng: np.random.Generator, extra: int) -> list[Piece]:
        """`extra` boxes split, mostly the costly ones, and as many merges: often a better set."""
        current, limit = pieces, len(pieces)
        for _ in range(extra):
            shares = self.shares(current)
            weights = shares + 0.05 * shares.max() + 1e-15
            k = int(rng.choice(len(current), p=weights / weights.sum()))
            options = self.splits(current[k])
            if not options:
                continue
            pair = options[min(int(rng.exponential(2.0)), len(options) - 1)]
            current = [*current[:k], *current[k + 1 :], *pair]
        while len(current) > limit:
            current = self.with_one_less(current)
        return current


def search_pieces(
    points: Array,
    distance: Field,
    max_boxes: int,
    tolerance: float,
    progress: Callable[[float], None],
    rounds: int = 120,
    patience: int = 80,
) -> tuple[list[list[Piece]], bool]:
    """Sets of at most `max_boxes` pieces that cover all points, for a closer look at each.

    The cost leads the search; returned are the cheapest set, those of the least excess met on the
    way, and whether one of them kept within the tolerance, which ends the search at once. Else it
    ends after `rounds` trials, or after `patience` of them in a row without a better set.
    """
    s = Search(points, distance, tolerance)
    starts = [s.start(max_boxes, 2 * max_boxes, alone) for alone in (False, True)]
    pieces = min(starts, key=s.cost)
    least = s.cost(pieces)
    rng = np.random.default_rng(1)
    last_gain = 0
    pieces = s.turned(pieces)
    met = [(s.worst(p), -1, p) for p in (pieces, *starts)]
    for r in range(rounds):
        progress(0.2 + 0.8 * r / rounds)
        if met[-1][0] == 0.0 or r - last_gain > patience:
            break
        trial = s.improved(pieces, rng, (1, 1, 2, 1, 1, 3)[r % 6])
        value = s.cost(trial)
        if value < 1.3 * least + 1e-12:
            trial = s.turned(s.shrunk(trial)) if r % 4 == 3 else s.shrunk(trial)
            value = s.cost(trial)
        if value < 1.3 * least + 1e-12:
            met.append((s.worst(trial), r, trial))
        if value < least - 1e-12:
            pieces, least, last_gain = trial, value, r
    met.sort(key=lambda item: item[:2])
    reached = met[0][0] == 0.0
    sets = [p for _, _, p in met[:KEPT]]
    return (sets if reached else [s.turned(pieces), pieces, *sets]), reached


def _stacked(pieces: list[Piece]) -> tuple[Array, Array, Array]:
    return (
        np.array([p.R for p in pieces]),
        np.array([p.low for p in pieces]),
        np.array([p.high for p in pieces]),
    )


def _area(size: Array) -> float:
    return float(2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]))


def _orientations(points: Array, members: IntArray) -> list[Array]:
    """The frame's axes, the principal axes, and turned about each axis to the least rectangles."""
    p = points[members]
    centered = p - p.mean(axis=0)
    V = np.linalg.svd(centered.T @ centered)[0]
    found = [np.eye(3), V * np.array([1.0, 1.0, np.sign(np.linalg.det(V))])]
    some = members[:: max(1, len(members) // 1200)]
    areas = kernels.rectangles(points, some, np.cos(_ANGLES), np.sin(_ANGLES))
    for axis, row in zip(np.eye(3), areas, strict=True):
        valleys = np.flatnonzero((row <= np.roll(row, 1)) & (row <= np.roll(row, -1)))
        lowest = valleys[np.argsort(row[valleys], kind="stable")][:2]
        found += [about_axis(axis, float(_ANGLES[k])) for k in lowest]
    return found
