"""Surmounting: one manoeuvre gone through in MuJoCo, and how long finding one takes."""

from __future__ import annotations

import time

import numpy as np

from backend.documents.bench import BenchRow
from backend.machine.load import load_machine
from backend.shell.surmount_pool import Pool
from backend.surmount.course import Edge
from backend.surmount.halves import one_by_one
from backend.surmount.machine import climber
from backend.surmount.plan import Plan, demands_of, plan
from backend.surmount.records import Step
from backend.surmount.run import run, world_of

STEPS = {"shovel": 0.066, "mini": 0.25, "ex13": 0.5}
"""[m]"""
_TURNS = 5
ONE, ALL = 1_000.0, 300_000.0
"""One manoeuvre's simulation, and the whole optimisation, stay below these [ms]."""


def surmount_rows() -> list[BenchRow]:
    """Whole manoeuvres simulated, quick searches, and the paper's with all of its steps."""
    rows = []
    posture = np.array([0.0, 0.8, -1.5, -0.5])
    for name, height in STEPS.items():
        machine = load_machine(name)
        demands = demands_of(machine)
        up, step = climber(machine, demands), Step(height)
        edges, away = (Edge(0.0, height),), -1.5 * machine.tracks.length
        world, seconds, runs = world_of(up, step), list[float](), list[float]()
        made = None
        for _ in range(_TURNS):
            begun = time.perf_counter()
            made = plan(machine, demands, edges, away, posture, one_by_one)
            seconds.append(time.perf_counter() - begun)
        assert isinstance(made, Plan)
        for _ in range(_TURNS):
            begun = time.perf_counter()
            run(up, world, made.motion)
            runs.append(time.perf_counter() - begun)
        what = f"{name}, a step of {height:g} m"
        lasts = f"{made.motion.duration:.0f} s of it"
        rows.append(_row(f"a whole manoeuvre in MuJoCo, {what}, {lasts}", runs, ONE))
        rows.append(_row(f"a manoeuvre found (quick) and gone through, {what}", seconds, None))
    machine = load_machine("shovel")
    begun = time.perf_counter()
    edges = (Edge(0.0, STEPS["shovel"]),)
    plan(machine, demands_of(machine), edges, -0.44, posture, Pool(), "thorough")
    whole = [time.perf_counter() - begun]
    rows.append(_row("coarse batch and SLSQP from its best three, shovel", whole, ALL))
    return rows


def _row(name: str, seconds: list[float], target: float | None) -> BenchRow:
    ms = 1e3 * np.asarray(seconds)
    low, high = (float(v) for v in np.percentile(ms, [5, 95]))
    return BenchRow(
        name=name, value=float(np.median(ms)), unit="ms", spread=(low, high), target=target
    )
