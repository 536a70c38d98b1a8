"""Careless drives of the road-rail machine among random limits, with its real accelerations.

Each drive is run with the same sticks without limits, and by the methods that are used for driving:
constraints and scaling. python-fcl judges every step and its middle. `GAUGE_DRIVES=10 pytest ...`
runs fewer.
"""

from __future__ import annotations

import os

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


@pytest.mark.timeout(6_000)
def test_careless_drives_beside_random_limits() -> None:
    methods: tuple[Method | None, ...] = (None, "constrained", "scaling")
    violated: dict[Method | None, list[int]] = {m: [] for m in methods}
    path: dict[Method | None, float] = dict.fromkeys(methods, 0.0)
    nearest: dict[Method | None, float] = dict.fromkeys(methods, np.inf)
    braked: dict[Method | None, float] = dict.fromkeys(methods, 0.0)
    for seed in range(DRIVES):
        for method in methods:
            done, limits = drive(seed, method, SECONDS)
            dense = between(done.q)
            if judged_by(Fcl, RAIL, dense, limits.boxes).any():
                violated[method].append(seed)
            path[method] += travel(done)
            braked[method] += done.braked.sum()
            if method is not None:
                near = clearances(RAIL, limits, done.q, cap=1.0)
                nearest[method] = min(nearest[method], float(near.min()))
    free = violated[None]
    print(f"\n{DRIVES} drives of {SECONDS:.0f} s")
    print(f"  violations without limits      expected >= 50 %  measured {len(free) / DRIVES:.0%}")
    for method in methods[1:]:
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
    for method in methods[1:]:
        assert violated[method] == [], method
        assert nearest[method] > 0.0
        assert path[method] >= 0.5 * path[None], method
