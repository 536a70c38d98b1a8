"""Whole manoeuvres in MuJoCo: up, down, two in a row, and what cannot be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from surmounting import HOLDING, STEPS, climbing, posture

from backend.surmount.course import Edge, legs
from backend.surmount.halves import one_by_one, simulated
from backend.surmount.judge import judge, own_bodies
from backend.surmount.manoeuvre import manoeuvre
from backend.surmount.plan import Plan, Refusal, demands_of, failed, plan
from backend.surmount.run import run, world_of
from backend.surmount.search import Job

NAMES = list(STEPS)


@pytest.mark.parametrize("name", NAMES)
def test_a_whole_manoeuvre_holds_in_the_simulation(name: str) -> None:
    climber, step = climbing(name)
    world = world_of(climber, step)
    made = manoeuvre(climber, step, HOLDING[name], posture(name), world.options.step)
    assert made.motion is not None, made.why
    ran = run(climber, world, made.motion)
    assert ran.why == ""
    assert ran.deepest < 1e-3
    assert ran.slip < 5e-3
    assert ran.lean < np.radians(0.5)
    # Nothing jumps: neither the plan nor what was driven.
    dt = world.options.step
    assert np.abs(np.diff(made.motion.q, axis=0)).max() / dt < climber.machine.max_velocity.max()
    assert (np.abs(ran.rates) < 1.05 * climber.machine.max_velocity + 0.05).all()
    assert made.margin > 0.0
    # It ends on the top.
    assert ran.T_step_root[-1, 2, 3] == pytest.approx(step.height, abs=2e-3)
    # Energy of everything is at least what the heights of beginning and end ask.
    assert ran.total > climber.weight * step.height


@pytest.mark.parametrize("name", NAMES)
def test_simulated_energy_is_above_its_bounds_and_repeats(name: str) -> None:
    climber, step = climbing(name)
    world = world_of(climber, step)
    verdict, sequences = judge(climber, step, HOLDING[name])
    jobs = [Job("front", HOLDING[name]), Job("back", HOLDING[name])]
    first = [simulated(climber, step, world, job) for job in jobs]
    again = [simulated(climber, step, world_of(climber, step), job) for job in jobs]
    assert [one.why for one in first] == ["", ""]
    assert first == again
    total = sum(one.energy for one in first)
    assert total > verdict.energy * 0.999
    assert verdict.energy > sum(one.potential for one in sequences) * 0.999


def test_what_does_not_hold_when_gone_through_is_refused() -> None:
    climber, step = climbing("ex13")
    world = world_of(climber, step)
    made = manoeuvre(climber, step, HOLDING["ex13"], None, world.options.step)
    assert made.motion is not None
    ran, demands = run(climber, world, made.motion), climber.demands
    assert failed(ran, demands) is None
    needed = np.abs(ran.torques).max(axis=0)
    for broken, kind in (
        (failed(replace(ran, slip=0.006), demands), "simulation"),
        (failed(replace(ran, deepest=0.002), demands), "simulation"),
        (failed(replace(ran, why="it falls"), demands), "simulation"),
        (failed(ran, replace(demands, torques=0.99 * needed)), "torque"),
    ):
        assert broken is not None
        assert broken.kind == kind


def planned(name: str, edges: tuple[Edge, ...], **more: object) -> Plan | Refusal:
    climber, _ = climbing(name)
    away = -1.6 * climber.machine.tracks.length
    return plan(
        climber.machine,
        climber.demands,
        edges,
        away,
        posture(name),
        one_by_one,
        **more,  # type: ignore[arg-type]
    )


def test_two_steps_in_a_row() -> None:
    made = planned("ex13", (Edge(0.0, 0.4), Edge(9.0, 0.3)))
    assert isinstance(made, Plan), made
    assert made.run.T_step_root[-1, 2, 3] == pytest.approx(0.7, abs=3e-3)
    assert [phase.name for phase in made.motion.phases].count("sequence 1") == 2
    assert made.run.deepest < 1e-3
    assert made.run.slip < 5e-3


def test_up_and_down_again_on_the_other_side() -> None:
    made = planned("ex13", (Edge(0.0, 0.4), Edge(9.0, -0.4)))
    assert isinstance(made, Plan), made
    assert made.run.T_step_root[-1, 2, 3] == pytest.approx(0.0, abs=3e-3)
    names = [phase.name for phase in made.motion.phases]
    assert names.index("down sequence 2-1") < names.index("down sequence 1")
    assert made.run.slip < 5e-3


def test_a_top_that_is_too_short_is_told() -> None:
    made = planned("ex13", (Edge(0.0, 0.4), Edge(1.5, 0.3)))
    assert isinstance(made, Refusal)
    assert made.kind == "room"
    assert "too short" in made.why


@pytest.mark.parametrize(
    ("name", "height", "kind"), [("mini", 1.6, "reach"), ("ex13", 3.0, "reach")]
)
def test_what_is_too_high_is_told(name: str, height: float, kind: str) -> None:
    made = planned(name, (Edge(0.0, height),))
    assert isinstance(made, Refusal)
    assert made.kind == kind


def test_weak_joints_are_told() -> None:
    climber, _ = climbing("ex13")
    weak = replace(climber.demands, torques=np.full(4, 2e4))
    made = plan(climber.machine, weak, (Edge(0.0, 0.5),), -6.0, posture("ex13"), one_by_one)
    assert isinstance(made, Refusal)
    assert made.kind == "torque"
    assert "% of its torque" in made.why


def test_a_machine_that_would_tip_is_told() -> None:
    climber, _ = climbing("ex13")
    careful = replace(climber.demands, margin=1.3)
    made = plan(climber.machine, careful, (Edge(0.0, 0.5),), -6.0, posture("ex13"), one_by_one)
    assert isinstance(made, Refusal)
    assert made.kind == "stability"


def test_small_angles_to_the_edge_are_climbed_all_the_same() -> None:
    """What is left of an angle after squaring up: two degrees, in three dimensions."""
    climber, step = climbing("ex13")
    world = world_of(climber, step)
    made = manoeuvre(climber, step, HOLDING["ex13"], posture("ex13"), world.options.step)
    assert made.motion is not None
    turned = world_of(climber, step, turned=math.radians(2.0))
    ran = run(climber, turned, made.motion, kept=math.radians(3.0))
    assert ran.why == ""
    assert ran.T_step_root[-1, 2, 3] == pytest.approx(step.height, abs=0.02)


def test_legs_know_the_ground_around_them() -> None:
    up, down = legs((Edge(0.0, 0.4), Edge(5.0, -0.3)))
    assert (up.step.depth, up.step.before, up.down) == (5.0, math.inf, False)
    assert (down.step.depth, down.step.before, down.down) == (5.0, math.inf, True)
    assert down.z == pytest.approx(0.1)


def test_own_bodies_count() -> None:
    climber, step = climbing("mini")
    verdict, _ = judge(climber, step, HOLDING["mini"], own=own_bodies(climber))
    assert verdict.holds


def test_demands_by_the_machines_size() -> None:
    shovel, ex13 = (demands_of(climbing(n)[0].machine) for n in ("shovel", "ex13"))
    assert shovel.clearance < 0.01 < ex13.clearance
    assert shovel.margin < ex13.margin
