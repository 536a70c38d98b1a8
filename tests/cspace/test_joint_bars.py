"""Bars of single joints against direct checks of every pair of boxes."""

from __future__ import annotations

import numpy as np
import pytest
from exact_scenes import NAMES, judged, machine_named, scene

from backend.cspace.cells import COLLIDING, FREE, PARTNER, SELF, SITE
from backend.cspace.joint_bars import joint_bar
from backend.spatial.boxes import Boxes

ETA, SLACK = 0.05, 0.01


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", [1, 2])
def test_bars_agree_with_direct_checks(name: str, seed: int) -> None:
    machine = machine_named(name)
    rng = np.random.default_rng(seed)
    near, far = scene(machine, seed), scene(machine, seed + 100)
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
    everything = Boxes(
        np.concatenate([near.centers, far.centers]),
        np.concatenate([near.rotations, far.rotations]),
        np.concatenate([near.half_extents, far.half_extents]),
    )
    seen = 0
    for _ in range(3):
        q = rng.uniform(low, high)
        for joint in range(4):
            edges = np.array([low[joint], high[joint]])
            cells = joint_bar(
                machine, q, joint, edges, 40, {"partner": near, "site": far}, ETA,
                np.full(len(q), SLACK),
            )  # fmt: skip
            seen |= int(np.bitwise_or.reduce(cells))
            step = (edges[1] - edges[0]) / 40
            at = np.repeat(q[None], 40, axis=0)
            at[:, joint] = edges[0] + (np.arange(40) + 0.5) * step
            partner, itself = judged(machine, at, near)
            site, _ = judged(machine, at, far)
            for bit, found in ((PARTNER, partner), (SITE, site), (SELF, itself)):
                np.testing.assert_array_equal((cells & bit) != 0, found)
            # Certificates hold at random places of their cells, and with errors within the bounds.
            inside = at.copy()
            inside[:, joint] += rng.uniform(-0.5, 0.5, 40) * step
            touches = np.logical_or(*judged(machine, inside, everything))
            assert touches[(cells & COLLIDING) != 0].all()
            wrong = inside + rng.uniform(-SLACK, SLACK, inside.shape)
            _, itself = judged(machine, wrong, everything)
            assert not itself[(cells & FREE) != 0].any()
            shift = rng.normal(size=(len(everything), 3))
            shift *= ETA / np.linalg.norm(shift, axis=1, keepdims=True)
            moved = Boxes(everything.centers + shift, everything.rotations, everything.half_extents)
            against, _ = judged(machine, inside, moved)
            assert not against[(cells & FREE) != 0].any()
    assert seen & PARTNER
    assert seen & COLLIDING
    assert seen & FREE or name == "zx200"  # one box a link touches itself everywhere


def test_without_obstacles_only_the_machine_itself_counts() -> None:
    machine = machine_named("mini")
    cells = joint_bar(machine, np.array([0.0, 0.5, -1.0, 0.2]), 0, np.array([-3.1, 3.1]), 30, {})
    assert (cells == FREE).all()
