"""Velocity scaling, the partner concern, the arbiter and the alarms' delays."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.safety import alarms, partner
from backend.safety.arbiter import arbitrate
from backend.safety.partner import Limits, Proximity, judge
from backend.safety.record import Concern, Level
from backend.safety.scaling import allowed_speeds, linear

LIMITS = Limits(slow_below=0.8, stop_below=0.2)


def proximity(margin: float, gradient: list[float], closing: float = 0.0) -> Proximity:
    return Proximity(
        "left:bucket/0", "right:boom/1", margin + 0.1, margin, np.zeros((2, 3)),
        np.array(gradient), 0.0, closing,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("distance", "fraction"), [(0.1, 0.0), (0.2, 0.0), (0.5, 0.5), (0.8, 1.0), (3.0, 1.0)]
)
def test_linear_scaling_of_makinen(distance: float, fraction: float) -> None:
    assert linear(distance, 0.2, 0.8) == pytest.approx(fraction)


def test_scaling_of_what_is_not_a_number_is_a_stop() -> None:
    assert linear(np.array([math.nan, math.inf]), 0.2, 0.8)[0] == 0.0


def test_zero_width_band_is_refused() -> None:
    with pytest.raises(ValueError, match="must exceed"):
        linear(0.5, 0.8, 0.8)


def test_only_the_approaching_direction_is_limited() -> None:
    concern = judge("left", 4, (proximity(0.5, [-1.0, 2.0, 0.0, 1e-5]),), LIMITS, 0.0)
    assert concern.level is Level.SLOW
    np.testing.assert_allclose(concern.allowed, [[1, 0.5], [0.5, 1], [1, 1], [1, 1]], atol=1e-12)


def test_two_close_pairs_combine_to_the_most_restrictive() -> None:
    concern = judge("left", 1, (proximity(0.5, [-1.0]), proximity(0.3, [1.0])), LIMITS, 0.0)
    np.testing.assert_allclose(concern.allowed, [[1 / 6, 0.5]])


@given(st.floats(-0.5, 3), st.floats(0, 1))
def test_closer_is_never_freer(margin: float, less: float) -> None:
    far = judge("left", 1, (proximity(margin, [-1.0]),), LIMITS, 0.0)
    near = judge("left", 1, (proximity(margin - less, [-1.0]),), LIMITS, 0.0)
    assert near.level >= far.level
    assert (near.allowed <= far.allowed).all()


def test_time_to_contact_is_distance_over_closing_speed() -> None:
    concern = judge("left", 1, (proximity(0.4, [-1.0], closing=0.25),), LIMITS, 0.0)
    assert concern.evidence is not None
    assert concern.evidence.time_to_contact == pytest.approx(2.0)


def test_a_machine_without_any_record_may_not_move() -> None:
    level, allowed, travel = arbitrate((), "left", 4)
    assert level is Level.UNKNOWN
    assert not allowed.any()
    assert not travel.any()


def test_the_severest_concern_wins() -> None:
    clear = judge("left", 2, (), LIMITS, 0.0)
    blind = partner.unknown("left", 2, "RIGHT position is 0.6 s old", 0.0)
    level, allowed, _ = arbitrate((clear, blind), "left", 2)
    assert level is Level.UNKNOWN
    assert not allowed.any()


def concern_at(level: Level, now: float) -> Concern:
    margin = {Level.SLOW: 0.5, Level.STOP: 0.1, Level.CLEAR: 2.0}[level]
    return judge("left", 1, (proximity(margin, [-1.0]),), LIMITS, now)


def test_slow_sounds_after_0_3_s_and_ends_after_1_s() -> None:
    now: tuple[alarms.Alarm, ...] = ()
    active = []
    for k in range(100):
        t = k * 0.02
        level = Level.SLOW if t < 0.5 else Level.CLEAR
        now = alarms.update(now, (concern_at(level, t),), t)
        active.append(bool(now) and now[0].active)
    assert not any(active[:15])
    assert all(active[16:73])
    assert not any(active[76:])


def test_stop_sounds_at_once_and_comes_first() -> None:
    slow = concern_at(Level.SLOW, 0.0)
    stop = partner.unknown("right", 1, "blind", 0.0)
    now = alarms.update((), (slow, stop), 0.0)
    assert [a.concern.machine for a in now] == ["right", "left"]
    assert now[0].active
    assert not now[1].active


def test_a_flicker_of_slow_never_sounds() -> None:
    now: tuple[alarms.Alarm, ...] = ()
    for k in range(50):
        level = Level.SLOW if k % 10 < 3 else Level.CLEAR
        now = alarms.update(now, (concern_at(level, k * 0.1),), k * 0.1)
        assert not any(a.active for a in now)


def test_allowed_speeds_of_no_pair_is_free() -> None:
    np.testing.assert_array_equal(allowed_speeds(np.zeros((0, 3)), np.zeros(0)), np.ones((3, 2)))
