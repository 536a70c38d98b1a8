"""What detection made of every point, to be looked at: codes, counts, and a picture of a few."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.errors import InputError
from backend.perception.detect import Objects, Stages
from backend.perception.ground import Plane
from backend.spatial.types import AnyArray, IntArray

OUTSIDE, MACHINE, GROUND, OBJECT, LEFT = range(5)
NAMES = ("outside", "machine", "ground", "object", "left")
"""By code. outside: of the region of interest, or no numbers; machine: of a machine's own body;
ground: on it or below; object: in a box; left: too high, or in a cluster that is no object.
"""
MOST = 8_000
"""Points of a picture."""


@dataclass(frozen=True)
class StagedScan:
    """One scan as it is looked at. time [s]; points: (n, 3) site frame, float32 [m]; stage: (n,)
    codes, uint8; cluster: (n,) row of objects, -1 for none; counts: points of each stage, by code,
    before `thinned`; plane: the ground, None when none was found.
    """

    time: float
    points: AnyArray
    stage: AnyArray
    cluster: IntArray
    counts: tuple[int, ...]
    plane: Plane | None
    objects: Objects


def codes(stages: Stages) -> AnyArray:
    """(n,) the stage at which each point ended, uint8."""
    found = np.full(len(stages.near), OUTSIDE, np.uint8)
    found[stages.near] = LEFT
    found[stages.machine] = MACHINE
    found[stages.ground] = GROUND
    found[stages.cluster >= 0] = OBJECT
    return found


def counts(stage: AnyArray) -> tuple[int, ...]:
    """How many points ended at each stage, by code. stage: (n,) codes."""
    return tuple(int(n) for n in np.bincount(stage, minlength=len(NAMES)))


def thinned(stage: AnyArray, cluster: IntArray, most: int = MOST) -> IntArray:
    """Rows of at most `most` points, in order, that show every stage and every object.

    Every stage but objects, and every object by itself, may keep the same number of points
    (max-min fairness): the small keep all of theirs, and the ground makes room. stage, cluster:
    (n,), as of StagedScan. Raises InputError.
    """
    if most < 1:
        raise InputError(f"a picture of stages: most is {most}; allowed is 1 or more.")
    n = len(stage)
    if n <= most:
        return np.arange(n)
    group = np.where(stage == OBJECT, len(NAMES) + cluster, stage)
    order = np.argsort(group, kind="stable")
    _, start, size = np.unique(group[order], return_index=True, return_counts=True)
    share = _shares(size, most)
    rank = np.arange(n) - np.repeat(start, size)
    of, whole = np.repeat(share, size), np.repeat(size, size)
    # Evenly spread: the k-th of n points is kept where k * share / n passes a whole number.
    kept = (rank + 1) * of // whole > rank * of // whole
    return np.sort(order[kept])


def _shares(size: IntArray, most: int) -> IntArray:
    """(k,) how many each group keeps, at most `most` together; the largest equal share."""
    share = np.zeros(len(size), np.int64)
    left, order = most, np.argsort(size, kind="stable")
    for done, k in enumerate(order):
        share[k] = min(int(size[k]), -(-left // (len(size) - done)))
        left -= int(share[k])
    return share
