"""Manoeuvres followed on real ground in simulated time, let go again and again on the way.

The plan, the follower, the radio's delay, the sensors' noise, the drives and MuJoCo, without the
processes. `RUNS=3 pytest ...` for other numbers of runs. Expected: all arrive, and the base is
never off its way by more than its tolerance.
"""

from __future__ import annotations

import os
from collections import deque
from typing import NamedTuple

import numpy as np
import pytest

from backend.control.follow import (
    TOLERANCE,
    Follow,
    Trajectory,
    advance,
    allowed,
    apart,
    stands_within,
)
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.shell.sim.grounded import Grounded
from backend.shell.surmount_follow import UNIT
from backend.spatial.boxes import Boxes
from backend.surmount.course import Edge
from backend.surmount.halves import one_by_one
from backend.surmount.plan import Refusal, demands_of, plan

RUNS = int(os.environ.get("RUNS", "4"))
CYCLE, DT = 0.02, 0.005
HOME = np.array([0.0, 0.7, -1.6, -0.6])
TASKS = {
    "mini, 0.25 m": ("mini", ((0.0, 0.25),), -3.0),
    "mini, twice 0.2 m": ("mini", ((0.0, 0.2), (5.0, 0.2)), -2.5),
    "ex13, 0.6 m": ("ex13", ((0.0, 0.6),), -5.0),
    "shovel, 0.066 m": ("shovel", ((0.0, 0.066),), -0.35),
}


class Went(NamedTuple):
    """far: of the base off its way, of the tolerance, the most; turned [rad]; took [s]."""

    ended: str
    far: float
    turned: float
    took: float


def trajectory(machine: Machine, edges: tuple[tuple[float, float], ...], x: float) -> Trajectory:
    q = np.clip(HOME, machine.lower, machine.upper)
    course = tuple(Edge(*edge) for edge in edges)
    made = plan(machine, demands_of(machine), course, x, q, one_by_one)
    assert not isinstance(made, Refusal), made
    motion = made.motion
    rows = slice(None, None, max(1, round(CYCLE / float(motion.time[1] - motion.time[0]))))
    return Trajectory(
        motion.time[rows] - motion.time[0],
        motion.q[rows],
        motion.rates[rows],
        np.repeat(motion.belts[rows, None], 2, axis=1),
        motion.T_step_root[rows],
        (TOLERANCE[0] * machine.tracks.length / UNIT, TOLERANCE[1]),
    )


def terrain(edges: tuple[tuple[float, float], ...], far: float) -> Boxes:
    """Each edge's top, one on the other."""
    heights = np.cumsum([rise for _, rise in edges])
    half = np.array([[0.5 * far, 0.5 * far, 0.5 * z] for z in heights])
    middle = [[x + 0.5 * far, 0.0, 0.5 * z] for (x, _), z in zip(edges, heights, strict=True)]
    return Boxes(np.array(middle), np.tile(np.eye(3), (len(edges), 1, 1)), half)


def follow(machine: Machine, path: Trajectory, ground: Boxes, seed: int) -> Went:
    rng = np.random.default_rng(seed)
    size = path.tolerance[0] / TOLERANCE[0]
    dead = rng.uniform(0.1, 0.3)
    begins = rng.uniform(0.0, path.duration, 12 if seed else 0)
    pauses = [(begin, begin + rng.uniform(0.3, 3.0)) for begin in begins]
    assert path.base is not None
    start = path.base[0][:3, 3].copy()
    state = SimState(path.joints[0], np.zeros(4), start, 0.0, 0.0, 0.0, np.zeros(2))
    world, driven = Grounded(machine, 0.0, ground, state, DT), state
    limits, lags, way = limits_of(machine), Hydraulics(), round(0.5 * dead / CYCLE)
    commands = deque([(np.zeros(4), np.zeros(2))] * way, maxlen=way + 1)
    seen = deque([state] * way, maxlen=way + 1)
    fastest = stands_within(path, lags.track_lag, machine.tracks.max_acceleration)
    continuous = np.array([joint.continuous for joint in machine.joints])
    following, far, turned, t = Follow(path), 0.0, 0.0, 0.0
    while not following.ended and t < 3.0 * path.duration:
        seen.append(state)
        T = seen[0].T_site_root.copy()
        T[:3, 3] += rng.normal(0.0, 0.01 * size, 3)
        q = seen[0].q + rng.normal(0.0, 3e-4, len(HOME))
        moves = not any(a <= t < b for a, b in pauses)
        following, wish = advance(
            *(following, q, dead + lags.joint_lag, moves, CYCLE, continuous, T),
            *(lags.track_lag - lags.joint_lag, fastest),
        )
        following = allowed(following, wish, following.tracks)
        commands.append((np.clip(wish, -limits.velocity, limits.velocity), following.tracks))
        for _ in range(round(CYCLE / DT)):
            driven = world.relieved(step(driven, Demand(*commands[0]), limits, lags, DT))
            state = world.step(driven)
        wanted = path.base_at(following.seen)
        assert wanted is not None
        off, angle = apart(wanted, seen[0].T_site_root)
        far, turned, t = max(far, off / path.tolerance[0]), max(turned, angle), t + CYCLE
    return Went(following.ended, far, turned, t)


@pytest.mark.timeout(3_600)
def test_manoeuvres_are_followed_however_often_they_are_let_go() -> None:
    print("\n  task               planned [s]  took [s]  off, of the tolerance  turned [deg]")
    found = []
    for name, (model, edges, x) in TASKS.items():
        machine = load_machine(model)
        path = trajectory(machine, edges, x)
        ground = terrain(edges, 25.0 * machine.tracks.length)
        for seed in range(RUNS):
            went = follow(machine, path, ground, seed)
            found.append(went)
            print(
                f"  {name:18} {path.duration:10.1f} {went.took:9.1f} {went.far:22.2f}"
                f" {np.degrees(went.turned):13.2f}  {went.ended}"
            )
    assert {went.ended for went in found} == {"arrived"}
    assert max(went.far for went in found) < 1.0
    assert max(went.turned for went in found) < np.radians(1.0)
