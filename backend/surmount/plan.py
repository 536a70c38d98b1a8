"""A way over one edge or several, found and gone through: what the documents tell."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from backend.contact.spec import Options
from backend.contact.world import ContactWorld
from backend.errors import InputError
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.surmount.course import Edge, Leg, backwards, drive, legs, shifted, turned
from backend.surmount.ends import least_p4
from backend.surmount.judge import own_bodies
from backend.surmount.machine import Climber, climber
from backend.surmount.manoeuvre import Manoeuvre, joined, manoeuvre
from backend.surmount.moves import carried, move, on_ground, timed
from backend.surmount.outline import leans
from backend.surmount.records import Demands, Motion, Parameters, Step
from backend.surmount.run import WIDE, Run, options_of, run
from backend.surmount.search import Found, Job, Search, Simulate, Told

Effort = Literal["given", "quick", "thorough"]
Open = Callable[[Climber, Step], AbstractContextManager[Simulate]]
"""Gives what simulates halves of manoeuvres of that machine over that step, in parallel or not."""

TRIED = 12
"""Of the quick search that are simulated."""
VERIFIED = 12
"""Whole manoeuvres that are gone through at most before a leg is given up."""
OFFERED = 6
"""Candidates that are told."""
SLIPS, SINKS = 0.005, 0.001
"""No manoeuvre is told whose bucket slips farther, or of which anything is deeper in the ground
[m].
"""
APART = 0.03
"""Shorter drives than this share of the crawler's base are left out."""


@dataclass(frozen=True)
class Refusal:
    """kind: room, reach, collision, stability, torque or simulation; why: one sentence."""

    kind: str
    why: str


@dataclass(frozen=True, eq=False)
class LegPlan:
    """climber: as it goes up; leg; made: as it is gone up; found: the chosen parameters;
    candidates: these and others, the best first; simulations: halves that were simulated.
    """

    climber: Climber
    leg: Leg
    made: Manoeuvre
    found: Found
    candidates: tuple[Found, ...]
    simulations: int


@dataclass(frozen=True, eq=False)
class Plan:
    """climber; legs; motion, in the course's frame (origin on the ground at the first edge), and
    run, what it was in MuJoCo, in the same frame.
    """

    climber: Climber
    legs: tuple[LegPlan, ...]
    motion: Motion
    run: Run


def demands_of(
    machine: Machine,
    payload: float = 0.0,
    friction: float = 0.7,
    clearance: float | None = None,
    margin: float | None = None,
    pace: float = 0.5,
) -> Demands:
    """What is demanded where nothing else is said: a hundredth of the tracks' length of clearance,
    a twentieth of their gauge of margin, half of full speed."""
    tracks = machine.tracks
    return Demands(
        payload=payload,
        friction=friction,
        clearance=0.01 * tracks.length if clearance is None else clearance,
        margin=0.05 * tracks.gauge if margin is None else margin,
        pace=pace,
        torques=machine.max_torque,
    )


