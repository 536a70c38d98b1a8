"""Incursions of a clearance over time."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from cockpit.report.incursions import incursions

SLOW = 0.8
VALUES = st.lists(st.one_of(st.none(), st.floats(0.0, 3.0)), min_size=1, max_size=60)


def test_one_approach_is_one_incursion() -> None:
    time = [0.1 * k for k in range(101)]
    values = [abs(t - 5.0) + 0.3 for t in time]
    (one,) = incursions(time, {"left|right": values}, SLOW)
    assert math.isclose(one.least, 0.3)
    assert math.isclose(one.at, 5.0)
    assert one.start >= 4.5 - 1e-9
    assert one.end <= 5.5 + 1e-9
    assert not one.open


def test_unknown_within_makes_it_open_and_short_gaps_join() -> None:
    time = [float(k) for k in range(8)]
    values = [2.0, 0.5, None, 2.0, 2.0, 0.7, 2.0, 2.0]
    first, second = incursions(time, {"a|b": values}, SLOW)
    assert first.open
    assert not second.open
    (joined,) = incursions(time, {"a|b": values}, SLOW, joined=5.0)
    assert (joined.start, joined.end, joined.least) == (1.0, 5.0, 0.5)


@given(VALUES)
def test_every_low_value_is_in_exactly_one_incursion(values: list[float | None]) -> None:
    time = [2.0 * k for k in range(len(values))]
    found = incursions(time, {"a|b": values}, SLOW)
    for t, value in zip(time, values, strict=True):
        holding = [one for one in found if one.start <= t <= one.end]
        assert len(holding) == (1 if value is not None and value < SLOW else 0)
    for one in found:
        assert one.least == min(
            v for t, v in zip(time, values, strict=True) if one.start <= t <= one.end
        )  # type: ignore[type-var]
