"""Surmounting: the paper's search on its shovel, beside a fine batch around what it finds; random
steps of two machines. Jayasekara and Arisumi 2015.

Not in `make test`; `make campaign` prints the tables. A sample is in tests/surmount.
"""

from __future__ import annotations

import math
import os
import time

import numpy as np
import pytest
from surmounting import climbing, posture

from backend.machine.load import load_machine
from backend.shell.surmount_pool import Pool
from backend.surmount.course import Edge
from backend.surmount.ends import least_p4
from backend.surmount.judge import judge
from backend.surmount.outline import leans
from backend.surmount.plan import Plan, demands_of, plan
from backend.surmount.records import Parameters
from backend.surmount.search import Found, Job, Search

STEPS = int(os.environ.get("SURMOUNT_STEPS", "10"))
"""Of each machine."""

PAPER = {
    "coarse batch": (18.658, Parameters(0.2675, 0.21, 0.4396, 1.0, math.radians(16.75))),
    "SQP": (17.1477, Parameters(0.2457, 0.2193, 0.4083, 1.0, math.radians(16.75))),
    "fine batch": (17.155, Parameters(0.2475, 0.22, 0.3996, 1.0, math.radians(16.75))),
}
"""Energies [J] and parameters as printed; P4 is not given."""


def line(what: str, found: Found, bound: float, paper: float | None = None) -> None:
    p = found.parameters
    beside = "" if paper is None else f"  paper {paper:.3f} J"
    print(
        f"  {what:22} {found.energy:7.3f} J  P1 {p.p1:.4f}  P2 {p.p2:.4f}  P3 {p.p3:.4f} m  lean "
        f"{math.degrees(p.alpha_f):5.2f} deg  heights alone {bound:.3f} J{beside}"
    )


def searched() -> tuple[Search, list[Found], Found, float]:
    """The search as in the paper: coarse batch, then SQP from its best three."""
    climber, step = climbing("shovel")
    begun = time.perf_counter()
    with Pool()(climber, step) as simulate:
        search = Search(climber, step, least_p4(climber, step), simulate)
        coarse = search.batch()
        best = min((search.slsqp(one) for one in coarse[:3]), key=lambda one: one.energy)
        best = search.settled(best)
        seconds = time.perf_counter() - begun
        fine = search.batch(best.parameters)
        bent = search.bent(best)
    return search, [coarse[0], best, fine[0], bent], best, seconds


@pytest.mark.timeout(3_600)
def test_the_shovel_and_the_papers_step() -> None:
    search, found, best, seconds = searched()
    climber, step = search.climber, search.step
    bounds = []
    for one in found:
        _, sequences = judge(climber, step, one.parameters, one.spline)
        bounds.append(sum(s.potential for s in sequences))
    papers = (PAPER["coarse batch"][0], PAPER["SQP"][0], PAPER["fine batch"][0], None)
    names = ("coarse batch", "SLSQP", "fine batch around it", "with a spline")
    print(f"\nminiature shovel, step {step.height} m, {search.simulations} halves simulated")
    print(f"  coarse batch and SLSQP in {seconds:.0f} s; P4 {search.p4:.4f} m; m g h 6.753 J")
    for name, one, bound, paper in zip(names, found, bounds, papers, strict=True):
        line(name, one, bound, paper)
        assert one.energy > bound
    for name, (energy, printed) in PAPER.items():
        parameters = Parameters(
            printed.p1,
            printed.p2,
            printed.p3,
            search.p4,
            max(printed.alpha_f, search.bounds()[3, 0]),
        )
        verdict, _ = judge(climber, step, parameters)
        with Pool()(climber, step) as simulate:
            made = simulate([Job("front", parameters), Job("back", parameters)])
        ours = sum(one.energy for one in made)
        print(
            f"  the paper's {name:12} {energy:7.3f} J; with its parameters here {ours:.3f} J"
            f"{'' if verdict.holds else ', but ' + verdict.why}"
        )
    coarse, slsqp, fine, bent = found
    assert slsqp.energy <= coarse.energy
    assert slsqp.energy <= fine.energy, "a point of the fine batch needs less"
    assert bent.energy <= slsqp.energy
    assert seconds < 300.0
    # The same again, to the last digit.
    _, again, _, _ = searched()
    assert again[1] == best


@pytest.mark.timeout(3_600)
@pytest.mark.parametrize("name", ["mini", "ex13"])
def test_random_steps(name: str) -> None:
    machine = load_machine(name)
    rng = np.random.default_rng(11)
    climber, _ = climbing(name)
    print(f"\n{name}: height, top, kind, energy of sequences, least margin, slip, seconds")
    unexplained = 0
    for _ in range(STEPS):
        height = float(rng.uniform(0.5, 4.0)) * climber.r
        depth = float(rng.choice([np.inf, rng.uniform(1.5, 4.0) * machine.tracks.length]))
        begun = time.perf_counter()
        away = -float(rng.uniform(1.2, 2.5)) * machine.tracks.length
        made = plan(
            machine,
            demands_of(machine),
            (Edge(0.0, height),),
            away,
            posture(name),
            Pool(),
            depth=depth,
        )
        seconds = time.perf_counter() - begun
        top = "endless" if math.isinf(depth) else f"{depth:.1f} m"
        if isinstance(made, Plan):
            leg = made.legs[0]
            print(
                f"  {height:.3f} m  {top:8} up         {leg.found.energy:9.0f} J  "
                f"{leg.made.margin:.2f} m  {1e3 * made.run.slip:.1f} mm  {seconds:.1f} s"
            )
            assert made.run.deepest < 1e-3
            assert made.run.slip < 5e-3
            assert leg.made.margin >= made.climber.demands.margin
        else:
            print(f"  {height:.3f} m  {top:8} {made.kind:10} {made.why}  {seconds:.1f} s")
            unexplained += made.kind not in ("room", "reach", "collision", "stability", "torque")
            if made.kind == "reach" and "crawler can lean" in made.why:
                with pytest.raises(Exception, match="higher than"):
                    leans(height, climber.a, climber.r)
    assert unexplained == 0