def plan(
    machine: Machine,
    demands: Demands,
    edges: tuple[Edge, ...],
    x: float,
    q: Array,
    opened: Open,
    effort: Effort = "quick",
    given: Parameters | None = None,
    spline: bool = False,
    p4: float | None = None,
    depth: float = math.inf,
    told: Told = lambda done, of, words: True,
) -> Plan | Refusal:
    """From P_b at x [m] before the first edge (negative), arm in q (n,), over all edges.

    given: parameters of the only edge, instead of a search; spline: whether sequence 1 may rise by
    a spline where that needs less; p4: else the least at which it stands; depth: of the level
    ground behind the last edge [m].
    """
    ahead = climber(machine, demands)
    dt = options_of(ahead).step
    parts: list[Motion] = []
    plans: list[LegPlan] = []
    place, posture, ground = x, np.array(q, dtype=float), 0.0
    for number, leg in enumerate(legs(edges, depth)):
        which = "" if len(edges) == 1 else f"edge {number + 1}: "
        up = climber(machine, replace(demands, facing=-demands.facing)) if leg.down else ahead
        made = _leg(up, leg, posture, dt, opened, effort, given, spline, p4, told)
        if isinstance(made, Refusal):
            return Refusal(made.kind, which + made.why)
        parameters, motion = made.found.parameters, made.made.motion
        assert motion is not None
        places = place, leg.x - (parameters.p4 if leg.down else parameters.p1)
        if abs(places[1] - places[0]) > APART * 2.0 * ahead.a:
            parts.append(drive(ahead, posture, places, ground, dt))
        if leg.down:
            motion = shifted(turned(backwards(motion)), leg.x, leg.z)
            folding = _fold(up, leg, made, posture, motion.q[0], dt)
            if isinstance(folding, Refusal):
                return Refusal(folding.kind, which + folding.why)
            parts.append(folding)
        else:
            motion = shifted(motion, leg.x, leg.z)
        parts.append(motion)
        posture = motion.q[-1]
        place = leg.x + (parameters.p1 if leg.down else parameters.p4)
        ground += edges[number].rise
        plans.append(made)
    motion = joined(parts, dt)
    world, low = course_world(ahead, edges)
    if not told(0, 0, "the whole manoeuvre is gone through"):
        return Refusal("cancelled", "cancelled")
    raised = shifted(motion, 0.0, -low)
    made_run = run(ahead, world, raised)
    T = made_run.T_step_root.copy()
    T[:, 2, 3] += low
    made_run = replace(made_run, T_step_root=T, edge=made_run.edge + np.array([0.0, 0.0, low]))
    refusal = failed(made_run, demands)
    return refusal if refusal is not None else Plan(ahead, tuple(plans), motion, made_run)


def failed(made: Run, demands: Demands) -> Refusal | None:
    """What does not hold in the simulation, whatever was worked out before; None where all does."""
    if made.why:
        return Refusal("simulation", made.why)
    shares = np.abs(made.torques).max(axis=0) / demands.torques
    if shares.max() > 1.0:
        why = f"when gone through, a joint needs {100.0 * float(shares.max()):.0f} % of its torque"
        return Refusal("torque", why)
    if made.slip > SLIPS or made.deepest > SINKS:
        why = f"the bucket slips {1e3 * made.slip:.0f} mm, {1e3 * made.deepest:.1f} mm deep at most"
        return Refusal("simulation", why)
    return None


def course_terrain(ahead: Climber, edges: tuple[Edge, ...]) -> tuple[Boxes, float]:
    """The ground between the edges as boxes on the plane z = 0, and the height [m] of that plane in
    the course's frame, which is that of the lowest ground."""
    wide = WIDE * ahead.machine.max_reach
    levels = np.concatenate([[0.0], np.cumsum([edge.rise for edge in edges])])
    low = float(levels.min())
    xs = [-2.0 * wide, *(edge.x for edge in edges), edges[-1].x + 2.0 * wide]
    centres, halves = [], []
    for level, a, b in zip(levels - low, xs[:-1], xs[1:], strict=True):
        if level > 1e-9:
            centres.append([0.5 * (a + b), 0.0, 0.5 * level])
            halves.append([0.5 * (b - a), wide, 0.5 * level])
    turns = np.broadcast_to(np.eye(3), (len(halves), 3, 3)).copy()
    return Boxes(np.array(centres), turns, np.array(halves)), low


def course_world(
    ahead: Climber, edges: tuple[Edge, ...], options: Options | None = None
) -> tuple[ContactWorld, float]:
    """The machine among these edges, and the height of its z = 0 in the course's frame [m]."""
    boxes, low = course_terrain(ahead, edges)
    chosen = options_of(ahead) if options is None else options
    return ContactWorld(ahead.machine, ahead.demands.payload, boxes, chosen), low


