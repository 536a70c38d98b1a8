"""A path on which the machine drives, too: arm and tracks in one pace, its base watched."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from backend.control.climb import Climb, Phase
from backend.control.follow import (
    ARRIVED,
    Follow,
    Trajectory,
    advance,
    allowed,
    left_at,
    stands_within,
    taken_up,
)
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make
from backend.spatial.types import Array

MACHINE = load_machine("mini")
DT = 0.02
DEAD = 0.16  # to the machine, and back with what its sensors saw [s]
LAGS = Hydraulics()
FAR = 1.2  # driven [m]
SECONDS = 8.0


def path(yaw: float = 0.7) -> Trajectory:
    """The boom rises and falls by 0.3 rad while the machine drives on by `FAR`."""
    times = np.linspace(0.0, SECONDS, 201)
    u = times / SECONDS
    s = 10 * u**3 - 15 * u**4 + 6 * u**5
    ds = (30 * u**2 - 60 * u**3 + 30 * u**4) / SECONDS
    joints = np.tile([0.0, 0.2, -0.6, -0.4], (len(times), 1))
    joints[:, 1] += 0.3 * np.sin(np.pi * s)
    rates = np.zeros_like(joints)
    rates[:, 1] = 0.3 * np.pi * np.cos(np.pi * s) * ds
    ahead = from_attitude(yaw)[:, 0]
    base = make(from_attitude(yaw), s[:, None] * FAR * ahead)
    return Trajectory(times, joints, rates, np.tile(FAR * ds[:, None], (1, 2)), base)


def drive(
    way: Trajectory,
    seconds: float,
    slip: float = 0.0,
    held: tuple[float, float] = (np.inf, np.inf),
    most: float = np.inf,
    pushed: tuple[float, float] = (np.inf, 0.0),
) -> tuple[Follow, list[SimState], list[float]]:
    """slip: share of what the tracks run that is lost; held: the dead-man is let go between these
    times; most: what a limiter leaves of the tracks [m/s]; pushed: at a time, so far aside [m].
    """
    limits, delay = limits_of(MACHINE), round(0.5 * DEAD / DT)
    yaw = float(np.arctan2(*way.base[0][1::-1, 0])) if way.base is not None else 0.0
    state = SimState(way.joints[0], np.zeros(4), np.zeros(3), yaw, 0.0, 0.0, np.zeros(2))
    commands = deque([(np.zeros(4), np.zeros(2))] * delay, maxlen=delay + 1)
    seen = deque([state] * delay, maxlen=delay + 1)
    follow, states, times = Follow(way), [], []
    lead = LAGS.track_lag - LAGS.joint_lag
    for k in range(round(seconds / DT)):
        t = k * DT
        if abs(t - pushed[0]) < 0.5 * DT:
            aside = from_attitude(state.yaw)[:, 1] * pushed[1]
            state = replace(state, position=state.position + aside)
        seen.append(state)
        then = seen[0]
        moves = not held[0] <= t < held[1]
        follow, wish = advance(
            follow, then.q, DEAD + LAGS.joint_lag, moves, DT, None, then.T_site_root, lead
        )
        tracks = np.clip(follow.tracks, -most, most)
        assert moves or not tracks.any()
        follow = allowed(follow, wish, tracks)
        commands.append((wish, tracks))
        after = step(state, Demand(*commands[0]), limits, LAGS, DT)
        position = state.position + (1.0 - slip) * (after.position - state.position)
        state = replace(after, position=position)
        states.append(state)
        times.append(follow.at)
    return follow, states, times


def beside(way: Trajectory, states: list[SimState], times: list[float]) -> Array:
    """How far each base is from the nearest place on the way [m]."""
    assert way.base is not None
    places = way.base[:, :3, 3]
    return np.array([np.linalg.norm(places - s.position, axis=1).min() for s in states])


def test_arm_and_tracks_arrive_together() -> None:
    way = path()
    follow, states, _ = drive(way, 12.0)
    assert follow.ended == ARRIVED
    assert way.base is not None
    np.testing.assert_allclose(states[-1].position, way.base[-1, :3, 3], atol=0.03)
    # Where the boom is says where the base should be: they never come apart.
    for state in states:
        driven = float(np.linalg.norm(state.position)) / FAR
        rise = 0.2 + 0.3 * np.sin(np.pi * min(driven, 1.0))
        assert abs(state.q[1] - rise) < np.radians(3.5)


def test_let_go_everything_stands_and_goes_on_from_there() -> None:
    way = path()
    _, states, times = drive(way, 6.0, held=(3.0, np.inf))
    for state in states[-40:]:
        np.testing.assert_allclose(state.position, states[-1].position, atol=1e-3)
        assert not state.travel.any() or np.abs(state.travel).max() < 0.01
    assert times[-1] < 4.0
    follow, states, _ = drive(way, 18.0, held=(3.0, 6.0))
    assert follow.ended == ARRIVED
    assert way.base is not None
    np.testing.assert_allclose(states[-1].position, way.base[-1, :3, 3], atol=0.03)


def test_what_is_lost_by_slipping_is_made_up_for() -> None:
    way = path()
    follow, states, _ = drive(way, 14.0, slip=0.15)
    assert follow.ended == ARRIVED
    assert way.base is not None
    far = float(np.linalg.norm(states[-1].position - way.base[-1, :3, 3]))
    assert far < 0.08
    blind = replace(way, base=None)
    _, states, _ = drive(blind, 14.0, slip=0.15)
    driven = float(np.linalg.norm(states[-1].position))
    assert driven == pytest.approx(0.85 * FAR, abs=0.03)


def test_slower_tracks_slow_the_arm() -> None:
    way = path()
    follow, states, times = drive(way, 5.0, most=0.05)
    fast = drive(way, 5.0)[2][-1]
    assert times[-1] < 0.6 * fast
    driven = float(np.linalg.norm(states[-1].position)) / FAR
    assert abs(states[-1].q[1] - (0.2 + 0.3 * np.sin(np.pi * driven))) < np.radians(3.5)
    assert not follow.ended


def test_a_base_that_slips_away_ends_it() -> None:
    follow, states, times = drive(path(), 12.0, pushed=(4.0, 0.14))
    assert follow.ended == "its base is 0.14 m off; plan again"
    np.testing.assert_allclose(states[-1].qd, 0.0, atol=1e-3)
    assert times[-1] < SECONDS
    follow, _, _ = drive(path(), 12.0, slip=0.6)
    assert follow.ended.startswith("its base is 0.10 m off")


def test_a_base_that_pitches_otherwise_ends_it() -> None:
    way, q = path(), path().joints[0]
    assert way.base is not None
    pitched = make(from_attitude(0.7, np.radians(7.0)), np.zeros(3))
    follow, wish = advance(Follow(way), q, 0.2, True, DT, None, pitched)
    assert follow.ended == "its base is 7 degrees off; plan again"
    assert not wish.any()
    assert not follow.tracks.any()


def test_let_go_it_stands_within_half_of_the_tolerance() -> None:
    fastest = stands_within(path(), 0.2, 0.6)
    state = SimState(path().joints[0], np.zeros(4), np.zeros(3), 0.0, 0.0, 0.0, np.full(2, fastest))
    for _ in range(400):
        still = Demand(np.zeros(4), np.zeros(2))
        state = step(state, still, limits_of(MACHINE), LAGS, 0.005)
    assert 0.6 * 0.05 < state.position[0] < 0.05


def test_it_drives_no_faster_than_it_may() -> None:
    way = path()
    follow = Follow(way)
    for _ in range(200):
        q, T = way.at(follow.seen)[0], way.base_at(follow.seen)
        follow, _ = advance(follow, q, 0.2, True, DT, None, T, 0.12, 0.11)
        assert np.abs(follow.tracks).max() <= 0.11 * 1.5 + 1e-9
        driven = float(np.abs(way.tracks_at(follow.at)).max()) * follow.pace
        assert driven <= 0.115
    assert follow.pace < 0.7


def test_a_base_that_is_not_known_stands() -> None:
    way = path()
    for unknown in (None, np.full((4, 4), np.nan)):
        follow, wish = advance(Follow(way), way.joints[0], 0.2, True, DT, None, unknown)
        assert follow.ended == ""
        assert not wish.any()
        assert not follow.tracks.any()


def test_a_path_that_stands_on_its_tracks_never_moves_them() -> None:
    way = path()
    assert way.base is not None
    still = replace(
        way, tracks=np.zeros((len(way.times), 2)), base=np.tile(way.base[0], (201, 1, 1))
    )
    off = way.base[0].copy()
    off[0, 3] += 0.05
    follow = Follow(still)
    for _ in range(100):
        follow, _ = advance(follow, still.at(follow.seen)[0], 0.2, True, DT, None, off)
        assert not follow.tracks.any()
    assert follow.at > 0.5


def test_between_its_rows_a_base_turns_the_short_way() -> None:
    a, b = (make(from_attitude(yaw, 0.1, 0.0), np.zeros(3)) for yaw in (3.0, -3.0))
    way = Trajectory(
        np.array([0.0, 1.0]), np.zeros((2, 4)), np.zeros((2, 4)), np.zeros((2, 2)), np.stack([a, b])
    )
    middle = way.base_at(0.5)
    assert middle is not None
    np.testing.assert_allclose(middle[:3, :3], from_attitude(np.pi, 0.1, 0.0), atol=1e-9)
    for t, end in ((-1.0, a), (0.0, a), (1.0, b), (2.0, b)):
        found = way.base_at(t)
        assert found is not None
        np.testing.assert_allclose(found, end, atol=1e-12)


def test_what_makes_no_sense_is_refused() -> None:
    way = path()
    assert way.base is not None
    climb = Climb(("step",), (Phase("reach", 0.0, 8.0),), np.zeros((201, 4, 3)), np.ones(201))
    replace(way, climb=climb)
    for changes in (
        {"tracks": np.zeros((3, 2))},
        {"base": way.base[:5]},
        {"base": np.full_like(way.base, np.nan)},
        {"tolerance": (0.0, 0.1)},
        {"climb": climb, "base": None},
        {"climb": replace(climb, margin=np.ones(7))},
        {"climb": replace(climb, support=np.zeros((201, 3)))},
    ):
        with pytest.raises(InputError):
            replace(way, **changes)  # type: ignore[arg-type]
    for bad in ({"obstacles": ()}, {"phases": ()}, {"margin": np.full(201, np.nan)}):
        with pytest.raises(InputError):
            replace(climb, **bad)  # type: ignore[arg-type]


def test_what_was_left_is_taken_up_where_the_machine_is() -> None:
    way = path()
    follow, states, _ = drive(way, 3.0)
    # Stopped at speed it runs on; then it stands, and is found there.
    stopped = replace(follow, ended="Stop")
    state, limits = states[-1], limits_of(MACHINE)
    for _ in range(60):
        state = step(state, Demand(np.zeros(4), np.zeros(2)), limits, LAGS, DT)
    assert left_at(way, stopped.at, state.q, state.T_site_root, None)
    again = taken_up(stopped)
    assert again.ended == ""
    assert again.fresh
    again, wish = advance(again, state.q, 0.24, False, DT, None, state.T_site_root)
    assert not wish.any()
    assert again.at == pytest.approx(stopped.at, abs=0.6)
    assert np.abs(again.error).max() < np.radians(1.0)  # type: ignore[arg-type]
    for _ in range(900):
        again, wish = advance(
            again, state.q, LAGS.joint_lag, True, DT, None, state.T_site_root, 0.12
        )
        assert not again.ended or again.ended == ARRIVED
        state = step(state, Demand(wish, again.tracks), limits, LAGS, DT)
    assert again.ended == ARRIVED


def test_what_was_moved_away_is_not_taken_up() -> None:
    way = path()
    follow, states, _ = drive(way, 3.0)
    state, stopped = states[-1], replace(follow, ended="Stop")
    moved = state.q + np.array([0.0, 0.0, 0.1, 0.0])
    assert not left_at(way, stopped.at, moved, state.T_site_root, None)
    driven = state.T_site_root.copy()
    driven[:3, 3] += 0.2
    assert not left_at(way, stopped.at, state.q, driven, None)
    again, wish = advance(taken_up(stopped), moved, 0.24, True, DT, None, state.T_site_root)
    assert again.ended == "6 degrees from where it was left; plan again"
    assert not wish.any()


def test_phases_are_told_by_time() -> None:
    phases = (Phase("reach", 0.0, 1.0), Phase("sequence 1", 1.0, 3.0))
    climb = Climb(("step",), phases, np.zeros((2, 4, 3)), np.ones(2))
    assert [climb.phase_at(t) for t in (-1.0, 0.5, 1.0, 9.0)] == [
        "reach",
        "reach",
        "sequence 1",
        "sequence 1",
    ]
