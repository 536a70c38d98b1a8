"""The two use cases of Mäkinen 2021, Chapter 4, as runs: what its figures plot, by every method.

"pole" (Figs. 4.2-4.4): by hand towards a pole and back. "ballast" (Figs. 4.5-4.11): a task's path
between two tracks under 25 kV. The scenes, and what is assumed of them, stand in `rail_site`.
Frame: the machine's root, x along its track, y to the left, z up from the top of rail.
"""

from __future__ import annotations

from typing import NamedTuple, get_args

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.machine.pose import pose_error, tool_pose
from backend.planning import rail_site
from backend.planning.proximity import OWN_BODY, Limits, Sight, near_points, posed
from backend.planning.records import Method, Settings, Thresholds
from backend.planning.simulate import STEP, Run, Tell, clearances, follow_path, run, untold
from backend.planning.vibration import Vibration, vibration
from backend.spatial.types import Array, IntArray

MODEL = "rail6"
"""The machine of both, as the thesis's: swing, boom, stick, bucket, tilt, rotate."""

NO_METHOD = "none"
METHODS: tuple[str, ...] = (NO_METHOD, *get_args(Method))
"""Without any limit, velocity scaling, potential field, constrained speeds."""

EXTRA = 3.0
"""[s] after the end of a path to arrive in."""

_POLE_SECONDS = 12.0
_LOOKED = 12.0  # [m] within which the deciding pair is looked for
_SAME = 1e-6  # [m] between two ways to work out a distance
_THERE = (0.03, 0.03)  # [m], [rad] from the end that count as arrived


class UseCase(NamedTuple):
    """title, figures: in words; seconds: how long a run lasts; own: whether own bodies count in the
    shortest distance, as in Fig. 4.11, or the limits alone do, as in Fig. 4.4.
    """

    name: str
    title: str
    figures: str
    limits: Limits
    seconds: float
    own: bool


class Nearest(NamedTuple):
    """The deciding pair at m instants: distance (m,) [m], negative on overlap; pair (m,) index into
    words ("stick to adjacent track"); points (m, 2, 3), on the machine and on what is near [m],
    one and the same on overlap.
    """

    distance: Array
    pair: IntArray
    words: tuple[str, ...]
    points: Array


class UseCaseRun(NamedTuple):
    """method: one of METHODS; run: times, postures, speeds, scale; its error is the tool's from
    `designed`, (m, 2) [m], [rad]. tool, designed: (m, 4, 4) the tool's poses, as it moved and as it
    was meant to. vibration: of the joints' speeds.
    """

    case: UseCase
    method: str
    settings: Settings
    run: Run
    tool: Array
    designed: Array
    nearest: Nearest
    vibration: Vibration


def use_case(name: str) -> UseCase:
    """A use case by its name. Raises InputError for an unknown one."""
    if name == "pole":
        return UseCase(
            name,
            "Towards a pole and back",
            "Figs. 4.2-4.4",
            rail_site.pole_limits(),
            _POLE_SECONDS,
            own=False,
        )
    if name == "ballast":
        seconds = rail_site.ballast_path().duration + EXTRA
        return UseCase(
            name,
            "Ballast removal under 25 kV",
            "Figs. 4.5-4.11",
            rail_site.ballast_limits(),
            seconds,
            own=True,
        )
    raise InputError(f'use case "{name}" is not known; allowed are {", ".join(NAMES)}.')


NAMES = ("pole", "ballast")


def settings_of(method: str) -> Settings:
    """What a use case is run with: p_u = 0.8 m, p_l = 0.2 m (Section 4.2), and joint speeds that
    follow at once, as in the thesis.

    It gives no gain: mu = 0.001 m^4/s touches nothing in either. The dampers' slope is
    1 m/s / (p_u - p_l). Raises InputError for what is none of METHODS.
    """
    if method not in METHODS:
        raise InputError(f'method "{method}" is not known; allowed are {", ".join(METHODS)}.')
    near = Thresholds()
    if method == "potential":
        return Settings(near, gain=1e-3)
    if method == "constrained":
        return Settings(near, rate=1.0 / (near.upper - near.lower))
    return Settings(near)


