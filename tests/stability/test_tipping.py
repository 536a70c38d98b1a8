"""A few motions in a physics engine: the ZMP's verdict is what happens to the tracks."""

from __future__ import annotations

import numpy as np
from tipping import judge, random_drive


def test_tracks_lift_when_the_zmp_leaves_them(machine):
    random = np.random.default_rng(7)
    outcomes = []
    for _ in range(3):
        verdict = judge(random_drive(machine, random))
        assert verdict.error < 0.02
        if abs(verdict.predicted) > 0.02:
            assert verdict.lifted == (verdict.predicted < 0.0)
            outcomes.append(verdict.lifted)
    assert outcomes
