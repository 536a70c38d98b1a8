"""Time to collision in closed form against integration in steps of a millisecond.

`CASES=1000 pytest ...` for fewer.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from swings import DT, END, cases, grazes, integrated

from backend.safety.swing_risk import time_to_collision

CASES = int(os.environ.get("CASES", "10000"))


@pytest.mark.timeout(3_600)
def test_time_to_collision_against_integration() -> None:
    worst, late, grazed, never = 0.0, 0.0, 0, 0
    for swing, place, velocity, clearance in cases(CASES, 100):
        found = time_to_collision(swing, place[None], velocity[None], np.array([clearance]))[0]
        true = integrated(swing, place, velocity, clearance)
        never += bool(np.isinf(true))
        same = found > END - 2 * DT if np.isinf(true) else abs(found - true) <= 5 * DT
        if not same:
            assert grazes(swing, place, velocity, clearance), (swing, place, velocity, clearance)
            grazed += 1
        elif np.isfinite(true):
            worst, late = max(worst, abs(found - true)), max(late, found - true)
    print(
        f"\n  {CASES} cases, {never} without a collision in {END:.0f} s: at most "
        f"{worst * 1e3:.1f} ms off, {late * 1e3:.1f} ms late; {grazed} graze (a hair decides)"
        "\n  expected: at most 5 ms off, none late by more than a step of 1 ms"
    )
    assert late <= DT
    assert grazed < 0.01 * CASES