def run_use_case(name: str, method: str, machine: Machine, tell: Tell = untold) -> UseCaseRun:
    """One use case by one method, every STEP; the same every time.

    machine: MODEL's; tell: called with the time of every step [s], see `simulate.run`. Raises
    InputError for a name or method that there is not.
    """
    case, settings = use_case(name), settings_of(method)
    acting: Method | None = None if method == NO_METHOD else method  # type: ignore[assignment]
    make = _pole if name == "pole" else _ballast
    done, designed = make(case, acting, machine, settings, tell)
    tool = _tools(machine, done.q)
    error = np.array([_parts(pose_error(a, b)) for a, b in zip(designed, tool, strict=True)])
    done = done._replace(error=error)
    return UseCaseRun(
        *(case, method, settings, done, tool, designed),
        nearest(machine, case.limits, done.q, case.own),
        vibration(done.rates, STEP),
    )


def nearest(machine: Machine, limits: Limits, q: Array, own: bool) -> Nearest:
    """The closest pair of each posture, q (m, n): of moving bodies to the limits and, with `own`,
    of own bodies to each other. Raises InputError where nothing is within sight.
    """
    # First how near, which is quick, then what it is: only one pair is that near.
    known = clearances(machine, limits, q, cap=_LOOKED) if own else np.full(len(q), _LOOKED)
    distance, points = np.empty(len(q)), np.empty((len(q), 2, 3))
    pair: IntArray = np.empty(len(q), dtype=np.int64)
    words: dict[str, int] = {}
    for i, posture in enumerate(q):
        sight = Sight.everywhere(machine, min(max(known[i], 0.0) + _SAME, _LOOKED))
        near = near_points(machine, posed(machine, posture), limits, sight, own=own)
        if not len(near):
            raise InputError(f"use case: nothing is within {_LOOKED:g} m of posture {i}.")
        k = int(near.distance.argmin())
        part = machine.part_of_body(int(near.body[k]))
        if near.obstacle[k] == OWN_BODY:
            what = f"own {machine.part_of_body(int(near.other[k]))}"
        else:
            what = near.names[near.obstacle[k]]
        pair[i] = words.setdefault(f"{part} to {what}", len(words))
        distance[i] = near.distance[k]
        points[i] = near.point[k], near.obstacle_point[k]
    return Nearest(distance, pair, tuple(words), points)


def _pole(
    case: UseCase, method: Method | None, machine: Machine, settings: Settings, tell: Tell
) -> tuple[Run, Array]:
    """Meant is what the same wish does without a limit; arrived is who is back at the start."""
    q_start, wish = rail_site.pole_wish(machine)
    seconds = case.seconds
    done = run(method, machine, case.limits, q_start, wish, settings, seconds, tell=tell)
    free = (
        done
        if method is None
        else run(None, machine, case.limits, q_start, wish, Settings(), seconds)
    )
    tool = _tools(machine, done.q)
    off = np.array([_parts(pose_error(tool[0], T)) for T in tool])
    back = (done.times > rail_site.POLE_BACK) & (off < _THERE).all(axis=1)
    arrived = float(done.times[back.argmax()]) if back.any() else float("nan")
    return done._replace(arrived=arrived), _tools(machine, free.q)


def _ballast(
    case: UseCase, method: Method | None, machine: Machine, settings: Settings, tell: Tell
) -> tuple[Run, Array]:
    path = rail_site.ballast_path()
    done = follow_path(method, machine, case.limits, path, settings, EXTRA, tell=tell)
    return done, np.array([path.goal(machine, float(t)).pose for t in done.times])


def _tools(machine: Machine, q: Array) -> Array:
    return np.array([tool_pose(machine, posed(machine, posture)) for posture in q])


def _parts(error: Array) -> tuple[float, float]:
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
