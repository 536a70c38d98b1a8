"""What plans trajectories, in a process of its own: it answers questions and knows nothing else."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from backend.control.follow import Trajectory
from backend.documents.plan import planned
from backend.documents.plan_document import PlanDocument
from backend.documents.plan_live import LiveTask
from backend.machine.model import Machine
from backend.planning.trajectory.holds import broken, nearest
from backend.planning.trajectory.records import Obstacles
from backend.spatial.types import Array


class Look(NamedTuple):
    """Whether what is left of a way, q (m, n), is still free. before: see `holds.broken`."""

    machine: str
    obstacles: Obstacles
    q: Array
    keep: float
    before: Mapping[str, float]


class Answer(NamedTuple):
    """before: what was near at the start, by name [m]."""

    document: PlanDocument
    trajectory: Trajectory | None
    before: Mapping[str, float]
    seconds: float


def begin(machines: Mapping[str, Machine]) -> Callable[[LiveTask | Look], Any]:
    """What answers: a task with an `Answer`, a look with what is in the way, empty if nothing."""

    def work(question: LiveTask | Look) -> Answer | str:
        machine = machines[question.machine]
        if isinstance(question, Look):
            found = broken(machine, question.obstacles, question.q, question.keep, question.before)
            return "" if found is None else found.name
        task, began = question.task, time.monotonic()
        document, made = planned(
            question.machine, machine, task, question.obstacles, question.T_site_root
        )
        before = nearest(machine, question.obstacles, task.q, task.clearance)
        seconds = time.monotonic() - began
        if made is None:
            return Answer(document, None, before, seconds)
        return Answer(document, Trajectory(made.time, made.q, made.rates), before, seconds)

    return work
