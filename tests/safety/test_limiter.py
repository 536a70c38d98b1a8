"""The limiter's rules, each with a test that fails without it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.machine.load import load_machine
from backend.safety import partner
from backend.safety.approach import SHARE, Approach
from backend.safety.braking import (
    accelerations,
    braking_speed,
    full_speeds,
    stopping_distance,
)
from backend.safety.limiter import (
    LOCKED_ABOVE,
    OVERRIDE_FRACTION,
    STANDING,
    Decision,
    Latch,
    Override,
    Wish,
    limit,
    open_latch,
)
from backend.safety.limits import STALE, Delay
from backend.safety.record import Concern, Level

MACHINE = load_machine("mini")
N, M = len(MACHINE.joints), len(MACHINE.joints) + 2
Q = np.array([0.0, 0.3, -1.2, -0.4])
FULL, A = full_speeds(MACHINE), accelerations(MACHINE)
DELAY = Delay(up=0.1, round_trip=0.2)
AGE = 0.1
T = DELAY.total(N, AGE)
SUE = Override("sue", "supervisor", "the sensor mast is bent")


def approach(*rows, rates=None) -> Approach:
    """rows: (room, {motion: slope}, closing, {(k, l): bend})."""
    r = len(rows)
    room, closing = np.zeros(r), np.zeros(r)
    slope, bend = np.zeros((r, M)), np.zeros((r, M, M))
    for i, (left, slopes, speed, bends) in enumerate(rows):
        room[i], closing[i] = left, speed
        for k, value in slopes.items():
            slope[i, k] = value
        for (k, after), value in bends.items():
            bend[i, k, after] = bend[i, after, k] = value
    return Approach(
        np.zeros((r, 2), np.int64), ("bucket/0",), ("right:boom/1",), room, slope, bend, closing,
        np.zeros(M) if rates is None else np.asarray(rates, float), AGE,
    )  # fmt: skip


def row(room: float, slopes: dict, closing: float = 0.0, bends: dict | None = None):
    return room, slopes, closing, bends or {}


def concern(part: Approach | None = None, level=Level.CLEAR, allowed=None, travel=None, name="p"):
    return Concern(
        name, "left", level, "why", np.ones((N, 2)) if allowed is None else np.array(allowed),
        np.ones(2) if travel is None else np.array(travel), None, 0.0, part,
    )  # fmt: skip


def wished(wish: dict) -> Wish:
    w = np.zeros(M)
    for k, value in wish.items():
        w[k] = value * FULL[k]
    return Wish(w[:N], w[N:])


def decide(
    wish, *concerns, latch=None, delay=DELAY, now=0.0, q=Q, override=None, sticks=None
) -> Decision:
    return limit(
        *("left", MACHINE, q, wished(wish), concerns, delay),
        *(latch or open_latch(MACHINE), now, override),
        None if sticks is None else wished(sticks),
    )


def speed(decision: Decision) -> np.ndarray:
    return np.concatenate([decision.joints, decision.tracks])


ALL = dict.fromkeys(range(M), 1.0)
FREE = concern(approach())


def test_nothing_near_is_full_speed() -> None:
    np.testing.assert_allclose(speed(decide(ALL, FREE)), FULL)
    assert decide(ALL, FREE).free.all()


def test_a_machine_without_a_concern_may_not_move() -> None:
    found = decide(ALL)
    assert not speed(found).any()
    assert found.causes[0][0].concern == "none"
    assert not speed(decide(ALL, replace(FREE, machine="right"))).any()


def test_unknown_and_stale_are_zero() -> None:
    blind = partner.unknown("left", N, "RIGHT position is 0.6 s old", 0.0)
    found = decide(ALL, FREE, blind)
    assert not speed(found).any()
    assert found.causes[0][1].reason == "RIGHT position is 0.6 s old"
    assert not speed(decide(ALL, FREE, now=STALE + 0.01)).any()
    assert not speed(decide(ALL, replace(FREE, time=math.nan))).any()
    assert speed(decide(ALL, FREE, now=STALE)).any()


def test_not_a_number_from_the_sticks_is_a_stop_of_that_stick() -> None:
    found = decide({0: math.nan, 1: 0.5}, FREE)
    assert found.joints[0] == 0.0
    assert found.joints[1] == pytest.approx(0.5 * FULL[1])


def test_the_most_restrictive_concern_wins_per_direction() -> None:
    a = concern(allowed=[[1, 0.5]] + [[1, 1]] * 3, name="a")
    b = concern(allowed=[[0.2, 0.7]] + [[1, 1]] * 3, name="b")
    found = decide({0: 1.0}, a, b)
    np.testing.assert_allclose(found.fraction[0], [0.2, 0.5])
    assert (found.causes[0][0].concern, found.causes[0][1].concern) == ("b", "a")
    assert found.joints[0] == pytest.approx(0.5 * FULL[0])


def test_driving_fractions_limit_both_tracks() -> None:
    found = decide({N: 1.0, N + 1: -1.0}, concern(travel=[0.3, 0.6]))
    np.testing.assert_allclose(found.tracks, [0.6 * FULL[N], -0.3 * FULL[N + 1]])


def test_only_what_approaches_is_limited_and_away_is_free() -> None:
    part = approach(row(0.05, {0: -2.0, 2: 1.0, N: -0.5}))
    found = decide(ALL, concern(part))
    assert found.joints[0] < 0.2 * FULL[0]  # positive swing approaches
    assert found.tracks[0] < FULL[N]
    np.testing.assert_allclose(found.joints[1:], FULL[1:N])
    back = decide({0: -1.0, 2: 1.0, N: -1.0}, concern(part))
    np.testing.assert_allclose(speed(back)[[0, 2, N]], [-FULL[0], FULL[2], -FULL[N]])
    assert back.free[0].tolist() == [True, False]


def test_within_the_distance_to_keep_only_away_is_left() -> None:
    part = approach(row(-0.1, {0: -2.0}))
    assert decide({0: 1.0}, concern(part)).joints[0] == 0.0
    assert decide({0: -1.0}, concern(part)).joints[0] == -FULL[0]


def used(v: float, k: int, c: float, b: float = 0.0) -> float:
    s = v * T[k] + v * v / (2 * A[k])
    return c * s + 0.5 * b * s * s


@given(st.integers(0, M - 1), st.floats(0.01, 5.0), st.floats(0.01, 4.0), st.floats(0.0, 4.0))
def test_one_motion_stops_within_its_share(k: int, room: float, c: float, b: float) -> None:
    part = approach(row(room, {k: -c}, 0.0, {(k, k): -b}))
    v = speed(decide({k: 1.0}, concern(part)))[k]
    assert used(v, k, c, b) <= SHARE * room + 1e-9
    if v == 0.0:  # what would be slower than this stands
        assert used(STANDING * FULL[k], k, c, b) >= SHARE * room - 1e-6
    elif v < FULL[k] * (1 - 1e-9):  # not slower than needed
        assert used(v, k, c, b) >= SHARE * room - 1e-6


@given(st.integers(0, M - 1), st.floats(0.05, 5.0), st.floats(0.0, 3.0))
def test_the_partner_keeps_its_speed_while_this_machine_brakes(k, room, w) -> None:
    part = approach(row(room, {k: -1.0}, w))
    v = speed(decide({k: 1.0}, concern(part)))[k]
    if v > 0.0:
        assert used(v, k, 1.0) + w * (T[k] + v / A[k]) <= room + 1e-9


@settings(max_examples=200)
@given(
    st.lists(st.floats(-3.0, 3.0), min_size=M, max_size=M),
    st.lists(st.floats(-1.0, 1.0), min_size=M, max_size=M),
    st.floats(0.0, 4.0),
    st.floats(0.0, 2.0),
)
def test_motions_at_once_share_the_room(slopes, wish, room, w) -> None:
    part = approach(row(room, dict(enumerate(slopes)), w))
    found = decide(dict(enumerate(wish)), concern(part))
    got = speed(found)
    asked = np.array(wish) * FULL
    assert (np.abs(got) <= np.abs(asked) + 1e-12).all()
    assert (got * asked >= 0.0).all()
    toward = np.maximum(-np.array(slopes) * np.sign(got), 0.0)
    total = float(toward @ stopping_distance(got, T, A))
    assert total <= SHARE * room + 2e-3 * M
    if w > 0.0 and total > 2e-3 * M:
        counted = np.where(toward > 1e-3, toward, 0.0) * stopping_distance(got, T, A) > 1e-4
        slowest = max((T + np.abs(got) / A)[counted], default=0.0)
        assert total + w * slowest <= room + 2e-3 * M
    away = np.array(slopes) * np.sign(asked) >= 0.0
    np.testing.assert_allclose(got[away], asked[away])


@given(st.floats(0.0, 3.0), st.floats(0.0, 1.0))
def test_closer_is_never_faster(room: float, less: float) -> None:
    slopes = {0: -2.0, 1: -1.0, N: 0.5}
    far = decide(ALL, concern(approach(row(room, slopes))))
    near = decide(ALL, concern(approach(row(room - less, slopes))))
    assert (speed(near) <= speed(far) + 1e-9).all()
    assert (near.fraction <= far.fraction + 1e-9).all()


@given(st.floats(0.0, 0.3), st.floats(0.0, 0.3))
def test_a_longer_delay_is_never_faster(up: float, age: float) -> None:
    part = approach(row(0.6, {0: -2.0, 1: -1.0}))
    short = speed(decide(ALL, concern(part), delay=Delay(up, 0.3)))
    long = speed(decide(ALL, concern(part), delay=Delay(up + 0.1, 0.3)))
    old = speed(decide(ALL, concern(replace(part, age=AGE + age)), delay=Delay(up, 0.3)))
    assert (long <= short + 1e-12).all()
    assert (old <= short + 1e-12).all()


def test_a_swing_that_starts_sideways_and_comes_closer_is_seen() -> None:
    """Slope 0, but half a metre nearer after a radian: the bend counts."""
    part = approach(row(0.3, {}, 0.0, {(0, 0): -3.0}))
    assert decide({0: 1.0}, concern(part)).joints[0] < 0.7 * FULL[0]
    assert decide({0: -1.0}, concern(part)).joints[0] > -0.7 * FULL[0]


@given(st.floats(-0.5, 0.5), st.floats(0.0, 2.0), st.floats(0.0, 4.0))
def test_moving_away_is_free_however_the_partner_comes(room, w, b) -> None:
    """At full speed as long as the stop still ends farther away; else as far as it moves away."""
    part = approach(row(room, {0: 2.0}, w, {(0, 0): -b}))
    v = decide({0: 1.0}, concern(part)).joints[0]
    s = v * T[0] + v * v / (2 * A[0])
    full = FULL[0] * T[0] + FULL[0] ** 2 / (2 * A[0])
    assert s >= min(full, 0.99 * 2 * 2.0 / max(b, 1e-9))
    assert -2.0 * s + 0.5 * b * s * s <= max(SHARE * room, 0.0) + 1e-3


def test_two_joints_together_come_closer_than_each_alone() -> None:
    part = approach(row(1.0, {0: -0.5, 1: -0.5}, 0.0, {(0, 1): -4.0}))
    alone = decide({0: 1.0}, concern(part)).joints[0]
    both = decide({0: 1.0, 1: 1.0}, concern(part)).joints[0]
    assert both < 0.8 * alone


def test_what_still_coasts_uses_room_too() -> None:
    """The boom still falls at full speed while the operator now swings."""
    rates = np.zeros(M)
    rates[1] = FULL[1]
    rows = row(1.0, {0: -1.0, 1: -1.0})
    calm = decide({0: 1.0}, concern(approach(rows))).joints[0]
    busy = decide({0: 1.0}, concern(approach(rows, rates=rates))).joints[0]
    assert busy < 0.8 * calm
    # Its own motion in the wished direction is not counted twice.
    swinging = np.zeros(M)
    swinging[0] = calm
    again = decide({0: 1.0}, concern(approach(rows, rates=swinging))).joints[0]
    assert again == pytest.approx(calm, rel=1e-6)


def test_ends_of_travel_have_cushions() -> None:
    near = Q.copy()
    near[1] = MACHINE.upper[1] - math.radians(3.0)
    found = decide({1: 1.0}, FREE, q=near)
    v = found.joints[1]
    assert 0.0 < v < 0.5 * FULL[1]
    assert v * T[1] + v * v / (2 * A[1]) <= math.radians(2.5) + 1e-9
    assert found.causes[1][1].concern == "end"
    assert decide({1: -1.0}, FREE, q=near).joints[1] == -FULL[1]
    near[1] = MACHINE.upper[1]
    stopped = decide({1: 1.0}, FREE, q=near)
    assert stopped.joints[1] == 0.0
    assert not stopped.latch.shut.any()  # an end is nothing to approach


def test_brought_to_zero_needs_neutral_to_approach_again() -> None:
    blocked = concern(approach(row(0.0, {0: -2.0})))
    first = decide({0: 1.0, 1: 1.0}, blocked)
    assert first.latch.shut[0].tolist() == [False, True]
    held = decide({0: 1.0}, FREE, latch=first.latch)  # the way is free again
    assert held.joints[0] == 0.0
    assert held.causes[0][1].concern == "neutral"
    assert decide({0: 1.0}, FREE, latch=held.latch).joints[0] == 0.0
    assert decide({0: -1.0}, FREE, latch=held.latch).joints[0] == -FULL[0]  # away
    neutral = decide({}, FREE, latch=held.latch)
    assert not neutral.latch.shut.any()
    assert decide({0: 1.0}, FREE, latch=neutral.latch).joints[0] == FULL[0]


def test_a_wish_that_was_shaped_to_zero_is_no_neutral() -> None:
    blocked = concern(approach(row(0.0, {0: -2.0})))
    first = decide({0: 0.5}, blocked, sticks={0: 1.0})
    assert first.latch.shut[0].tolist() == [False, True]
    shaped = decide({}, FREE, latch=first.latch, sticks={0: 1.0})
    assert shaped.latch.shut[0].tolist() == [False, True]
    assert decide({0: 0.5}, FREE, latch=shaped.latch, sticks={0: 1.0}).joints[0] == 0.0
    assert not decide({}, FREE, latch=first.latch, sticks={}).latch.shut.any()
    # Nor is it a stop of the limiter's.
    assert not decide({}, blocked, sticks={0: 1.0}).latch.shut.any()


def test_slowed_but_moving_does_not_latch() -> None:
    slowed = decide({0: 1.0}, concern(approach(row(0.5, {0: -2.0}))))
    assert 0.0 < slowed.joints[0] < FULL[0]
    assert not slowed.latch.shut.any()


def test_blindness_latches_what_was_asked_for() -> None:
    blind = decide({0: 1.0}, partner.unknown("left", N, "blind", 0.0))
    assert blind.latch.shut[0].tolist() == [False, True]


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.booleans()), max_size=20),
)
def test_a_latched_direction_never_moves_before_neutral(steps) -> None:
    latch: Latch | None = None
    shut = False
    for stick, blocked in steps:
        part = approach(row(0.0, {0: -2.0})) if blocked else approach()
        found = decide({0: stick}, concern(part), latch=latch)
        latch = found.latch
        if stick <= 0.0:
            shut = False
        elif shut:
            assert found.joints[0] == 0.0
        if stick > 0.0 and found.joints[0] == 0.0:
            shut = True


def test_an_override_is_explicit_slow_and_a_supervisors() -> None:
    blocked = concern(approach(row(0.0, {0: -2.0})))
    blind = partner.unknown("left", N, "blind", 0.0)
    found = decide(ALL, blocked, blind, override=SUE)
    assert found.override is SUE
    np.testing.assert_allclose(speed(found), OVERRIDE_FRACTION * FULL)
    assert OVERRIDE_FRACTION <= 0.2
    assert decide(ALL, blocked, blind).override is None
    assert not speed(decide(ALL, blocked, blind)).any()  # let go: as before
    for bad in (("sue", "operator", "why"), ("sue", "supervisor", " "), ("", "supervisor", "why")):
        with pytest.raises(ValueError):
            Override(*bad)


def test_an_override_does_not_lift_ends_or_the_lock() -> None:
    end = Q.copy()
    end[1] = MACHINE.upper[1]
    assert decide({1: 1.0}, FREE, q=end, override=SUE).joints[1] == 0.0
    late = Delay(0.3, LOCKED_ABOVE + 0.01)
    assert not speed(decide(ALL, FREE, delay=late, override=SUE)).any()


def test_long_round_trips_lock_motion_and_say_so() -> None:
    found = decide(ALL, FREE, delay=Delay(0.3, 0.6))
    assert not speed(found).any()
    assert found.locked == "round trip 600 ms: motion is locked above 400 ms"
    assert found.causes[0][0].concern == "link"
    assert not decide(ALL, FREE, delay=Delay(0.2, 0.4)).locked
    assert decide(ALL, FREE, delay=Delay(0.2, math.nan)).locked


@given(st.floats(0.0, 10.0), st.floats(0.0, 1.0), st.floats(0.1, 5.0))
def test_braking_speed_is_the_root(distance: float, delay: float, a: float) -> None:
    v = float(braking_speed(np.array(distance), delay, np.array(a)))
    assert v * delay + v * v / (2 * a) == pytest.approx(distance, rel=1e-6, abs=1e-9)
