"""Margins of every joint both ways from 240 random states in 20 scenes, by sweeps of python-fcl."""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from exact_checks import FINE, swept_margins
from random_scenes import campaign_models, random_scene

SCENES = int(os.environ.get("EXACT_SCENES", "20"))
STATES = 6  # a scene, as built and grown each


@pytest.mark.timeout(5400)
def test_margins(shared_data: Path) -> None:
    models = campaign_models(shared_data)
    begun, found = time.monotonic(), Counter[str]()
    print("\n  scene              boxes     eta  states  to a contact  to itself  wrong")
    for seed in range(200, 200 + SCENES):
        scene = random_scene(seed, models, clear=0.10)
        for eta in (0.0, float(np.random.default_rng(seed).uniform(0.02, 0.10))):
            one = swept_margins(scene, STATES, eta, seed)
            found += one
            wrong = sum(one[k] for k in ("optimistic", "late", "misnamed", "limit missed"))
            print(
                f"  {scene.name:17}  {len(scene.obstacles):5}  {eta:6.3f}  {one['states']:6}  "
                f"{one['to a contact']:12}  {one['to itself']:9}  {wrong:5}"
            )
    print(f"  {time.monotonic() - begun:.0f} s, fine step {FINE:g} rad")
    print(f"  states                          expected >= 200  measured {found['states']}")
    for name in (
        "directions",
        "positions",
        "to a contact",
        "to itself",
        "to the limit",
        "grazing",
        "short of eta",
    ):
        print(f"  {name:31}                  measured {found[name]}")
    for name in ("optimistic", "late", "misnamed", "limit missed"):
        print(f"  {name:31} expected 0       measured {found[name]}")
    assert found["states"] >= 10 * SCENES
    assert not any(found[name] for name in ("optimistic", "late", "misnamed", "limit missed"))
