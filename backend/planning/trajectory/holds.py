"""Whether a trajectory still holds: what is in its way now, and was not when it was planned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from backend.machine.model import Machine
from backend.planning.trajectory import sweep_kernels
from backend.planning.trajectory.records import Obstacles
from backend.planning.trajectory.sweep import Sweep, make_sweep
from backend.spatial.types import Array

DOUBT = 0.05
"""What is measured anew may seem this much nearer than before [m]."""
LEAST = 0.01
"""Contact, whatever was near before [m]."""


@dataclass(frozen=True)
class Broken:
    """What is too near, from which row of the trajectory on."""

    row: int
    name: str


def nearest(machine: Machine, obstacles: Obstacles, q: Array, within: float) -> dict[str, float]:
    """By name of an obstacle, how near it is at q (n,), where that is nearer than `within` [m]."""
    if not len(obstacles.boxes):
        return {}
    sweep = _outer(machine, obstacles, within)
    d, found = sweep.distances(q), dict[str, float]()
    for k in np.flatnonzero(d < within):
        name = sweep.names[k]
        found[name] = min(float(d[k]), found.get(name, np.inf))
    return found


def broken(
    machine: Machine, obstacles: Obstacles, q: Array, keep: float, before: Mapping[str, float]
) -> Broken | None:
    """Where postures (m, n) and the straight ways between them come nearer than `keep` [m] to
    something, None where nowhere. before: `nearest` at the start when it was planned: the machine
    may be as near to that as it was.
    """
    if not len(obstacles.boxes) or not len(q):
        return None
    sweep = _outer(machine, obstacles, keep)
    least = np.array([min(keep, before.get(name, np.inf) - DOUBT) for name in sweep.names])
    clear = np.maximum(least, LEAST)
    sweep = replace(sweep, pairs=(*sweep.pairs[:2], clear, clear * 0.8, sweep.pairs[4]))
    q = np.ascontiguousarray(q)
    for row in range(max(len(q) - 1, 1)):
        pair = sweep_kernels.blocker(
            sweep.chain, sweep.boxes, sweep.pairs, q[row], q[min(row + 1, len(q) - 1)]
        )
        if pair >= 0:
            return Broken(row, sweep.names[pair])
    return None


def _outer(machine: Machine, obstacles: Obstacles, clearance: float) -> Sweep:
    """Without the machine's own bodies and the ground, which do not move."""
    sweep = make_sweep(machine, replace(obstacles, ground=False), clearance)
    own = len(machine.self_pair_index)
    first, second, clear, keep, levers = sweep.pairs
    outer = first[own:], second[own:], clear[own:], keep[own:], levers[own:]
    return replace(sweep, pairs=outer, names=sweep.names[own:])
