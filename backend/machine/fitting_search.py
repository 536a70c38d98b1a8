"""The search behind `fit_boxes`: which few boxes, each within the room, cover all of a mesh.

A box may not enter the space farther from the mesh than the tolerance and open to the outside, see
`room`; whatever keeps out of it exceeds the mesh by no more. So the boxes are independent of each
other but for what they cover together: a set cover among many candidates (`Pool`, `cover`). New
candidates are made where the best cover so far fails, and the tolerance rises when that is of no
more use.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from backend.machine import fitting_kernels as kernels
from backend.machine.fitting_clip import extremes, thin
from backend.machine.fitting_cover import cover
from backend.machine.fitting_field import Field, room
from backend.machine.fitting_pool import Pool
from backend.spatial.types import Array, BoolArray, IntArray

_FIRST, _NEW, _KEPT = 4000, 600, 2000  # candidates at first, of each round, and kept
_STEPS = 2000  # of one search for a cover
# The tolerance rises after so many rounds without a better cover, or at once with more than
# _HOPELESS points left open. The one that is wanted is given more of a chance.
_PATIENCE, _PATIENCE_FIRST, _HOPELESS = 5, 25, 30
_TURNS = (0.5, 4.0, 15.0)  # [deg] by which a box's axes are varied


def search(
    triangles: Array,
    points: Array,
    distance: Field,
    max_boxes: int,
    tolerance: float,
    progress: Callable[[float], None],
    raised: float = 0.015,
    rounds: int = 70,
) -> Iterator[tuple[Array, Array, Array, float]]:
    """For one tolerance after another the boxes R (k, 3, 3), low, high (k, 3) found, and it [m].

    The boxes are clear at the tolerance, first the given one, then rising in steps of `raised` or
    a little more. Those of the last hold all points (n, 3); those before leave some out.
    triangles: (m, 3, 3) for likely orientations. progress: called with the share done.
    """
    rng = np.random.default_rng(1)
    tolerance = max(tolerance, 1.2 * distance.step)
    space, pockets = room(distance, tolerance)
    pool = Pool(triangles, _first_points(points, pockets), space, tolerance, rng)
    for _ in range(_FIRST):
        pool.offer(pool.axes(), pool.points[[rng.integers(len(pool.points))]])
    weights = np.ones(len(pool.points))
    best: IntArray = np.zeros(0, dtype=np.int64)
    least, since, patience = len(points), 0, _PATIENCE_FIRST
    targets = np.concatenate([points, thin(pockets, 0.06)])
    for r in range(rounds):
        progress(1.0 - 0.96**r)
        size = min(max_boxes, len(pool))
        found, missing = cover(np.array(pool.holds), weights, best, size, _STEPS, r)
        better = missing < least
        best, least, since = found, min(missing, least), 0 if better else since + 1
        if missing == 0:
            left = targets[~covered(targets, *_boxes(pool, best))]
            if not len(left):
                break
            more = extremes(left, 0.3)
            pool.also(more)
            weights = np.concatenate([weights, np.full(len(more), weights.mean())])
            least, since = len(points), 0
            best = _pruned(pool, best, weights)
            continue
        if since >= patience or missing > _HOPELESS:
            yield *tightened(targets, *_boxes(pool, best)), tolerance
            tolerance += max(raised, 0.05 * tolerance)
            least, since, patience = len(points), 0, _PATIENCE
            space, pockets = room(distance, tolerance)
            pool.regrow(space, tolerance)
            targets = np.concatenate([points, thin(pockets, 0.06)])
        _propose(pool, best, weights)
        best = _pruned(pool, best, weights)
    yield *tightened(targets, *_boxes(pool, best)), tolerance


def covered(points: Array, R: Array, low: Array, high: Array) -> BoolArray:
    """(n,) whether points (n, 3) are in one of the boxes R (k, 3, 3), low, high (k, 3)."""
    out = np.zeros(len(points), dtype=np.bool_)
    for k in range(len(R)):
        out |= kernels.held(points, R[k], low[k], high[k])
    return out


def tightened(points: Array, R: Array, low: Array, high: Array) -> tuple[Array, Array, Array]:
    """The boxes, largest first, each around the points (n, 3) that no other holds, so that together
    they hold what they held; those without points of their own are left out."""
    low, high, kept = low.copy(), high.copy(), []
    holds = np.array([kernels.held(points, *box) for box in zip(R, low, high, strict=True)])
    for k in np.argsort(-np.prod(high - low, axis=1), kind="stable"):
        own = holds[k] & (holds.sum(axis=0) == 1)
        if own.any():
            low[k], high[k] = kernels.bounds(points[own], R[k])
            kept.append(k)
        holds[k] = kernels.held(points, R[k], low[k], high[k]) if own.any() else False
    return R[kept], low[kept], high[kept]


def _boxes(pool: Pool, rows: IntArray) -> tuple[Array, Array, Array]:
    R, low, high = ([values[k] for k in rows] for values in (pool.R, pool.low, pool.high))
    return np.array(R), np.array(low), np.array(high)


def _first_points(points: Array, pockets: Array) -> Array:
    """Some of all points: the rest is added where a cover turns out to leave it open."""
    cell = 0.3
    some = extremes(points, cell)
    while len(some) > 3000:
        cell *= 1.25
        some = extremes(points, cell)
    return np.ascontiguousarray(np.concatenate([some, thin(pockets, 0.25)]))


def _pruned(pool: Pool, best: IntArray, weights: Array) -> IntArray:
    """Keep the best cover and the candidates of most weight, no two alike; the cover's new rows."""
    holds = np.array(pool.holds)
    unique = np.unique(np.packbits(holds, axis=1), axis=0, return_index=True)[1]
    worth = np.full(len(holds), -1.0)
    worth[unique] = holds[unique] @ weights
    worth[best] = -1.0
    others = np.argsort(-worth, kind="stable")[: _KEPT - len(best)]
    pool.keep(np.concatenate([best, others[worth[others] >= 0.0]]))
    return np.arange(len(best))


