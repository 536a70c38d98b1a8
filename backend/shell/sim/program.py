"""What a simulated machine does by itself, as a function of the time on a common schedule.

A program is an opening script, run once, and a cycle that repeats; both are steps at fixed times.
Machines started with the same epoch therefore stay in step without talking to each other.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.shell.sim.dynamics import Limits
from backend.shell.sim.motion import Motion, at, path_through, shortest
from backend.shell.sim.postures import Spot, dig_waypoints, dump_waypoints
from backend.spatial.types import Array

ACTIONS = ("dig", "dump", "go", "hold", "cut")
PROGRAMS = ("hold", "dig-swing-dump")


@dataclass(frozen=True)
class Step:
    """One line of a script or cycle. t: start [s]; seconds: duration, None for the shortest.

    action: dig and dump at the program's spots, go to a posture, hold still, or cut the radio.
    """

    t: float
    action: str
    posture: str = ""
    seconds: float | None = None


@dataclass(frozen=True, eq=False)
class Program:
    """start: (n,) joint values at time 0 [rad]; script until script_length, then cycle for ever.

    postures: by name, (n,) [rad]; variation: of dig spots from cycle to cycle, 1 is normal, 0 none.
    A program without steps holds the start posture. home: the posture that every cycle ends in.
    """

    machine: Machine
    limits: Limits
    start: Array
    home: Array
    postures: dict[str, Array]
    script: tuple[Step, ...]
    script_length: float
    cycle: tuple[Step, ...]
    period: float
    dig: Spot
    dump: Spot
    seed: int
    variation: float
    source: str  # "demo.toml: machine.left.sim", for messages


def reference(program: Program, t: float) -> tuple[Array, Array, Array]:
    """(q, qd, qdd), each (n,) [rad, rad/s, rad/s^2], at t [s] on the schedule."""
    lap, local = _lap(program, t)
    moves = motions(program, lap)
    index = bisect_right([move.start for move in moves], local) - 1
    if index < 0:
        still = np.zeros_like(program.start)
        return _lap_start(program, lap), still, still
    return at(moves[index], local)


def is_cut(program: Program, t: float) -> bool:
    """Whether the radio is silent at t [s]."""
    lap, local = _lap(program, t)
    steps = program.script if lap < 0 else program.cycle
    return any(
        step.action == "cut" and step.t <= local < step.t + (step.seconds or 0.0) for step in steps
    )


def next_entry(program: Program, t: float) -> float:
    """The first time >= t [s] at which the schedule stands at rest in its home posture.

    Machines rejoin there: at the start of a cycle, where home is away from the partners.
    """
    if not program.cycle:
        return max(t, program.script_length)
    if t <= program.script_length:
        return program.script_length
    laps = math.ceil((t - program.script_length) / program.period)
    return program.script_length + laps * program.period


def entry_posture(program: Program) -> Array:
    """(n,) [rad] where the schedule stands at `next_entry`."""
    return program.home


def _lap(program: Program, t: float) -> tuple[int, float]:
    """(-1, time in the script) or (number of the cycle, time in it)."""
    if t < program.script_length or not program.cycle:
        return -1, t
    lap, local = divmod(t - program.script_length, program.period)
    return int(lap), local


def _lap_start(program: Program, lap: int) -> Array:
    return program.start if lap < 0 or (lap == 0 and not program.script) else program.home


@lru_cache(maxsize=64)
def motions(program: Program, lap: int) -> tuple[Motion, ...]:
    """The motions of one lap (-1: the script) in order, times within the lap [s].

    Raises InputError when a step asks for more speed than there is, or for a spot out of reach.
    """
    steps = [
        s for s in (program.script if lap < 0 else program.cycle) if s.action not in ("hold", "cut")
    ]
    length = program.script_length if lap < 0 else program.period
    rng = np.random.default_rng((program.seed, lap + 1))
    q = _lap_start(program, lap)
    made: list[Motion] = []
    for i, step in enumerate(steps):
        until = steps[i + 1].t if i + 1 < len(steps) else length
        for move in _moves(program, step, q, until, rng if lap > 0 else None):
            made.append(move)
            q = move.goal
    return tuple(made)


def _moves(
    program: Program, step: Step, q: Array, until: float, rng: np.random.Generator | None
) -> list[Motion]:
    """The motions of one step from q, rest to rest; a variation that does not fit is left out."""
    if step.action == "go":
        return _timed(program, step, until, [np.stack([q, program.postures[step.posture]])])
    work = dig_waypoints if step.action == "dig" else dump_waypoints
    spot = program.dig if step.action == "dig" else program.dump
    if step.action == "dig" and rng is not None:
        points = work(program.machine, _varied(spot, rng, program.variation), float(q[0]))
        if points is not None:
            try:
                return _timed(program, step, until, [np.stack([q, points[0]]), points])
            except InputError:
                pass  # a little too far for the time there is
    points = work(program.machine, spot, float(q[0]))
    if points is None:
        raise InputError(
            f"{program.source}: {step.action} at reach {spot.reach:g} m and height "
            f"{spot.height:g} m is out of the machine's reach."
        )
    return _timed(program, step, until, [np.stack([q, points[0]]), points])


def _timed(program: Program, step: Step, until: float, waypoints: list[Array]) -> list[Motion]:
    paths = [path_through(points, program.limits) for points in waypoints]
    needed = [shortest(path, program.limits) for path in paths]
    least = sum(needed)
    seconds = least if step.seconds is None else step.seconds
    if seconds < least - 1e-9 or step.t + seconds > until + 1e-6:
        raise InputError(
            f"{program.source}: the step {step.action!r} at t = {step.t:g} s takes "
            f"{max(seconds, least):.1f} s; allowed are {least:.1f} s or more, "
            f"and an end by t = {until:g} s."
        )
    made, t = [], step.t
    for path, share in zip(paths, needed, strict=True):
        duration = seconds * share / least
        made.append(Motion(t, duration, path))
        t += duration
    return made


def _varied(spot: Spot, rng: np.random.Generator, variation: float) -> Spot:
    """A dig spot a little beside the last one: 2 deg, 4 % of the reach, 15 % of the depth."""
    azimuth, reach, depth = np.clip(rng.standard_normal(3), -2.0, 2.0) * variation
    return replace(
        spot,
        azimuth=spot.azimuth + math.radians(2.0) * float(azimuth),
        reach=spot.reach * (1.0 + 0.04 * float(reach)),
        height=spot.height * (1.0 + 0.15 * float(depth)),
    )
