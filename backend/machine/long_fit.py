"""A long search for the boxes of one link, for a sidecar: annealing, then polishing, many times.

`fitting` finds good boxes in a minute or two; this looks for as long as it is told to. Every other
time it chooses some of the best known boxes anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from backend.machine.anneal_kernels import UNIT
from backend.machine.anneal_loop import anneal
from backend.machine.columns import EDGE, Chosen, Room
from backend.machine.fitting import PAD, farthest, grown, mesh_tree, outer_points, surface_points
from backend.machine.fitting_clip import extremes, outside_box, subdivided, thin
from backend.machine.fitting_field import Field, distance_field, room
from backend.machine.polish import Set, polished
from backend.machine.stated import boxes_of, left_out, tables_of
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

MOVES = 220_000  # of one annealing
_STAGES = 10  # between which points that stayed outside join those that are looked at
_HOT, _COLD = 1.2, 0.006  # temperatures: at first, at last
_PRICES = (600.0, 1500.0)  # of a cubic metre sticking out: at first, at last
_SPACINGS = (0.06, 0.04)  # [m] at which surfaces are looked at: at first, at last
_FIRST_CELL = 0.6  # [m] cubes whose outermost points are looked at first
_FINE = 0.015  # [m] size of triangles over which boxes grow in the end
_DIGITS = 2e-4  # [m] boxes are larger by, for the rounding in a sidecar
_BELOW = 0.02  # [m] aimed below the best so far where `wanted` is out of reach
_RENEWED_BELOW = 0.01  # [m] the same when choosing boxes anew; half of it is lost in closing gaps
RENEWALS = 12  # choices of a few boxes anew
_NEAR = 0.03  # [m] around the tolerance, where distances are measured
_CHECKS = 4  # looks at what points and grids do not tell, after each of which boxes change
_LOOKED_AT = 6_000  # points at most, to begin with, when choosing boxes anew


@dataclass(frozen=True, eq=False)
class Link:
    """One link's mesh in the forms that the search needs; points (n, 3) [m]."""

    triangles: Array
    points: Array
    distance: Field
    tree: cKDTree

    @classmethod
    def of(cls, triangles: Array) -> Link:
        """Of triangles (n, 3, 3) [m]."""
        field = distance_field(triangles, margin=0.35, step=0.022)
        return cls(triangles, outer_points(triangles), field, mesh_tree(triangles))


def long_fit(
    triangles: Array,
    max_boxes: int,
    wanted: float,
    starts: int,
    seed: int,
    begin: Boxes | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> tuple[Boxes, float]:
    """(boxes that contain all triangles (n, 3, 3) [m], their excess [m] as `fitting.excess`).

    At most `starts` searches, ended by the first that comes within `wanted` [m]: of the best known
    boxes a few are chosen anew, and every other time all are annealed from anywhere.
    begin: boxes to improve on; they count only if they contain the mesh. progress: called with the
    share done and the best excess so far. Centres, angles and half extents have the digits of a
    sidecar. Deterministic. Raises ValueError for an empty or non-finite set.
    """
    triangles = np.asarray(triangles, dtype=float)
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or not len(triangles):
        raise ValueError("triangles must have shape nx3x3 with n > 0")
    if not np.isfinite(triangles).all():
        raise ValueError("triangles must be finite")
    report = progress or (lambda share, least: None)
    link = Link.of(triangles)
    best, least = None, np.inf
    if begin is not None and len(begin) <= max_boxes:
        begin = boxes_of(tables_of(begin))
        if left_out(begin, triangles)[0] == 0.0:
            best, least = begin, farthest(begin, link.tree, 0.03)
    renewal: Renewal | None = None
    for start in range(starts):
        report(start / starts, least)
        if least <= wanted:
            break
        aim = max(wanted, least - _BELOW) if np.isfinite(least) else 1.2 * wanted
        if best is not None and start % 2 == 0:
            if renewal is None or renewal.ended or renewal.boxes is not best:
                aim = max(wanted, least - _RENEWED_BELOW)
                renewal = Renewal(link, best, aim, seed + start)
            boxes = renewal.improved()
        else:
            rng = np.random.default_rng(seed + start)
            boxes = annealed(link, spread(link, max_boxes, rng), aim, _HOT, seed + start)
        found, value = _closed(link, boxes, max(wanted - 0.002, aim - _BELOW))
        if value < least:
            best, least = found, value
    report(1.0, least)
    if best is None:  # no start was allowed
        return _closed(link, spread(link, 1, np.random.default_rng(seed)), wanted)
    return best, least


def spread(link: Link, count: int, rng: np.random.Generator) -> Set:
    """`count` small boxes at points of the mesh far from each other."""
    points = link.points
    chosen = [int(rng.integers(len(points)))]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(away * rng.uniform(0.7, 1.0, len(away)))))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return Set(np.stack([np.eye(3)] * count), points[chosen].copy(), np.full((count, 3), 0.1))


def annealed(link: Link, boxes: Set, tolerance: float, hot: float, seed: int) -> Set:
    """Boxes after one annealing: the mesh inside and nothing farther out than `tolerance` [m],
    as far as that goes."""
    space, pockets = room(link.distance, tolerance)
    coarse = np.clip(np.rint((space.values - tolerance) / UNIT), -127, 127).astype(np.int8)
    pockets = thin(pockets, 0.05)
    everything = np.ascontiguousarray(np.concatenate([link.points, pockets]))
    points = np.concatenate([extremes(link.points, _FIRST_CELL), thin(pockets, 0.3)])
    points, weights = np.ascontiguousarray(points), np.ones(len(points))
    for stage in range(_STAGES):
        share, later = stage / _STAGES, (stage + 1) / _STAGES
        _, R, c, h = anneal(
            points,
            weights,
            coarse,
            space.origin,
            space.step,
            _SPACINGS[0] + (_SPACINGS[1] - _SPACINGS[0]) * share,
            _PRICES[0] * (_PRICES[1] / _PRICES[0]) ** share,
            (boxes.R, boxes.c, boxes.h),
            MOVES // _STAGES,
            hot * (_COLD / hot) ** share,
            hot * (_COLD / hot) ** later,
            1000 * seed + stage,
        )
        boxes = Set(R, c, h)
        away = boxes.away(everything).min(axis=0)
        order = np.argsort(-away, kind="stable")[: np.count_nonzero(away > 0.0)]
        more = thin(everything[order], 0.06)[:150]
        points = np.concatenate([points, more])
        weights = np.concatenate([weights, np.ones(len(more))])
    return boxes