def _propose(pool: Pool, best: IntArray, weights: Array) -> None:
    """New candidates: around one or two points that are hard to cover, and variants of the boxes
    of the best cover that take over a point left open or points of another box."""
    rng, odds = pool.rng, np.cumsum(weights)
    holds = np.array([pool.holds[k] for k in best])
    count = holds.sum(axis=0)
    own = [np.flatnonzero(row & (count == 1)) for row in holds]
    left, wanted = np.flatnonzero(count == 0), len(pool) + _NEW
    for _ in range(4 * _NEW):
        if len(pool) >= wanted:
            break
        draw, b = rng.random(), int(rng.integers(len(best)))
        if draw < 0.4 or not len(own[b]):
            hard = np.searchsorted(odds, rng.random(1 if draw < 0.2 else 2) * odds[-1])
            pool.offer(pool.axes() if rng.random() < 0.5 else pool.R[best[b]], pool.points[hard])
            continue
        members = pool.points[own[b]]
        if rng.random() < 0.4:
            members = _nearest_share(members, members, rng, 0.5, 1.0)
        other = own[int(rng.integers(len(best)))]
        if rng.random() < 0.4 and len(other):
            members = np.concatenate(
                [members, _nearest_share(pool.points[other], members, rng, 0.0, 0.6)]
            )
        if rng.random() < 0.6 and len(left):
            members = np.concatenate([members, pool.points[[rng.choice(left)]]])
        R = pool.R[best[b]]
        R = pool.jittered(R, float(rng.choice(_TURNS))) if rng.random() < 0.8 else pool.axes()
        pool.offer(R, members, turn=True)


def _nearest_share(
    points: Array, to: Array, rng: np.random.Generator, least: float, most: float
) -> Array:
    """A random share of points (n, 3), those nearest to one of `to` (m, 3)."""
    away = ((points - to[rng.integers(len(to))]) ** 2).sum(axis=1)
    number = max(1, round(len(points) * rng.uniform(least, most)))
    return points[np.argsort(away, kind="stable")[:number]]