def _leg(
    up: Climber,
    leg: Leg,
    posture: Array,
    dt: float,
    opened: Open,
    effort: Effort,
    given: Parameters | None,
    spline: bool,
    p4: float | None,
    told: Told,
) -> LegPlan | Refusal:
    step = leg.step
    try:
        leans(step.height, up.a, up.r)
    except InputError as error:
        kind, _, why = str(error).partition(": ")
        return Refusal(kind, why.rstrip("."))
    with opened(up, step) as simulate:
        search = Search(up, step, least_p4(up, step) if p4 is None else p4, simulate, told)
        if given is not None:
            energies = search.energies([Job("front", given), Job("back", given)])
            candidates = [Found(given, sum(energies), "given")]
        else:
            candidates = _searched(search, effort)
        if not candidates:
            return _refused(search)
        if spline and effort == "thorough":
            candidates = [search.bent(candidates[0]), *candidates]
        last: Manoeuvre | None = None
        for found in candidates[:VERIFIED]:
            start = _folded(up, step, found.parameters, posture, leg.down)
            made = manoeuvre(up, step, found.parameters, start, dt, found.spline, search.own)
            if made.motion is not None:
                others = tuple(one for one in candidates if one is not found)
                return LegPlan(
                    up, leg, made, found, (found, *others[: OFFERED - 1]), search.simulations
                )
            last = made
    assert last is not None
    return Refusal(last.kind, last.why)


def _searched(search: Search, effort: Effort) -> list[Found]:
    if effort == "quick":
        found = search.batch(simulated=False)
        found = _distinct(found, search, TRIED)
        jobs = [Job(half, one.parameters) for one in found for half in ("front", "back")]
        values = search.energies(jobs, "simulated")
        found = [
            replace(one, energy=a + b, by="quick")
            for one, a, b in zip(found, values[::2], values[1::2], strict=True)
        ]
        return sorted((f for f in found if math.isfinite(f.energy)), key=lambda f: f.energy)
    coarse = search.batch()
    if not coarse:
        return []
    starts = _distinct(coarse, search, 3)
    best = min((search.slsqp(one) for one in starts), key=lambda one: one.energy)
    best = search.settled(best)
    return [best, *_distinct(coarse, search, OFFERED)]


def _distinct(found: list[Found], search: Search, count: int) -> list[Found]:
    """The best first, leaving out what is much like one before."""
    scale = np.array([search.boom] * 3 + [1.0])
    chosen: list[Found] = []
    for one in found:
        free = one.parameters.free / scale
        if all(np.abs(free - c.parameters.free / scale).max() > 0.07 for c in chosen):
            chosen.append(one)
        if len(chosen) == count:
            break
    return chosen


def _refused(search: Search) -> Refusal:
    """What came nearest to holding, in words: the kind that is met last on the way there."""
    order = ("slip", "torque", "stability", "collision", "reach", "room")
    for kind in order:
        if kind in search.refusals:
            verdict = search.refusals[kind][1]
            return Refusal(kind, f"whatever the parameters, {verdict.why}")
    return Refusal("simulation", "every manoeuvre that holds by its geometry slides or falls")


def _folded(
    up: Climber, step: Step, parameters: Parameters, posture: Array, down: bool
) -> Array | None:
    """The posture the arm is in before sequence 1, or after it when that is gone back."""
    if not down:
        return posture
    stance = on_ground(up, -parameters.p1, 0.0)
    return carried(up, step, stance, np.zeros(1), None)


def _fold(
    up: Climber, leg: Leg, made: LegPlan, posture: Array, end: Array, dt: float
) -> Motion | Refusal:
    """The arm's way to where the manoeuvre back down begins, in the course's frame."""
    stance = on_ground(up, made.found.parameters.p4, leg.step.height)
    begin = posture.copy()
    begin[0] += 2.0 * np.pi * np.round((end[0] - posture[0]) / (2.0 * np.pi))
    fold = move(up, leg.step, stance, begin, end, (False, False), own_bodies(up))
    if fold.why:
        return Refusal("collision", f"fold: {fold.why}")
    motion = timed(up, stance, "fold", fold, (None, None), dt)
    return shifted(turned(motion), leg.x, leg.z)
