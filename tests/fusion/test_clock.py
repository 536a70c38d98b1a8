from __future__ import annotations

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.fusion.clock import DRIFT, MAX_SAMPLES, WINDOW, Clock, update
from backend.fusion.samples import ClockSample

delay = st.floats(0.0, 0.2)


def trip(t: float, offset: float, out: float = 0.001, back: float = 0.001) -> ClockSample:
    return ClockSample("left", t, t + out - offset, t + out + back)


@given(
    offset=st.floats(-5.0, 5.0),
    delays=st.lists(st.tuples(delay, delay), min_size=1, max_size=40),
    drift=st.floats(-0.9 * DRIFT, 0.9 * DRIFT),
)
@settings(max_examples=60, deadline=None)
def test_bounds_hold_the_truth_whatever_the_delays(
    offset: float, delays: list[tuple[float, float]], drift: float
) -> None:
    clock = Clock()
    for k, (out, back) in enumerate(delays):
        t = 0.7 * k
        clock = update(clock, trip(t, offset + drift * (t + out), out, back))
        now = t + out + back
        bounds = clock.offset(now)
        assert bounds is not None
        assert bounds[0] - 1e-9 <= offset + drift * now <= bounds[1] + 1e-9
    assert clock.stepped == -math.inf


def test_more_trips_are_never_less_certain_than_the_best() -> None:
    generator = random.Random(2)
    clock = Clock()
    for k in range(15):
        out, back = generator.expovariate(20.0), generator.expovariate(20.0)
        clock = update(clock, trip(0.5 * k, 3.0, out, back))
    bounds = clock.offset(7.5)
    assert bounds is not None
    widths = [t.upper - t.lower + 2 * DRIFT * (7.5 - t.at) for t in clock.trips]
    assert bounds[1] - bounds[0] <= min(widths) + 1e-9


@pytest.mark.parametrize("jump", [5.0, -5.0, 0.05, -0.05])
def test_a_step_is_flagged_by_the_next_round_trip(jump: float) -> None:
    clock = Clock()
    for k in range(10):
        clock = update(clock, trip(0.5 * k, 1.0))
    assert clock.stepped == -math.inf
    clock = update(clock, trip(5.0, 1.0 + jump))
    assert clock.stepped == pytest.approx(5.002)
    bounds = clock.offset(5.002)
    assert bounds is not None
    assert bounds[0] <= 1.0 + jump <= bounds[1]


def test_an_old_estimate_is_none() -> None:
    clock = update(Clock(), trip(0.0, 1.0))
    assert clock.offset(WINDOW) is not None
    assert clock.offset(WINDOW + 0.1) is None
    assert Clock().offset(0.0) is None


@pytest.mark.parametrize(
    "sample",
    [
        ClockSample("left", math.nan, 0.0, 1.0),
        ClockSample("left", 0.0, math.inf, 1.0),
        ClockSample("left", 0.0, 1e308, 1.0),
        ClockSample("left", 1.0, 0.0, 0.5),
        ClockSample("left", 0.0, 0.0, 60.0),
    ],
)
def test_impossible_trips_are_counted(sample: ClockSample) -> None:
    clock = update(Clock(), sample)
    assert (clock.rejected, clock.trips) == (1, ())


def test_repeated_trips_are_rejected_and_memory_is_bounded() -> None:
    clock = update(Clock(), trip(0.0, 1.0))
    clock = update(clock, trip(0.0, 1.0))
    assert clock.rejected == 1
    for k in range(1, 1000):
        clock = update(clock, trip(0.01 * k, 1.0))
    assert len(clock.trips) == MAX_SAMPLES
