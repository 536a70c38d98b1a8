"""Tipping over as predicted and as it happens in a physics engine, on random motions.

`CASES=20 pytest ...` for fewer. Expected: no motion that was called stable lifts a track, and
outside of a band of 2 % about the edge every verdict is the engine's.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from tipping import judge, random_drive

from backend.machine.load import load_machine

CASES = int(os.environ.get("CASES", "100"))
BAND = 0.02


@pytest.mark.timeout(3_600)
def test_what_is_predicted_to_stand_stands() -> None:
    machines = [load_machine(name) for name in ("mini", "ex13", "rail6")]
    random = np.random.default_rng(2025)
    rows = []
    for i in range(CASES):
        machine = machines[i % len(machines)]
        rows.append((machine.name, *judge(random_drive(machine, random))))
    print("\n  machine  motions  stood/stood  tipped/tipped  tipped/stood  stood/tipped (unsafe)")
    for name in (*(machine.name for machine in machines), "all"):
        own = [row for row in rows if name in (row[0], "all")]
        count = {
            (said, was): sum((p > 0.0, not up) == (said, was) for _, p, up, _ in own)
            for said in (True, False)
            for was in (True, False)
        }
        print(
            f"  {name:8} {len(own):7} {count[True, True]:12} {count[False, False]:14}"
            f" {count[False, True]:13} {count[True, False]:22}"
        )
    near = sorted((p, up, name) for name, p, up, _ in rows if abs(p) < BAND)
    print(f"  within {BAND:.0%} of the edge: {len(near)}")
    for p, up, name in near:
        print(f"    {name:8} {100 * p:+.2f} %  {'lifted' if up else 'stood'}")
    errors = np.array([error for *_, error in rows])
    half, most = (100 * np.percentile(errors, p) for p in (50, 95))
    print(
        f"  moments about edges until then, off by: median {half:.1f} %, p95 {most:.1f} %,"
        f" worst {100 * errors.max():.1f} % (tracks that rock)"
    )
    assert not [row for row in rows if row[1] > BAND and row[2]]
    assert not [row for row in rows if row[1] < -BAND and not row[2]]
    assert 0.2 * CASES < sum(row[2] for row in rows) < 0.8 * CASES
