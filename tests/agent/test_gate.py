"""What an agent obeys, in the table's words: commands, tokens, sequences, limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.control.lease import TERM, Kind, Request
from backend.machine.load import load_machine
from backend.shell.agent.gate import (
    LIMITS_TIME_TO_LIVE,
    TIME_TO_LIVE,
    Gate,
    demand,
    hear,
    hear_limits,
    names_of,
    negotiate,
)
from backend.shell.link.messages import Command, MotionLimits

MACHINE = load_machine("mini")
N = len(MACHINE.joints)
STILL = np.zeros(N), np.zeros(2)
NAMES = tuple(joint.name for joint in MACHINE.joints)
FULL = tuple(float(v) for v in MACHINE.max_velocity)
FOREVER = 10.0  # a step long enough to reach any speed [s]


def leased(now: float = 0.0, gate: Gate | None = None, who: str = "ann") -> Gate:
    gate, answer = negotiate(gate or Gate(), Request(Kind.REQUEST, who), now)
    assert answer.granted
    return gate


def command(sequence=1, token=1, velocity=FULL, names=NAMES, ttl=0.2, travel=(0.0, 0.0), who="ann"):
    return Command(
        "left", 0.0, 0.0, sequence, ttl, who, token, tuple(names), np.array(velocity), *travel
    )


def limits(fraction=1.0, sequence=1, token=1, ttl=0.3, names=None):
    names = names_of(MACHINE) if names is None else names
    values = np.full(len(names), fraction) if np.isscalar(fraction) else np.asarray(fraction)
    both = values if values.ndim == 2 else np.stack([values, values], axis=1)
    return MotionLimits("left", 0.0, 0.0, sequence, ttl, token, names, both[:, 0], both[:, 1])


def driven(said=None, free=None, now: float = 0.0) -> Gate:
    gate = hear(leased(now), said or command(), MACHINE, now)
    return hear_limits(gate, free or limits(), MACHINE, now)


def test_a_fresh_command_with_fresh_limits_is_obeyed() -> None:
    joints, tracks = demand(driven(command(travel=(0.2, -0.1))), MACHINE, STILL, 0.1, FOREVER)
    np.testing.assert_allclose(joints, FULL)
    np.testing.assert_allclose(tracks, [0.2, -0.1])


def test_silence_is_a_stop_within_a_quarter_of_a_second() -> None:
    assert TIME_TO_LIVE <= 0.2
    for gate in (driven(), driven(command(ttl=60.0))):
        assert demand(gate, MACHINE, STILL, 0.19, FOREVER)[0].any()
        for now in (TIME_TO_LIVE, 0.25, 1e6):
            joints, tracks = demand(gate, MACHINE, STILL, now, FOREVER)
            assert not joints.any()
            assert not tracks.any()


def test_a_short_time_to_live_holds() -> None:
    assert not demand(driven(command(ttl=0.05)), MACHINE, STILL, 0.06, FOREVER)[0].any()


def test_without_limits_or_with_old_ones_nothing_is_free() -> None:
    gate = hear(leased(), command(), MACHINE, 0.0)
    assert not demand(gate, MACHINE, STILL, 0.0, FOREVER)[0].any()
    gate = hear_limits(gate, limits(ttl=60.0), MACHINE, 0.0)
    later = LIMITS_TIME_TO_LIVE + 0.01
    gate = hear(gate, command(2), MACHINE, later)
    assert gate.obeys(later)
    assert not demand(gate, MACHINE, STILL, later, FOREVER)[0].any()


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        (command(5), "replayed"),
        (command(4), "replayed"),
        (command(6, token=0), "token"),
        (command(6, token=7), "foreign"),
        (command(6, who="bob"), "foreign"),
        (command(6, velocity=(math.nan,) * N), "unsound"),
        (command(6, velocity=(math.inf,) * N), "unsound"),
        (command(6, ttl=0.0), "unsound"),
        (command(6, ttl=math.nan), "unsound"),
        (command(6, ttl=math.inf), "unsound"),
        (command(6, velocity=(0.1,), names=("wing",)), "unsound"),
        (command(6, travel=(math.nan, 0.0)), "unsound"),
    ],
)
def test_what_is_refused_is_counted_and_changes_nothing(bad: Command, why: str) -> None:
    gate = hear(leased(), command(5), MACHINE, 0.0)
    after = hear(gate, bad, MACHINE, 0.1)
    assert dict(after.refusals) == {why: 1}
    assert after.command is gate.command
    assert after.heard_at == gate.heard_at
    assert hear(after, command(6), MACHINE, 0.1).accepted == 2


def test_an_expired_token_is_refused_and_what_it_said_forgotten() -> None:
    gate = driven(now=TERM - 0.05)
    late = replace(gate, lease=replace(gate.lease, expires=TERM))
    assert demand(late, MACHINE, STILL, TERM - 0.01, FOREVER)[0].any()
    assert not demand(late, MACHINE, STILL, TERM, FOREVER)[0].any()
    assert dict(hear(late, command(2), MACHINE, TERM).refusals) == {"token": 1}


def test_a_new_holder_stops_what_the_old_one_said() -> None:
    gate = driven()
    request = Request(Kind.TAKE_OVER, "sue", "supervisor", reason="drill")
    gate, answer = negotiate(gate, request, 0.05)
    assert not demand(gate, MACHINE, STILL, 0.06, FOREVER)[0].any()
    assert hear(gate, command(2), MACHINE, 0.06).refused == 1
    gate = hear(gate, command(1, token=answer.token, who="sue"), MACHINE, 0.06)
    assert gate.accepted == 2
    # The old holder's limits do not count for the new one.
    assert not demand(gate, MACHINE, STILL, 0.06, FOREVER)[0].any()


@pytest.mark.parametrize(
    "bad",
    [
        limits(1.5, 2),
        limits(-0.1, 2),
        limits(math.nan, 2),
        limits(1.0, 1),
        limits(1.0, 2, token=9),
        limits(1.0, 2, ttl=0.0),
        limits(1.0, 2, names=("wing",)),
        limits(1.0, 2, names=("swing", "swing_joint")),
    ],
)
def test_limits_that_make_no_sense_are_refused(bad: MotionLimits) -> None:
    gate = hear_limits(leased(), limits(0.5), MACHINE, 0.0)
    after = hear_limits(gate, bad, MACHINE, 0.1)
    assert after.refused == 1
    assert after.limits is gate.limits
    assert after.limits_at == gate.limits_at


def test_what_limits_do_not_name_stands() -> None:
    gate = driven(command(travel=(0.3, 0.3)), limits(1.0, names=("boom", "track_left")))
    joints, tracks = demand(gate, MACHINE, STILL, 0.0, FOREVER)
    assert np.flatnonzero(joints).tolist() == [1]
    assert tracks.tolist() == [0.3, 0.0]


unit = st.floats(0.0, 1.0)


@given(
    st.lists(st.tuples(unit, unit), min_size=N + 2, max_size=N + 2),
    st.lists(st.floats(-3.0, 3.0), min_size=N + 2, max_size=N + 2),
    st.lists(st.floats(-0.5, 0.5), min_size=N + 2, max_size=N + 2),
    st.floats(0.001, 0.1),
)
def test_demands_keep_to_every_limit(fractions, wish, last, dt) -> None:
    said = command(velocity=wish[:N], travel=tuple(wish[N:]))
    gate = driven(said, limits(fractions))
    before = np.array(last)
    joints, tracks = demand(gate, MACHINE, (before[:N], before[N:]), 0.0, dt)
    got = np.concatenate([joints, tracks])
    full = np.append(MACHINE.max_velocity, [MACHINE.tracks.max_speed] * 2)
    rise = np.append(MACHINE.max_acceleration, [MACHINE.tracks.max_acceleration] * 2) * dt
    f = np.array(fractions)
    assert (got <= f[:, 1] * full + 1e-12).all()
    assert (got >= -f[:, 0] * full - 1e-12).all()
    assert (np.abs(got) <= np.abs(wish) + 1e-12).all()
    assert (got * np.array(wish) >= 0.0).all()
    assert (np.abs(got) <= np.maximum(np.abs(before), 0.0) + rise + 1e-12).all()


def test_ten_thousand_replays_are_refused_to_the_last() -> None:
    rng = np.random.default_rng(1)
    gate, said = leased(), []
    for k in range(1, 101):
        said.append(command(k))
        gate = hear(gate, said[-1], MACHINE, 0.0)
    for k in rng.integers(0, 100, 10_000):
        gate = hear(gate, said[k], MACHINE, 0.5)
    assert (gate.accepted, gate.refused) == (100, 10_000)


def test_two_operators_race_for_one_machine_and_never_overlap() -> None:
    """10,000 races through the gate: a command is accepted from the newest token only."""
    rng = np.random.default_rng(2)
    overlaps = accepted = 0
    for _ in range(10_000):
        gate, now, tokens = Gate(), 0.0, {"ann": 0, "bob": 0}
        good: set[str] = set()
        for _ in range(3):
            who = ("ann", "bob")[rng.integers(2)]
            now += (0.0, 0.3, 1.2)[rng.integers(3)]
            gate, answer = negotiate(gate, Request(Kind.REQUEST, who), now)
            tokens[who] = answer.token or tokens[who]
            good = set()
            for name, token in tokens.items():
                after = hear(gate, command(gate.accepted + 1, token, who=name), MACHINE, now)
                if after.accepted > gate.accepted:
                    good.add(name)
            accepted += len(good)
            overlaps += len(good) > 1
    assert overlaps == 0
    assert accepted == 30_000  # somebody is always in control here
