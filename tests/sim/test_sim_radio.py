"""The radio: batches leave on time, nothing is lost or overtakes, the whole delay is kept."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.shell.sim.radio import OnAir, Radio, arrival_time, receive, send

SUN = Radio(0.040, 0.100)


def test_sun_hardware():
    """A batch every 40 ms; the oldest is 100 ms old on arrival, the newest 60 ms."""
    stamps = [i * 0.005 for i in range(1, 4001)]
    arrivals = [arrival_time(s, SUN) for s in stamps]
    ages = [a - s for a, s in zip(arrivals, stamps, strict=True)]
    assert min(ages) == pytest.approx(0.060, abs=1e-6)
    assert max(ages) == pytest.approx(0.095, abs=1e-6)  # sampling every 5 ms: 35 ms of waiting
    batches = sorted({round(a, 6) for a in arrivals})
    assert len(batches) == 4000 // 8
    assert {round(b - a, 6) for a, b in pairwise(batches)} == {0.040}


@given(
    st.floats(1.7e9, 1.8e9),
    st.sampled_from([0.0, 0.02, 0.04, 0.1]),
    st.floats(0.0, 0.5),
    st.floats(0.0, 0.2),
)
def test_age_is_within_the_stated_delay(stamp, period, latency, later):
    radio = Radio(period, latency)
    age = arrival_time(stamp, radio) - stamp
    least = max(latency - period, 0.0) if period else latency
    assert least - 2e-6 <= age <= max(latency, period) + 2e-6
    assert arrival_time(stamp + later, radio) >= arrival_time(stamp, radio) - 1e-6


@given(st.lists(st.floats(0.0, 0.05), min_size=1, max_size=60), st.floats(0.001, 0.2))
def test_everything_arrives_once_and_in_order(gaps, every):
    on_air: tuple[OnAir[int], ...] = ()
    got: list[int] = []
    t, next_look = 100.0, 100.0
    for i, gap in enumerate(gaps):
        t += gap
        on_air = send(on_air, t, i, SUN)
        if t >= next_look:
            arrived, on_air = receive(on_air, t)
            got += arrived
            next_look = t + every
    arrived, rest = receive(on_air, t + 1.0)
    assert got + list(arrived) == list(range(len(gaps)))
    assert rest == ()


def test_nothing_arrives_early():
    on_air = send((), 10.01, "m", SUN)
    due = arrival_time(10.01, SUN)
    assert receive(on_air, due - 1e-4) == ((), on_air)
    assert receive(on_air, due) == (("m",), ())


def test_bad_radio():
    for bad in (-0.1, math.inf, math.nan):
        with pytest.raises(ValueError, match="0 s or more"):
            Radio(bad, 0.1)
        with pytest.raises(ValueError, match="0 s or more"):
            Radio(0.04, bad)
