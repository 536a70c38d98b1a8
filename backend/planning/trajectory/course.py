"""Where a trajectory leads: what is asked of it, and a free curve from the start to the goal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.planning.trajectory.carry import Carry, carry_of, goals
from backend.planning.trajectory.curve import Curve, free_curve
from backend.planning.trajectory.records import Obstacles, Refusal, Task
from backend.planning.trajectory.sweep import CONTACT, Sweep, make_sweep
from backend.planning.trajectory.way import Way, find_way
from backend.spatial.types import Array
from backend.stability.dynamics import rest_wrench
from backend.stability.masses import MassModel, mass_model, why_unknown
from backend.stability.polygon import Polygon, shrunk, support_polygon
from backend.stability.zmp import moments_of


class Setting(NamedTuple):
    """A task with what every way to its goal is judged by.

    sweep: obstacles and distances to keep; ends: (g, n) postures at the goal, the nearest turn
    first; masses: None where they are not known; whole: the support polygon, kept: what the task
    leaves of it; notes: what is not judged, in words.
    """

    sweep: Sweep
    carry: Carry
    ends: Array
    masses: MassModel | None
    whole: Polygon
    kept: Polygon
    notes: tuple[str, ...]


class Course(NamedTuple):
    """The way that was found, and a free curve along it."""

    way: Way
    curve: Curve


def setting(machine: Machine, task: Task, obstacles: Obstacles) -> Setting | Refusal:
    """Refused where start or goal cannot be; raises InputError for a task that makes no sense."""
    _check(machine, task)
    carry, notes = carry_of(machine, task.q), list[str]()
    why = why_unknown(machine)
    masses = None if why else mass_model(machine, task.payload)
    if why:
        notes.append(f"{why}: tipping over was not judged")
    whole = support_polygon(machine)
    kept = shrunk(whole, task.share)
    sweep = make_sweep(machine, obstacles, task.clearance)
    refused = _start(task, sweep, masses, kept)
    if refused is not None:
        return refused
    sweep = sweep.relaxed(task.q)
    ends = goals(machine, task, sweep)
    if isinstance(ends, Refusal):
        return ends
    if not stands(masses, kept, task, ends).all():
        return Refusal("tips", _tips("at the goal", masses, kept, task, ends[0]), proven=True)
    if np.abs(ends[0] - task.q).max() < 1e-6:
        raise InputError("task: the goal is where the machine is.")
    return Setting(sweep, carry, ends, masses, whole, kept, tuple(notes))


def course(machine: Machine, task: Task, within: Setting) -> Course | Refusal:
    """A way that touches nothing and does not tip at rest, rounded off."""
    wide = within.sweep.widened(np.concatenate([task.q[None], within.ends]))
    masses, kept = within.masses, within.kept
    way = find_way(
        machine,
        task,
        wide,
        within.carry,
        within.ends,
        lambda q: bool(stands(masses, kept, task, q).all()),
    )
    if isinstance(way, Refusal):
        return way
    curve = free_curve(machine, way.points, 1.0 / task.max_velocity(machine), within.sweep)
    if curve is None:
        return Refusal("not found", "the way found is too tight to be rounded off.")
    return Course(way, curve)


def stands(masses: MassModel | None, support: Polygon, task: Task, q: Array) -> Array:
    """(m,) whether the machine at rest in postures (m, n) presses inside of `support`."""
    if masses is None:
        return np.ones(len(q), dtype=bool)
    return np.asarray(_at_rest(masses, support, task, q).min(axis=-1) >= 0.0)


def _at_rest(masses: MassModel, support: Polygon, task: Task, q: Array) -> Array:
    return moments_of(rest_wrench(masses, q, task.T_site_root), support)


def _tips(where: str, masses: MassModel | None, support: Polygon, task: Task, q: Array) -> str:
    assert masses is not None
    edge = support.names[int(_at_rest(masses, support, task, q[None])[0].argmin())]
    load = f" with {task.payload:g} kg" if task.payload > 0.0 else ""
    return (
        f"{where} the machine{load} is too near to tipping over its {edge} edge: less than "
        f"{100 * task.share:.0f} % of the way to it is left."
    )


def _check(machine: Machine, task: Task) -> None:
    if task.q.shape != (len(machine.joints),):
        raise InputError(f"task: q has {len(task.q)} values; {machine.name} has a joint for each.")
    outside = (task.q < machine.lower - 1e-6) | (task.q > machine.upper + 1e-6)
    if outside.any():
        role = machine.joints[int(np.argmax(outside))].role
        raise InputError(f"task: {role} is beyond its ends; no trajectory begins there.")


def _start(task: Task, sweep: Sweep, masses: MassModel | None, support: Polygon) -> Refusal | None:
    touching = [name for d, name in sweep.near(task.q) if d < CONTACT]
    if touching:
        why = f"at the start the machine touches {touching[0]}."
        return Refusal("start", why, tuple(touching), proven=True)
    if not stands(masses, support, task, task.q[None]).all():
        return Refusal("tips", _tips("at the start", masses, support, task, task.q), proven=True)
    return None
