"""The way: cylindrical moves first (lift, swing, lower), else a search from both ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from backend.machine.model import Machine
from backend.planning.trajectory import search_kernels
from backend.planning.trajectory.carry import Carry, attitude_of, cylinder, from_cylinder
from backend.planning.trajectory.records import Refusal, Task
from backend.planning.trajectory.sweep import Sweep
from backend.spatial.types import Array, IntArray

DRAWS = 6_000
"""Postures that one search draws at most."""
_CUTS = 250
_STEP = 0.06  # [m] of the end point between postures of a cylindrical move
_TURN = 0.05  # [rad] of swing
_LIFTS = (0.0, 0.5, 1.0, 1.6, 2.4)  # [m] above the asked lift
_INWARDS = (1.0, 0.8, 0.6)  # of the shorter of both reaches
_LONGEST = 0.6  # [s] of one step of the search at full speed
_ATTEMPTS = 3  # at a way on which the machine does not tip

Stands = Callable[[Array], bool]
"""Whether the machine stands without tipping at rest in postures (m, n)."""


@dataclass(frozen=True)
class Way:
    """points: (m, n) polyline of joint values that is free [rad]; how: in words."""

    points: Array
    how: str


def find_way(
    machine: Machine,
    task: Task,
    sweep: Sweep,
    carry: Carry,
    goals: Array,
    stands: Stands,
) -> Way | Refusal:
    """A free way from task.q to one of goals (g, n). stands: what is asked of every posture."""
    toppled, blockers = False, dict[str, int]()
    found: list[Way] = []
    hits = np.zeros(len(sweep.names), np.int64)
    for number, goal in enumerate(goals):
        for points, how in _moves(machine, task, goal):
            hit = sweep.blocked(points)
            if hit is not None:
                blockers[hit] = blockers.get(hit, 0) + 1
            elif not stands(points):
                toppled = True
            else:
                found.append(Way(points, how if number == 0 else f"the other way round, {how}"))
                break
        if number == 0 and found:
            return found[0]
    for attempt in range(_ATTEMPTS):
        points = search(machine, task, sweep, carry, goals, hits, task.seed + attempt)
        if not len(points):
            break
        if stands(np.concatenate([_dense(a, b) for a, b in pairwise(points)])):
            found.append(Way(points, "found by a search from both ends"))
            break
        toppled = True
    if found:
        return min(found, key=lambda way: _least_time(machine, way.points))
    if toppled:
        return Refusal("tips", "every way that was found tips the machine over.")
    order = np.argsort(-hits, kind="stable")
    names = list(dict.fromkeys(sweep.names[p] for p in order if hits[p] > 0))
    names = [n for n in names if not n.startswith("its own")] or names or list(blockers)
    told = " and ".join(names[:2]) or "the joints' ends"
    why = f"no way was found in {DRAWS} draws; in the way were mostly {told}."
    return Refusal("not found", why, tuple(names))


def search(
    machine: Machine,
    task: Task,
    sweep: Sweep,
    carry: Carry,
    goals: Array,
    hits: IntArray,
    seed: int,
    draws: int = DRAWS,
) -> Array:
    """(m, n) free polyline by RRT-Connect (Kuffner and LaValle 2000) with short cuts, (0, n) when
    none was found; the same for the same seed.

    It searches swing, boom and stick, with the bucket's attitude between those of start and goal,
    `band` more. hits: (p,) counts the pairs in the way.
    """
    start, ends = carry.x(machine, task.q), carry.x(machine, goals)
    both = np.concatenate([start[None], ends])
    low = np.array([*machine.lower[:3], both[:, 3].min() - task.band])
    high = np.array([*machine.upper[:3], both[:, 3].max() + task.band])
    low[0] = max(low[0], both[:, 0].min() - 1.0)
    high[0] = min(high[0], both[:, 0].max() + 1.0)
    weights = 1.0 / np.append(machine.max_velocity[:3], machine.max_velocity[3])
    rng = np.random.default_rng(seed)
    world = (sweep.chain, sweep.boxes, sweep.pairs, (carry.A, carry.b))
    path = search_kernels.connect(
        world,
        (machine.lower, machine.upper),
        (low, high),
        (weights, _LONGEST),
        np.ascontiguousarray(start[None]),
        np.ascontiguousarray(ends),
        rng.random((draws, 4)),
        hits,
    )
    if not len(path):
        return np.zeros((0, len(task.q)))
    path = search_kernels.shorten(world, weights, path, rng.random((_CUTS, 2)))
    return carry.q(path)


def _moves(machine: Machine, task: Task, goal: Array) -> Iterator[tuple[Array, str]]:
    """Polylines (m, n) and words: straight in theta, r, z, or lifted, swung and lowered."""
    a, b = cylinder(machine, task.q), cylinder(machine, goal)
    turn = machine.sun.azimuth_sign * (goal[0] - task.q[0])
    b = np.array([a[0] + turn, b[1], b[2]])
    if task.lift == 0.0:
        yield from _posed(machine, task, goal, np.stack([a, b]), "straight in theta, r and z")
    top = max(a[2], b[2])
    for inwards in _INWARDS:
        for more in _LIFTS:
            if task.lift + more == 0.0 and inwards == 1.0 and a[2] == b[2]:
                continue
            z, r = top + task.lift + more, min(a[1], b[1]) * inwards
            r0, r1 = (a[1], b[1]) if inwards == 1.0 else (r, r)
            over = np.array([a, [a[0], r0, z], [b[0], r1, z], b])
            how = f"lifted by {task.lift + more:.1f} m, swung and lowered"
            if inwards < 1.0:
                how = f"drawn in to {r:.1f} m, {how}"
            yield from _posed(machine, task, goal, over, how)


def _posed(
    machine: Machine, task: Task, goal: Array, corners: Array, how: str
) -> Iterator[tuple[Array, str]]:
    """The move through corners (c, 3) when the arm can make it."""
    parts = [corners[:1]]
    for p, q in pairwise(corners):
        far = max(abs(q[0] - p[0]) / _TURN, np.hypot(*(q - p)[1:]) / _STEP)
        parts.append(p + np.linspace(0.0, 1.0, max(2, int(np.ceil(far)) + 1))[1:, None] * (q - p))
    where = np.concatenate(parts)
    share = np.linspace(0.0, 1.0, len(where))
    phi0, phi1 = (float(attitude_of(machine, q)) for q in (task.q, goal))
    q, inside = from_cylinder(machine, where, phi0 + share * (phi1 - phi0))
    q[:, 0] += task.q[0] - q[0, 0]
    # Another elbow than the usual one, or a posture by other means, is left to the search.
    ends = max(np.abs(q[0] - task.q).max(), np.abs(q[-1] - goal).max())
    if inside and ends < 1e-3:
        q[0], q[-1] = task.q, goal
        yield q, how


def _least_time(machine: Machine, points: Array) -> float:
    """Of a polyline (m, n) at full speed [s]."""
    return float((np.abs(np.diff(points, axis=0)) / machine.max_velocity).max(axis=1).sum())


def _dense(a: Array, b: Array) -> Array:
    count = max(2, int(np.ceil(np.abs(b - a).max() / _TURN)) + 1)
    return np.asarray(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a))
