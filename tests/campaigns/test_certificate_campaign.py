"""1,000,000 configurations in 20 random scenes against the certificates of their cells.

Judged by separating axes written for the tests, and by coal; half of the configurations are in
certified cells beside cells of another state, where an error would show.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from exact_checks import certificates
from random_scenes import campaign_models, random_scene

SCENES = int(os.environ.get("EXACT_SCENES", "20"))
SAMPLES, BY_COAL = 50_000, 25_000  # a scene
SHAPES = ((48, 32, 32, 32), (72, 32, 32, 32))

NONE = (
    "free and colliding",
    "colliding cells that eta changes",
    "free, yet touches: SAT",
    "free, yet touches: coal",
    "free at eta, yet touches: SAT",
    "free at eta, yet touches: coal",
    "displaced: SAT",
    "within eta: coal",
    "colliding, yet free: SAT",
    "colliding, yet free: coal",
)


@pytest.mark.timeout(5400)
def test_certificates(shared_data: Path) -> None:
    models = campaign_models(shared_data)
    begun, found = time.monotonic(), Counter[str]()
    print(f"\n{SCENES} scenes, {SAMPLES} configurations each; wrong: of all that is forbidden")
    print("  scene              gap  boxes     eta  swings    free  colliding  free, eta  wrong")
    for seed in range(SCENES):
        scene = random_scene(seed, models)
        eta = float(np.random.default_rng(seed).uniform(0.02, 0.10))
        shape = SHAPES[seed // 3 % 2]
        one = certificates(scene, shape, eta, SAMPLES, BY_COAL, seed)
        found += one
        print(
            f"  {scene.name:17} {scene.gap:4.1f}  {len(scene.obstacles):5}  {eta:6.3f}  "
            f"{shape[0]:6}  {one['in free cells']:6}  {one['in colliding cells']:9}  "
            f"{one['in free cells, eta']:9}  {sum(one[name] for name in NONE):5}"
        )
    print(f"  {time.monotonic() - begun:.0f} s")
    for name in (
        "judged by SAT",
        "beside a border",
        "judged by coal",
        "in free cells",
        "in free cells, eta",
        "in colliding cells",
        "displaced configurations",
        "asked for eta by coal",
        "coal against SAT",
        "contact within 1e-9 m",
    ):
        print(f"  {name:34}                measured {found[name]}")
    for name in NONE:
        print(f"  {name:34} expected 0     measured {found[name]}")
    assert all(found[name] == 0 for name in NONE)
