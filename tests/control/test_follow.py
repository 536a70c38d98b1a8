"""A machine with lag, dead time and limits follows a trajectory."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
import pytest

from backend.control.follow import ARRIVED, LOST, Follow, Trajectory, advance, allowed
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.spatial.types import Array

MACHINE = load_machine("mini")
DT = 0.02
DEAD = 0.16  # to the machine, and back with what its sensors saw [s]


def quick() -> Trajectory:
    """A swing at nearly all that the machine has: it runs on by 30 degrees when it is let go."""
    times = np.linspace(0.0, 4.6, 151)
    u = times / times[-1]
    s, ds = 10 * u**3 - 15 * u**4 + 6 * u**5, (30 * u**2 - 60 * u**3 + 30 * u**4) / times[-1]
    way = np.array([2.3, 0.05, -0.05, 0.0])
    return Trajectory(times, np.array([0.0, 0.5, -1.0, -0.4]) + s[:, None] * way, ds[:, None] * way)


def trajectory(seconds: float = 6.0) -> Trajectory:
    """There by minimum jerk: swing, boom and stick at once."""
    times = np.linspace(0.0, seconds, 151)
    u = times / seconds
    s = 10 * u**3 - 15 * u**4 + 6 * u**5
    ds = (30 * u**2 - 60 * u**3 + 30 * u**4) / seconds
    start = np.clip(np.array([0.0, 0.2, -0.6, -0.4]), MACHINE.lower, MACHINE.upper)
    way = np.clip(start + np.array([1.2, 0.25, 0.3, 0.1]), MACHINE.lower, MACHINE.upper) - start
    return Trajectory(times, start + s[:, None] * way, ds[:, None] * way)


def drive(
    path: Trajectory,
    seconds: float,
    held: tuple[float, float] = (np.inf, np.inf),
    off: float = 0.0,
    most: Callable[[float], Array] | None = None,
    dead: float = DEAD,
) -> tuple[Follow, list[Array], list[float]]:
    """The dead-man is released between the two times of `held`; the machine begins `off` [rad]
    beside; most: (n,) what a limiter leaves at a time [rad/s]. Returns the last Follow, the
    machine's joints and the path's time of every cycle.
    """
    limits, way = limits_of(MACHINE), round(0.5 * dead / DT)
    state = SimState(path.joints[0] + off, np.zeros(4), np.zeros(3), 0.0, 0.0, 0.0, np.zeros(2))
    commands = deque([np.zeros(4)] * way, maxlen=way + 1)
    seen = deque([state.q] * way, maxlen=way + 1)
    follow, joints, times = Follow(path), [], []
    for k in range(round(seconds / DT)):
        seen.append(state.q)
        moves = not held[0] <= k * DT < held[1]
        follow, wish = advance(follow, seen[0], dead + 0.08, moves, DT)
        assert moves or not wish.any()
        if most is not None:
            wish = np.clip(wish, -most(k * DT), most(k * DT))
            follow = allowed(follow, wish)
        commands.append(wish)
        demand = Demand(commands[0], np.zeros(2))
        state = step(state, demand, limits, Hydraulics(), DT)
        joints.append(state.q)
        times.append(follow.at)
    return follow, joints, times


def test_between_the_samples_it_is_smooth_and_outside_at_rest() -> None:
    path = trajectory()
    for t in np.linspace(0.1, 5.9, 50):
        _q, rate = path.at(float(t))
        ahead, behind = path.at(float(t) + 1e-5)[0], path.at(float(t) - 1e-5)[0]
        np.testing.assert_allclose((ahead - behind) / 2e-5, rate, atol=1e-5)
    for k in (0, 40, 150):
        np.testing.assert_allclose(path.at(float(path.times[k]))[0], path.joints[k], atol=1e-12)
    assert not path.at(-1.0)[1].any()
    assert not path.at(99.0)[1].any()
    np.testing.assert_array_equal(path.at(99.0)[0], path.joints[-1])


def test_a_machine_with_lag_and_dead_time_arrives_and_stays_near() -> None:
    path = trajectory()
    done, joints, times = drive(path, 12.0)
    assert done.ended == ARRIVED
    assert np.degrees(np.abs(joints[-1] - path.joints[-1]).max()) < 1.0
    # Seen from the path, not from the clock: each posture is near some posture of it.
    gaps = [np.abs(path.joints - q).max(axis=1).min() for q in joints]
    assert np.degrees(max(gaps)) < 2.0
    assert times[round(path.duration / DT) + 60] == path.duration


def test_released_it_stands_and_goes_on_from_there() -> None:
    path = trajectory()
    done, joints, times = drive(path, 15.0, held=(2.0, 5.0))
    stood = np.array(joints[round(3.5 / DT) : round(5.0 / DT)])
    assert np.ptp(stood, axis=0).max() < 1e-3
    # The path's time is where the machine stands: from there it goes on.
    assert np.abs(path.at(times[round(4.9 / DT)])[0] - stood[-1]).max() < np.radians(1.5)
    assert done.ended == ARRIVED
    gaps = [np.abs(path.joints - q).max(axis=1).min() for q in joints]
    assert np.degrees(max(gaps)) < 2.5


@pytest.mark.parametrize("released", [1.2, 2.3, 3.4])
def test_let_go_at_full_swing_it_goes_on_all_the_same(released: float) -> None:
    path = quick()
    done, joints, times = drive(path, 20.0, held=(released, released + 3.0))
    assert done.ended == ARRIVED
    stood = np.array(joints[round((released + 2.5) / DT)])
    assert np.abs(path.at(times[round((released + 2.9) / DT)])[0] - stood).max() < np.radians(2.0)
    assert np.degrees(np.abs(joints[-1] - path.joints[-1]).max()) < 1.0
    gaps = [np.abs(path.joints - q).max(axis=1).min() for q in joints]
    assert np.degrees(max(gaps)) < 3.0


@pytest.mark.parametrize("left", [0.0, 0.05, 0.4])
def test_what_a_limiter_takes_from_one_joint_slows_all(left: float) -> None:
    """Suddenly, at full swing, by a slow radio: told at once it is not lost before it is seen."""
    path = quick()

    def most(t: float) -> Array:
        return np.array([left if 2.0 < t < 4.0 else 9.0, 9.0, 9.0, 9.0])

    done, joints, _ = drive(path, 40.0, most=most, dead=0.4)
    assert done.ended == ARRIVED
    gaps = [np.abs(path.joints - q).max(axis=1).min() for q in joints]
    assert np.degrees(max(gaps)) < 3.0


def test_a_way_up_and_down_again_is_not_cut_short() -> None:
    """The boom up by 40 degrees and down, the swing 3 degrees on: let go on the way up."""
    times = np.linspace(0.0, 8.0, 321)
    u = times / 8.0
    up = 0.35 * (1.0 - np.cos(2.0 * np.pi * u))
    boom_rate = 0.35 * 2.0 * np.pi / 8.0 * np.sin(2.0 * np.pi * u)
    swing = 0.05 * (10 * u**3 - 15 * u**4 + 6 * u**5)
    swing_rate = 0.05 * (30 * u**2 - 60 * u**3 + 30 * u**4) / 8.0
    none = np.zeros_like(times)
    q = np.stack([swing, 0.1 + up, none - 1.0, none - 0.4], axis=1)
    path = Trajectory(times, q, np.stack([swing_rate, boom_rate, none, none], axis=1))
    done, joints, _ = drive(path, 30.0, held=(3.2, 4.8))
    assert done.ended == ARRIVED
    assert max(q[1] for q in joints) > 0.1 + 0.7 - 0.03
    # Beside it, where the way down is nearer than the way up.
    beside = path.at(3.2)[0].copy()
    beside[0] = path.at(4.8)[0][0]
    for moves in (True, False):
        assert advance(Follow(path, at=3.2), beside, 0.0, moves, DT)[0].at < 3.6


def test_let_go_and_pressed_again_at_once_it_goes_on() -> None:
    done, _joints, _ = drive(quick(), 20.0, held=(2.3, 2.5))
    assert done.ended == ARRIVED


def test_it_does_not_begin_elsewhere() -> None:
    done, joints, _ = drive(trajectory(), 1.0, off=np.radians(5.0))
    assert "from where the trajectory begins" in done.ended
    assert np.ptp(np.array(joints), axis=0).max() == 0.0


def test_held_back_the_path_waits() -> None:
    path = trajectory()
    follow = Follow(path, at=2.0, pace=1.0)
    q = path.at(2.0)[0]
    for _ in range(500):  # the machine does not move at all, as before a limit
        follow, wish = advance(follow, q, 0.2, True, DT)
    assert not follow.ended
    assert follow.at < 3.5
    assert np.abs(follow.error).max() < LOST
    assert wish.any()


def test_off_its_path_it_ends() -> None:
    path = trajectory()
    follow, wish = advance(Follow(path, at=2.0), path.at(2.0)[0] + 0.3, 0.2, True, DT)
    assert follow.ended.endswith("plan again")
    assert not wish.any()


def test_unknown_joints_move_nothing() -> None:
    path = trajectory()
    follow, wish = advance(Follow(path, at=2.0), np.full(4, np.nan), 0.2, True, DT)
    assert not follow.ended
    assert not wish.any()


def test_a_swing_without_ends_is_compared_modulo_a_turn() -> None:
    path = trajectory()
    q = path.at(2.0)[0] + [2.0 * np.pi, 0.0, 0.0, 0.0]
    turns = np.array([True, False, False, False])
    follow, _ = advance(Follow(path, at=2.0), q, 0.0, True, DT, turns)
    assert not follow.ended
    assert advance(Follow(path, at=2.0), q, 0.0, True, DT)[0].ended


@pytest.mark.parametrize(
    ("times", "rows", "words"),
    [
        ([0.0], 1, "m of 2 or more"),
        ([0.0, 1.0], 3, "m of 2 or more"),
        ([0.5, 1.0], 2, "do not rise from 0 s"),
        ([0.0, 0.0], 2, "do not rise from 0 s"),
        ([0.0, np.nan], 2, "not finite"),
    ],
)
def test_what_is_no_trajectory_is_said(times: list[float], rows: int, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Trajectory(np.array(times), np.zeros((rows, 4)), np.zeros((rows, 4)))