class Renewal:
    """Known boxes, of which a few at a time are chosen anew to come within `aim` [m]."""

    def __init__(self, link: Link, boxes: Boxes, aim: float, seed: int) -> None:
        self.boxes, self._link = boxes, link
        self.ended = False  # no more to improve
        self._tolerance = aim - EDGE
        space, pockets = room(_measured(link, self._tolerance), self._tolerance)
        self._pockets = thin(pockets, 0.05)
        cell = 0.1
        while len(some := extremes(link.points, cell)) > _LOOKED_AT:
            cell *= 1.25
        some = np.concatenate([some, thin(pockets, 0.15)])
        self._room = Room.of(space, self._tolerance)
        self._room.forbid(*_between_nodes(link, space, self._tolerance))
        begin = Set(boxes.rotations, boxes.centers, boxes.half_extents)
        self._chosen = Chosen(some, self._room, begin, seed)

    def improved(self, report: Callable[[int], None] | None = None) -> Set:
        """The boxes after some choices; points may be left out."""
        for _ in range(_CHECKS):
            if self._chosen.improve(RENEWALS, report):
                break
            self.ended = not self._corrected()
            if self.ended:
                break
        return self._chosen.as_set()

    def _corrected(self) -> bool:
        """Look closely: whether the boxes leave out parts of triangles, or stick out between the
        grid's nodes. What does counts from now on."""
        boxes = self._chosen.as_set()
        at = surface_points(Boxes(boxes.c, boxes.R, boxes.h), 0.03)
        away = np.asarray(self._link.tree.query(at)[0])
        beyond = away > self._tolerance + UNIT
        unknown = self._room.forbid(at[beyond], away[beyond] - self._tolerance)
        self._chosen.draw_in()
        boxes = self._chosen.as_set()
        rest = self._link.triangles
        for R, c, h in zip(boxes.R, boxes.c, boxes.h, strict=True):
            rest = outside_box(rest, R, R.T @ c - h, R.T @ c + h)
        points = np.concatenate([subdivided(rest, _FINE).reshape(-1, 3), self._pockets])
        away = boxes.away(points).min(axis=0)
        order = np.argsort(-away, kind="stable")[: np.count_nonzero(away > EDGE)]
        self._chosen.look_at(thin(points[order], 0.03))
        return unknown or bool(len(order))


def _measured(link: Link, tolerance: float) -> Field:
    """The link's field with the distances near `tolerance` [m] measured, not estimated."""
    values = link.distance.values.copy()
    near = np.abs(values - tolerance) < _NEAR
    at = link.distance.origin + link.distance.step * np.argwhere(near)
    values[near] = link.tree.query(at)[0]
    return Field(link.distance.origin, link.distance.step, values)


def _between_nodes(link: Link, space: Field, tolerance: float) -> tuple[Array, Array]:
    """The middles of the grid's cells (n, 3) [m] that are beyond `tolerance`, and how far (n,) [m].

    Cells with nodes in pockets are left out: those may be filled.
    """
    low = np.full(np.array(space.values.shape) - 1, np.inf)
    high = -low
    size = low.shape
    for i, j, k in np.ndindex(2, 2, 2):
        part = space.values[i : i + size[0], j : j + size[1], k : k + size[2]]
        low, high = np.minimum(low, part), np.maximum(high, part)
    at = space.origin + space.step * (
        np.argwhere((low > tolerance - _NEAR) & (low <= tolerance) & (high > tolerance)) + 0.5
    )
    beyond = np.asarray(link.tree.query(at)[0]) - tolerance
    return at[beyond > 0.0], beyond[beyond > 0.0]


def _closed(link: Link, boxes: Set, wanted: float) -> tuple[Boxes, float]:
    """The boxes, polished where that helps, grown over what they left out; their excess [m]."""
    space, pockets = room(link.distance, wanted)
    points = np.concatenate([link.points, thin(pockets, 0.05)])
    best: tuple[Boxes, float] | None = None
    for again in range(4):
        if again:
            boxes = polished(boxes, points, space, wanted, 8 if again > 1 else 16)
        middles = np.einsum("kji,kj->ki", boxes.R, boxes.c)
        low, high = middles - boxes.h, middles + boxes.h
        low, high = grown(link.triangles, boxes.R, low, high, _FINE)
        centers = (boxes.R @ ((low + high) / 2.0)[:, :, None])[:, :, 0]
        full = Boxes(centers, boxes.R, (high - low) / 2.0 + PAD + _DIGITS)
        full = boxes_of(tables_of(full))
        value = farthest(full, link.tree, 0.03)
        if best is None or value < best[1]:
            best = full, value
        rest = link.triangles
        for R, c, h in zip(boxes.R, middles, boxes.h, strict=True):
            rest = outside_box(rest, R, c - h, c + h)
        if again and not len(rest):
            break
        points = np.concatenate([points, thin(subdivided(rest, _FINE).reshape(-1, 3), 0.01)])
    assert best is not None
    return best
