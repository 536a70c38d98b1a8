"""Boxes of a set chosen anew, a few at a time, so that together they leave less of a mesh out.

A few boxes near a point that is left out are taken away (large neighbourhood search: Shaw 1998),
and as many are chosen from a growing list of candidates, each within the room of boxes. A linear
program says what each uncovered point is worth; boxes that hold more worth than one box should
have join the list (column generation: Gilmore and Gomory 1961); at last an integer program
chooses.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, linprog, milp
from scipy.sparse import csr_array, eye_array, hstack, vstack

from backend.machine.anneal_kernels import UNIT
from backend.machine.column_kernels import drawn_in, worthiest
from backend.machine.fitting_field import Field
from backend.machine.polish import Set
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

EDGE = 0.002  # [m] a point so little outside is not left out: boxes grow over it in the end
_SPACING = 0.025  # [m] at which surfaces are looked at
_SMALL = 0.02  # [m] half extents of a box that begins at a point
_MOST = 4  # boxes taken away at once, at most
_ROUNDS, _TRIES = (10, 22), 8  # of the linear program, at least and at most; new boxes in each
_MOVES = 2_500  # for a new box
_RECALLED = 150  # earlier boxes that join the candidates
_NODES = 2_000  # of the integer program, at most
_HOPELESS = 1.1  # no integer program where even the linear one leaves out so many times as much

Box = tuple[Array, Array, Array]  # R (3, 3), c (3,), h (3,)


@dataclass(frozen=True, eq=False)
class Room:
    """Where boxes may be: int8 in UNITs [m] above the tolerance, at origin + index * step."""

    field: AnyArray
    origin: Array
    step: float

    @classmethod
    def of(cls, space: Field, tolerance: float) -> Room:
        """Of the field of `fitting_field.room` at `tolerance` [m]."""
        above = np.clip(np.rint((space.values - tolerance) / UNIT), -127, 127)
        return cls(above.astype(np.int8), space.origin, space.step)

    def forbid(self, points: Array, beyond: Array) -> bool:
        """Points (n, 3) that are `beyond` (n,) [m] the tolerance; whether the grid did not say so
        before."""
        size = np.array(self.field.shape)
        at = np.clip((points - self.origin) / self.step, 0.0, size - 1.0)
        low = np.clip(np.floor(at).astype(np.intp), 0, size - 2)
        corners = low[:, None] + np.array(list(np.ndindex(2, 2, 2)))
        index = tuple(np.moveaxis(corners, 2, 0))
        shares = np.prod(1.0 - np.abs(at[:, None] - corners), axis=2)
        told = (shares * self.field[index]).sum(axis=1)
        missing = np.ceil(np.maximum(beyond / UNIT - told, 0.0))
        raised = np.minimum(self.field[index] + missing[:, None], 127).astype(np.int8)
        np.maximum.at(self.field, index, raised)
        return bool(missing.any())


class Chosen:
    """Boxes that keep within the room, and which points (n, 3) [m] they leave out.

    Boxes that stick out are drawn in first.
    """

    def __init__(self, points: Array, room: Room, boxes: Set, seed: int) -> None:
        self.points, self.room = np.ascontiguousarray(points), room
        self._rng = np.random.default_rng(seed)
        self._seed = 100_000 * seed
        self._earlier: list[Box] = []
        self.boxes: list[Box] = [
            (R.copy(), c.copy(), h.copy())
            for R, c, h in zip(boxes.R, boxes.c, boxes.h, strict=True)
        ]
        self.draw_in()

    def left_out(self) -> BoolArray:
        """(n,) whether each point is outside of all boxes."""
        return _outside_all(self.points, self.boxes)

    def as_set(self) -> Set:
        """The boxes."""
        R, c, h = (np.stack(parts) for parts in zip(*self.boxes, strict=True))
        return Set(R, c, h)

    def draw_in(self) -> None:
        """Draw the boxes in where they stick out of the room, which may have become smaller."""
        worth = np.full(len(self.points), 1e-3)

        def fits(box: Box) -> bool:
            return bool(drawn_in(self.points, worth, *self._room(), *box) >= 0.0)

        self.boxes = [box if fits(box) else self._anywhere(self.points) for box in self.boxes]
        self._earlier = [box for box in self._earlier if fits(box)]

    def look_at(self, points: Array) -> None:
        """Points (m, 3) [m] that count from now on as well."""
        self.points = np.ascontiguousarray(np.concatenate([self.points, points]))

    def improve(self, times: int, report: Callable[[int], None] | None = None) -> int:
        """Choose a few boxes anew, `times` times at most; how many points stay left out.

        report: called with that number each time.
        """
        missing = np.flatnonzero(self.left_out())
        for _ in range(times):
            if not len(missing):
                break
            taken = self._near(self.points[self._rng.choice(missing)])
            kept = [box for i, box in enumerate(self.boxes) if i not in taken]
            found = self._instead([self.boxes[i] for i in taken], kept, len(missing))
            still = np.flatnonzero(_outside_all(self.points, kept + found))
            if found and len(still) <= len(missing):
                found += [self._anywhere(self.points[missing])] * (len(taken) - len(found))
                self.boxes, missing = kept + found, still
                self._earlier += found
            if report:
                report(len(missing))
        return len(missing)

    def _room(self) -> tuple[AnyArray, Array, float, float]:
        return self.room.field, self.room.origin, self.room.step, _SPACING

    def _anywhere(self, points: Array, odds: Array | None = None) -> Box:
        """A small box at one of the points (n, 3)."""
        point = points[self._rng.choice(len(points), p=odds)]
        return np.eye(3), point.copy(), np.full(3, _SMALL)

    def _near(self, point: Array) -> list[int]:
        """A few boxes near a point."""
        away = np.array(
            [np.max(np.abs((point - c) @ R) - h, initial=0.0) for R, c, h in self.boxes]
        )
        away *= self._rng.uniform(0.5, 1.5, len(away))
        away += self._rng.uniform(0.0, 0.3, len(away))
        count = int(self._rng.integers(2, _MOST + 1))
        return [int(i) for i in np.argsort(away)[:count]]

    def _instead(self, taken: list[Box], kept: list[Box], missing: int) -> list[Box]:
        """At most as many boxes as `taken` that hold most of what `kept` leave out; [] where they
        could not leave out fewer points than `missing`."""
        points = np.ascontiguousarray(self.points[_outside_all(self.points, kept)])
        boxes = [*taken, *self._recalled(points)]
        holds = [np.flatnonzero(_inside(points, box)) for box in boxes]
        out = np.inf
        for _ in range(int(self._rng.integers(*_ROUNDS))):
            out, worth, least, shares = _relaxed(holds, len(points), len(taken))
            if out < 1e-6 or not worth.any():
                break
            for box in self._priced(points, worth / max(least, 1.0), boxes, shares):
                inside = np.flatnonzero(_inside(points, box))
                if worth[inside].sum() > least + 1e-6 or self._rng.random() < 0.15:
                    boxes.append(box)
                    holds.append(inside)
        if out > _HOPELESS * missing + 0.5:
            return []
        return [boxes[i] for i in _integer(holds, len(points), len(taken))]

    def _recalled(self, points: Array) -> list[Box]:
        """Of earlier choices those that hold most of the points (n, 3)."""
        counts = np.array([np.count_nonzero(_inside(points, box)) for box in self._earlier])
        order = np.argsort(-counts, kind="stable")[:_RECALLED]
        return [self._earlier[i] for i in order if counts[i]]

    def _priced(self, points: Array, worth: Array, boxes: list[Box], shares: Array) -> list[Box]:
        """New boxes that hold much worth (n,) of the points, from known ones and from points."""
        used, odds = np.flatnonzero(shares > 1e-6), worth / worth.sum()
        starts: list[Box] = []
        for draw in self._rng.random(_TRIES):
            if draw < 0.5 and len(used):
                starts.append(boxes[int(self._rng.choice(used))])
            elif draw < 0.6:
                starts.append(boxes[int(self._rng.integers(len(boxes)))])
            else:
                starts.append(self._anywhere(points, odds))
        self._seed += _TRIES

        def search(k: int) -> tuple[float, Array, Array, Array]:
            at = *self._room(), starts[k], _MOVES, self._seed + k
            found: tuple[float, Array, Array, Array] = worthiest(points, worth, *at)
            return found

        with ThreadPoolExecutor() as threads:
            return [(R, c, h) for holds, R, c, h in threads.map(search, range(_TRIES)) if holds > 0]


def _inside(points: Array, box: Box) -> BoolArray:
    R, c, h = box
    return np.asarray((np.abs((points - c) @ R) <= h + EDGE).all(axis=1))


def _outside_all(points: Array, boxes: list[Box]) -> BoolArray:
    out = np.ones(len(points), dtype=bool)
    for box in boxes:
        out &= ~_inside(points, box)
    return out


def _relaxed(holds: list[IntArray], n: int, count: int) -> tuple[float, Array, float, Array]:
    """At most `count` boxes, also by shares, that leave out least of n points.

    holds: of each box the points it holds. Returns what is left out, what each point is worth
    (n,), what a box must hold to be of use, and the boxes' shares.
    """
    covers = _matrix(holds, n)
    one: Any = csr_array(np.concatenate([np.ones(len(holds)), np.zeros(n)])[None])
    found: Any = linprog(
        np.concatenate([np.zeros(len(holds)), np.ones(n)]),
        A_ub=vstack([hstack([-covers, -eye_array(n)]), one], format="csr"),
        b_ub=np.concatenate([-np.ones(n), [count]]),
        bounds=(0.0, None),
        method="highs",
    )
    worth = np.maximum(-np.asarray(found.ineqlin.marginals), 0.0)
    return float(found.fun), worth[:n], float(worth[n]), np.asarray(found.x[: len(holds)])


def _integer(holds: list[IntArray], n: int, count: int) -> IntArray:
    """Which at most `count` boxes leave out fewest of n points, as far as found."""
    rows, times = np.unique(_matrix(holds, n).toarray() > 0.0, axis=0, return_counts=True)
    some = rows.any(axis=1)
    covers, times = csr_array(rows[some].astype(float)), times[some]
    k, m = len(holds), len(times)
    found = milp(
        np.concatenate([np.zeros(k), times]),
        integrality=np.concatenate([np.ones(k), np.zeros(m)]),
        bounds=Bounds(0.0, 1.0),
        constraints=[
            LinearConstraint(hstack([covers, eye_array(m)], format="csr"), lb=1.0),
            LinearConstraint(np.concatenate([np.ones(k), np.zeros(m)])[None], ub=count),
        ],
        options={"node_limit": _NODES},
    )
    return np.zeros(0, np.intp) if found.x is None else np.flatnonzero(found.x[:k] > 0.5)


def _matrix(holds: list[IntArray], n: int) -> Any:  # scipy's stubs know no sparse A_ub
    """(n, boxes), 1 where a box holds a point."""
    rows = np.concatenate(holds)
    columns = np.repeat(np.arange(len(holds)), [len(rows) for rows in holds])
    return csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, len(holds)))
