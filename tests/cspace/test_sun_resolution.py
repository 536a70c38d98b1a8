"""Section 5.1's resolution, and what it becomes live."""

from __future__ import annotations

import numpy as np
import pytest

from backend.cspace.resolution import resolution


def test_the_papers_figures() -> None:
    result = resolution(0.1, 0.6, np.array([0.35]))
    assert result.points_per_second == pytest.approx(10.0)
    assert result.points_per_metre == pytest.approx(10 / 0.6)
    assert round(result.points_per_metre) == 17
    assert int(result.points_per_radian[0]) == 28


def test_faster_machines_and_slower_cycles_are_coarser() -> None:
    slow = resolution(0.1, 0.3, np.array([0.1, -0.2]))
    fast = resolution(0.1, -0.6, np.array([0.2, 0.4]))
    late = resolution(0.2, 0.3, np.array([0.1, -0.2]))
    for coarser in (fast, late):
        assert coarser.points_per_metre == pytest.approx(slow.points_per_metre / 2)
        assert coarser.points_per_radian == pytest.approx(slow.points_per_radian / 2)


def test_standstill_is_infinite() -> None:
    result = resolution(0.1, 0.0, np.array([0.0, 0.5]))
    assert result.points_per_metre == np.inf
    assert result.points_per_radian.tolist() == [np.inf, 20.0]


@pytest.mark.parametrize("cycle", [0.0, -0.1, float("nan"), float("inf")])
def test_bad_cycles_are_refused(cycle: float) -> None:
    with pytest.raises(ValueError, match="cycle_time"):
        resolution(cycle, 0.6, np.array([0.35]))
