"""One half of a manoeuvre in MuJoCo: what the search asks for, again and again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from backend.contact.world import ContactWorld
from backend.surmount.judge import judge
from backend.surmount.machine import Climber
from backend.surmount.records import Step
from backend.surmount.run import fine, run, world_of
from backend.surmount.search import HALVES, ROWS, Job, Simulate, Simulated


def simulated(climber: Climber, step: Step, world: ContactWorld, job: Job) -> Simulated:
    """The energy (19) of its sequences, each from rest in the place where it begins."""
    names = HALVES[job.half]
    parameters, spline = job.parameters, job.spline
    _, sequences = judge(climber, step, parameters, spline, ROWS, names=names)
    energy = 0.0
    for one in sequences:
        motion = fine(climber, step, parameters, one, world.options.step, spline)
        made = run(climber, world, motion)
        if made.why:
            return Simulated(math.inf, f"{one.name}: {made.why}")
        energy += made.total
    return Simulated(energy if sequences else math.inf, "" if sequences else "cannot begin")


@contextmanager
def one_by_one(climber: Climber, step: Step) -> Iterator[Simulate]:
    """What simulates halves here, one after the other."""
    world = world_of(climber, step)

    def simulate(jobs: Sequence[Job]) -> list[Simulated]:
        return [simulated(climber, step, world, job) for job in jobs]

    yield simulate
