"""Careless drives of the road-rail machine among random limits, with its real accelerations.

Each drive is run with the same sticks without limits, and by the methods that are used for driving:
constraints and scaling. python-fcl judges every step and its middle. `GAUGE_DRIVES=10 pytest ...`
runs fewer.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
import pytest
from engines import Fcl, judged_by
from gauge_runs import RAIL, between, drive

from backend.planning.records import Method
from backend.planning.simulate import Run, clearances

DRIVES = int(os.environ.get("GAUGE_DRIVES", "50"))
SECONDS = 10.0


def travel(done: Run) -> float:
    """All joints' path [rad]."""
    return float(np.abs(np.diff(done.q, axis=0)).sum())


class Driven(NamedTuple):
    """violated: whether python-fcl saw contact; path: all joints' [rad]; nearest: shortest
    distance, infinite where not measured [m]; braked: cycles in which a stop was enforced.
    """

    violated: bool
    path: float
    nearest: float
    braked: float


METHODS: tuple[Method | None, ...] = (None, "constrained", "scaling")


def driven(seed: int) -> list[Driven]:
    """One drive by each of METHODS."""
    found = []
    for method in METHODS:
        done, limits = drive(seed, method, SECONDS)
        violated = bool(judged_by(Fcl, RAIL, between(done.q), limits.boxes).any())
        nearest = np.inf
        if method is not None:
            nearest = float(clearances(RAIL, limits, done.q, cap=1.0).min())
        found.append(Driven(violated, travel(done), nearest, float(done.braked.sum())))
    return found


@pytest.mark.timeout(40_000)
def test_careless_drives_beside_random_limits() -> None:
    violated: dict[Method | None, list[int]] = {m: [] for m in METHODS}
    path: dict[Method | None, float] = dict.fromkeys(METHODS, 0.0)
    nearest: dict[Method | None, float] = dict.fromkeys(METHODS, np.inf)
    braked: dict[Method | None, float] = dict.fromkeys(METHODS, 0.0)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for seed, found in enumerate(pool.map(driven, range(DRIVES))):
            for method, one in zip(METHODS, found, strict=True):
                if one.violated:
                    violated[method].append(seed)
                path[method] += one.path
                nearest[method] = min(nearest[method], one.nearest)
                braked[method] += one.braked
            print(
                f"  drive {seed}: contact of {[m for m in METHODS if seed in violated[m]]}",
                flush=True,
            )
    free = violated[None]
    print(f"\n{DRIVES} drives of {SECONDS:.0f} s")
    print(f"  violations without limits      expected >= 50 %  measured {len(free) / DRIVES:.0%}")
    for method in METHODS[1:]:
        part = path[method] / path[None]
        print(f"  {method}")
        print(
            f"    violations                   expected 0        measured {len(violated[method])}"
        )
        print(
            f"    nearest                      expected > 0      measured {nearest[method]:.3f} m"
        )
        print(f"    joint path of the unlimited  expected >= 50 %  measured {part:.0%}")
        print(f"    cycles in which a stop was enforced            {braked[method]:.0f}")
    assert len(free) >= 0.5 * DRIVES
    for method in METHODS[1:]:
        assert violated[method] == [], method
        assert nearest[method] > 0.0
        assert path[method] >= 0.5 * path[None], method
