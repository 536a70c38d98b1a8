"""What is told of a manoeuvre: figures, candidates, phases and assumptions."""

from __future__ import annotations

import math

import numpy as np

from backend.documents.surmount_document import (
    SurmountCandidate,
    SurmountFigures,
    SurmountParameters,
)
from backend.machine.model import Machine
from backend.spatial.types import Array
from backend.stability.dynamics import centre_of_mass
from backend.surmount.judge import judge
from backend.surmount.plan import Plan
from backend.surmount.search import Found

SHOWN = 600
"""Rows of the figures at most."""


def parameters_of(found: Found) -> SurmountParameters:
    """As they are told."""
    p = found.parameters
    return SurmountParameters(p1=p.p1, p2=p.p2, p3=p.p3, p4=p.p4, alpha_f=p.alpha_f)


def candidate(found: Found, made: Plan) -> SurmountCandidate:
    """One of the first leg's, by what its sequences say."""
    leg = made.legs[0]
    chosen = found is leg.found
    one = SurmountCandidate(
        parameters=parameters_of(found),
        energy=found.energy,
        simulated=found.by != "quasi-static batch",
        chosen=chosen,
    )
    verdict, sequences = judge(leg.climber, leg.leg.step, found.parameters, found.spline)
    if not sequences:
        return one
    margin = min(float(s.margin.min()) for s in sequences)
    return one.model_copy(
        update={
            "duration": sum(s.duration for s in sequences),
            "min_stability_margin": margin,
            "worst_torque": 1.0 - verdict.left["torque"],
        }
    )


def figures_of(machine: Machine, made: Plan) -> SurmountFigures:
    """Figs. 10-14, of the run, at most SHOWN rows."""
    motion, run = made.motion, made.run
    picked = np.unique(np.linspace(0, len(motion.time) - 1, SHOWN).round().astype(int))
    T, q = run.T_step_root[picked], run.q[picked]
    centre = centre_of_mass(made.climber.masses, q)
    placed = np.einsum("mij,mj->mi", T[:, :3, :3], centre) + T[:, :3, 3]
    return SurmountFigures(
        time=np.round(motion.time[picked], 3).tolist(),
        joints=np.round(q, 5).tolist(),
        rates=np.round(run.rates[picked], 5).tolist(),
        torques=[[float(f"{v:.5g}") for v in row] for row in run.torques[picked]],
        torque_limits=[float(v) if np.isfinite(v) else None for v in machine.max_torque],
        energy=[float(f"{v:.6g}") for v in run.energy[picked]],
        com=np.round(placed[:, [0, 2]], 4).tolist(),
        phase=motion.phase_index()[picked].tolist(),
    )


def assumptions(machine: Machine, made: Plan) -> list[str]:
    """What was assumed, in words."""
    up = made.climber
    told = [
        *machine.assumptions,
        f"the crawler's ends are round, {up.r:.3f} m in radius, {2.0 * up.a:.3f} m apart",
        f"the bucket holds on to the ground by a round edge of {1e3 * up.edge[0]:.0f} mm radius",
        f"friction of tracks and bucket is {up.demands.friction:g}; ground and step are hard",
        "drives are ideal: losses of hydraulics and friction in joints are not counted",
    ]
    if not np.isfinite(machine.max_torque[1:4]).all():
        told.append("torques are not limited: the machine's description states none")
    return told


def legs_of(made: Plan) -> list[int]:
    """Which leg each phase belongs to."""
    numbers, at = [], 0
    for phase in made.motion.phases:
        numbers.append(at)
        if phase.name in ("stow", "down reach"):
            at = min(at + 1, len(made.legs) - 1)
    return numbers


def margin_of(made: Plan, name: str, number: int) -> float | None:
    """Of a phase of a leg, the least [m]; None where none was worked out."""
    found = made.legs[number].made.margins.get(name.removeprefix("down "))
    return found if found is None or math.isfinite(found) else None


def between(time: Array, energy: Array, start: float, end: float) -> float:
    """Of cumulative energy (m,) at time (m,), what is spent from start to end [J]."""
    first, last = np.interp([start, end], time, energy)
    return float(last - first)


def share(values: Array, limits: Array) -> float | None:
    """The greatest of values (n,) over their limits; None where nothing is limited."""
    most = float((values / limits).max())
    return most if math.isfinite(most) and most > 0.0 else None
