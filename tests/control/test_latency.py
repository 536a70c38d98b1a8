"""Round trips: what they are called, when motion is locked, and when it is opened again."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.control.latency import (
    OPEN_BELOW,
    SETTLED,
    SILENT,
    Condition,
    Link,
    Trip,
    condition,
    measured,
)
from backend.safety.limiter import LOCKED_ABOVE


def after(*seconds: float, start: float = 0.0) -> tuple[Link, float]:
    """The link after answers 0.1 s apart, and the time of the last."""
    link, at = Link(), start
    for one in seconds:
        at += 0.1
        link = measured(link, Trip(at, one))
    return link, at


def test_a_machine_that_never_answered_is_locked() -> None:
    found = condition(Link(), 5.0)
    assert not found.known
    assert found.level == "unknown"
    assert found.locked


@pytest.mark.parametrize(
    ("seconds", "level"), [(0.05, "ok"), (0.15, "slow"), (0.3, "bad"), (0.41, "locked")]
)
def test_levels(seconds: float, level: str) -> None:
    found = condition(*after(seconds))
    assert found.level == level
    assert found.round_trip == seconds
    assert bool(found.locked) == (level == "locked")


def test_silence_locks() -> None:
    link, at = after(0.05)
    assert condition(link, at + SILENT - 1e-6).level == "ok"
    silent = condition(link, at + SILENT + 1e-6)
    assert not silent.known
    assert "0.6 s" in silent.locked


def test_one_long_trip_locks_until_all_were_short_for_a_while() -> None:
    short = [0.1] * round(SETTLED / 0.1)
    link, at = after(0.1, LOCKED_ABOVE + 0.01, *short)
    assert condition(link, at).locked
    link = measured(link, Trip(at + 0.1, 0.1))
    assert not condition(link, at + 0.1).locked
    # A trip of no worry but above the lower bound begins the wait anew.
    link, at = after(0.1, LOCKED_ABOVE + 0.01, *short[1:], OPEN_BELOW, *short)
    assert condition(link, at).locked


def test_the_longest_of_the_last_trips_counts() -> None:
    link, at = after(0.2, 0.05, 0.06)
    assert condition(link, at).round_trip == 0.2
    assert condition(link, at).level == "slow"


@given(st.lists(st.floats(-1.0, 2.0) | st.just(math.nan), min_size=1, max_size=40))
def test_what_is_not_short_for_sure_is_never_called_good(seconds: list[float]) -> None:
    link, at = after(*seconds)
    found: Condition = condition(link, at)
    recent = seconds[-int(SETTLED / 0.1) :]
    if any(not 0.0 <= s <= LOCKED_ABOVE for s in recent):
        assert found.locked
    if found.level == "ok":
        assert all(0.0 <= s < 0.1 for s in recent)
