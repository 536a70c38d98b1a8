"""Planning trajectories: the whole of it, its timing alone, and its check, beside their peers."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import TypeVar

import numpy as np

from backend.collision.peer import FclScene
from backend.documents.bench import BenchRow
from backend.machine.kinematics import link_poses
from backend.machine.load import load_machine
from backend.planning.trajectory.course import course, setting
from backend.planning.trajectory.plan import plan, rehearse, timing
from backend.planning.trajectory.records import Obstacles, Refusal, Task, Trajectory
from backend.planning.trajectory.rows import Rows, limit_rows
from backend.planning.trajectory.timing import Timed, casadi_timing, toppra_timing
from backend.spatial.types import Array
from backend.stability.masses import mass_model
from backend.stability.polygon import shrunk, support_polygon
from cockpit.bench_rows import percentile_rows
from cockpit.bench_tasks import lifted_curve, paper_task, random_task

_T = TypeVar("_T")

TASKS = 30
"""Of each machine."""
_CHECKED = 5  # trajectories whose check is compared
_PLACES = 1_000  # of each of them
_TURNS = 20
_PEER = "CasADi with IPOPT"


def plan_rows() -> list[BenchRow]:
    """Random tasks of both machines from nothing, then what CasADi and python-fcl are asked, too.

    Tasks that are refused count as well: they take the longest search.
    """
    rows = []
    for name in ("mini", "ex13"):
        machine = load_machine(name)
        rehearse(machine)
        tasks = [random_task(machine, seed) for seed in range(TASKS)]
        whole, timed = list[float](), list[float]()
        made = [_timed(whole, plan, machine, *asked) for asked in tasks]
        for task, obstacles in tasks:
            within = setting(machine, task, obstacles)
            found = within if isinstance(within, Refusal) else course(machine, task, within)
            if isinstance(within, Refusal) or isinstance(found, Refusal):
                continue
            _timed(timed, timing, machine, task, within, found)
        what = f"{name}, {TASKS} tasks among boxes"
        rows += percentile_rows(f"a trajectory planned, {what}", whole, 1000.0)
        rows += percentile_rows(f"its timing alone, {what}", timed, 150.0)
    return [*rows, *_timing_rows(), _penalty_row(), *_check_rows(tasks, made)]


def _timing_rows() -> list[BenchRow]:
    """TOPP-RA and, where it is installed, CasADi on the same rows of the same curve."""
    machine, task, curve = lifted_curve()
    masses, support = mass_model(machine, task.payload), shrunk(support_polygon(machine), 0.2)

    def by(solver: Callable[[Rows], Timed | None]) -> Timed | None:
        return solver(limit_rows(machine, task, curve, 160, masses, support))

    ours, theirs = list[float](), list[float]()
    found = [_timed(ours, by, toppra_timing) for _ in range(_TURNS)][-1]
    peer: Timed | None = None
    if find_spec("casadi") is not None:
        peer = [_timed(theirs, by, casadi_timing) for _ in range(_TURNS)][-1]
    name = "timing of Yamashita's task by TOPP-RA, 160 intervals"
    row = _row(name, 1e3 * np.array(ours), "ms", 150.0)
    if found is None or peer is None:
        return [row]
    value = 1e3 * float(np.median(theirs))
    longer = 100.0 * (float(found.t[-1] / peer.t[-1]) - 1.0)
    return [
        row.model_copy(
            update={"peer": _PEER, "peer_value": value, "ratio": value / row.value},
        ),
        _row(f"its duration, longer than by {_PEER}", np.array([longer]), "%", 0.2),
    ]


def _penalty_row() -> BenchRow:
    """The paper's task planned by ours and, once, by the paper's method."""
    machine, task, obstacles = paper_task()
    ours, theirs = list[float](), list[float]()
    for _ in range(_TURNS):
        _timed(ours, plan, machine, task, obstacles)
    _timed(theirs, plan, machine, task, obstacles, "penalty")
    row, value = _row("Yamashita's task planned", 1e3 * np.array(ours), "ms"), 1e3 * theirs[0]
    peer = {"peer": "the penalty method", "peer_value": value, "ratio": value / row.value}
    return row.model_copy(update=peer)


def _check_rows(
    tasks: list[tuple[Task, Obstacles]], made: list[Trajectory | Refusal]
) -> list[BenchRow]:
    """The nearest along a trajectory, as the check finds it, and python-fcl in every place."""
    machine = load_machine("ex13")
    moving = np.flatnonzero(machine.body_joints.any(axis=1))
    frames = machine.body_link_index[moving]
    ours, theirs, off = list[float](), list[float](), list[float]()
    for (_, obstacles), one in zip(tasks, made, strict=True):
        if len(ours) == _CHECKED:
            break
        if isinstance(one, Refusal) or not len(obstacles.boxes):
            continue
        places = np.linspace(0.0, one.duration, _PLACES)
        q = np.stack([np.interp(places, one.time, column) for column in one.q.T], axis=1)
        asked = (machine.bodies.take(moving), frames, link_poses(machine, q))
        scene = FclScene(obstacles.boxes)
        least = _timed(ours, scene.least_along, *asked)
        every = _timed(theirs, scene.each_along, *asked)
        off.append(1e3 * abs(least - every.min()))
    row = _row(f"python-fcl's nearest of {_PLACES} postures, ex13", 1e3 * np.array(ours), "ms")
    value = 1e3 * float(np.median(theirs))
    peer = {"peer": "asked in every posture", "peer_value": value, "ratio": value / row.value}
    name = "the same, at most off from asking in every posture"
    return [row.model_copy(update=peer), _row(name, np.array([max(off)]), "mm", 1e-3)]


def _row(name: str, values: Array, unit: str, target: float | None = None) -> BenchRow:
    low, high = (float(v) for v in np.percentile(values, [5, 95]))
    value = float(np.median(values))
    return BenchRow(name=name, value=value, unit=unit, spread=(low, high), target=target)


def _timed(into: list[float], run: Callable[..., _T], *args: object) -> _T:
    """What it returns; its time is added to `into` [s]."""
    start = time.perf_counter()
    result = run(*args)
    into.append(time.perf_counter() - start)
    return result
