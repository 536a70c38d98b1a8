"""The shipped sessions, judged anew: the same as when someone last looked and agreed."""

from __future__ import annotations

import json
from typing import Any

import pytest
from golden_replay import ANGLE, DISTANCE, GOLDEN, SITES, summary


def same(golden: Any, now: Any, tolerance: float, where: str) -> None:
    """Raises AssertionError naming the first place at which the two differ."""
    if isinstance(golden, dict):
        assert list(golden) == list(now), where
        for key, value in golden.items():
            same(value, now[key], tolerance, f"{where}.{key}")
    elif isinstance(golden, list):
        assert len(golden) == len(now), where
        for k, value in enumerate(golden):
            same(value, now[k], tolerance, f"{where}[{k}]")
    elif isinstance(golden, float) and isinstance(now, float):
        assert abs(golden - now) <= tolerance, f"{where}: {golden} was, {now} is"
    else:
        assert golden == now, f"{where}: {golden} was, {now} is"


@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", SITES)
def test_shipped_sessions_are_judged_as_before(name: str) -> None:
    golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
    now = summary(name)
    same(golden["cycles"], now["cycles"], 0.0, "cycles")
    for part in ("levels", "alarms"):
        same(golden[part], now[part], 0.0, part)
    same(golden["clearance"], now["clearance"], DISTANCE, "clearance")
    for part in ("poses", "margins"):
        same(golden[part], now[part], ANGLE, part)


def test_a_change_is_noticed() -> None:
    golden = {"clearance": {"left|right": [[0.0, 1.0], [0.1, None]]}}
    same(golden, {"clearance": {"left|right": [[0.0, 1.0 + 1e-7], [0.1, None]]}}, 1e-5, "it")
    for other in (
        {"clearance": {"left|right": [[0.0, 1.001], [0.1, None]]}},
        {"clearance": {"left|right": [[0.0, 1.0], [0.1, 0.3]]}},
        {"clearance": {"left|right": [[0.0, 1.0]]}},
        {"clearance": {}},
    ):
        with pytest.raises(AssertionError):
            same(golden, other, 1e-5, "it")
