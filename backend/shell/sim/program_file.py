"""The `[machine.sim]` table of a site file as a Program. Degrees only in the file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.shell.sim.dynamics import limits_of
from backend.shell.sim.postures import Spot, default_spots, joints_from, middle
from backend.shell.sim.program import ACTIONS, PROGRAMS, Program, Step, motions
from backend.site.site import Site
from backend.spatial.types import Array

FIELDS = ("cycle", "dig", "dump", "period", "postures", "script", "script_length", "variation")


def start_posture(machine: Machine, site: Site, name: str) -> Array:
    """(n,) joint values at which the site puts the machine; the middle of the range by default."""
    entry = site.machine(name)
    values = entry.start.joints if entry.start else {}
    return joints_from(
        machine, values, middle(machine), f"{site.path.name}: machine {name!r}: start.joints_deg"
    )


def load_program(machine: Machine, site: Site, name: str) -> Program:
    """The program of the machine `name` of the site, checked: reachable, fast enough, continuous.

    Raises InputError with the file, the field and what is allowed.
    """
    sim = site.machine(name).sim
    source = f"{site.path.name}: machine {name!r}: sim"
    details = sim.details
    for field in details:
        if field not in FIELDS:
            raise InputError(
                f'{source}: "{field}" is not a field; allowed are {", ".join(FIELDS)}.'
            )
    if sim.program not in PROGRAMS:
        raise InputError(
            f'{source}.program: "{sim.program}" is no program; allowed are {", ".join(PROGRAMS)}.'
        )
    start = start_posture(machine, site, name)
    default_dig, default_dump = default_spots(machine, start)
    postures = _postures(details.get("postures", {}), machine, start, f"{source}.postures")
    script: tuple[Step, ...] = ()
    cycle: tuple[Step, ...] = ()
    if sim.program == "dig-swing-dump":
        script = _steps(details.get("script", ()), postures, f"{source}.script")
        stated = details.get("cycle", ())
        cycle = _steps(stated, postures, f"{source}.cycle") if stated else default_cycle()
    postures.setdefault("start", start)
    last = [step for step in cycle if step.action == "go"]
    if cycle and (not last or cycle[-1].action not in ("go", "hold")):
        raise InputError(
            f"{source}.cycle: the last motion is not a 'go'; it must be, to a posture."
        )
    program = Program(
        machine=machine,
        limits=limits_of(machine),
        start=start,
        home=postures[last[-1].posture] if last else start,
        postures=postures,
        script=script,
        script_length=_number(details, "script_length", source, 0.0) if script else 0.0,
        cycle=cycle,
        period=_number(details, "period", source, DEFAULT_PERIOD),
        dig=_spot(details.get("dig"), "depth", default_dig, f"{source}.dig"),
        dump=_spot(details.get("dump"), "height", default_dump, f"{source}.dump"),
        seed=sim.seed,
        variation=_number(details, "variation", source, 1.0),
        source=source,
    )
    return _checked(program)


DEFAULT_PERIOD = 40.0


def default_cycle() -> tuple[Step, ...]:
    """Dig, swing, dump, back: for machines whose site states no cycle of its own."""
    return (Step(0.0, "dig"), Step(16.0, "dump"), Step(28.0, "go", "start"))


def _checked(program: Program) -> Program:
    """Makes every kind of lap once, so that errors show at the start and not in an hour."""
    if program.script:
        moved = motions(program, -1)
        if program.cycle and (
            not moved or not np.allclose(moved[-1].goal, program.home, atol=1e-9)
        ):
            raise InputError(
                f"{program.source}.script: it must end with a 'go' to the posture that the cycle "
                "ends with."
            )
    if program.cycle:
        for lap in range(3):
            motions(program, lap)
    return program


def _number(table: Mapping[str, Any], field: str, source: str, default: float) -> float:
    value = table.get(field, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < math.inf:
        raise InputError(f"{source}.{field} is {value!r}; allowed is a number of 0 or more.")
    return float(value)


def _postures(table: object, machine: Machine, start: Array, source: str) -> dict[str, Array]:
    """Postures by name; joints that are not named are as at the start."""
    if not isinstance(table, Mapping):
        raise InputError(f"{source} is {table!r}; allowed are named tables of joint values.")
    postures = {}
    for name, joints in table.items():
        where = f"{source}.{name}"
        if not isinstance(joints, Mapping):
            raise InputError(f"{where} is {joints!r}; allowed is a table of joint values [deg].")
        degrees = {role: _signed(value, f"{where}.{role}") for role, value in joints.items()}
        radians = {role: math.radians(value) for role, value in degrees.items()}
        postures[str(name)] = joints_from(machine, radians, start, where)
    return postures


def _signed(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(f"{where} is {value!r}; allowed is a number.")
    return float(value)


def _steps(rows: object, postures: Mapping[str, Array], source: str) -> tuple[Step, ...]:
    if not isinstance(rows, (list, tuple)):
        raise InputError(f"{source} is {rows!r}; allowed is a list of steps.")
    steps = tuple(_step(row, postures, f"{source}[{i}]") for i, row in enumerate(rows))
    for earlier, later in pairwise(steps):
        if later.t < earlier.t:
            raise InputError(f"{source}: t = {later.t:g} follows {earlier.t:g}; it must not fall.")
    return steps


def _step(row: object, postures: Mapping[str, Array], where: str) -> Step:
    if not isinstance(row, Mapping):
        raise InputError(f"{where} is {row!r}; allowed is a table with t and action.")
    for field in row:
        if field not in ("t", "action", "to", "for"):
            raise InputError(f'{where}: "{field}" is not a field; allowed are t, action, to, for.')
    action = row.get("action")
    if action not in ACTIONS:
        raise InputError(f"{where}.action is {action!r}; allowed are {', '.join(ACTIONS)}.")
    posture = str(row.get("to", "start"))
    if action == "go" and posture not in postures and posture != "start":
        known = ", ".join([*postures, "start"])
        raise InputError(f'{where}.to is "{posture}"; allowed are {known}.')
    seconds = _number(row, "for", where, 0.0) if "for" in row else None
    if action == "cut" and not seconds:
        raise InputError(f'{where}: a cut lasts "for" some seconds, which are missing.')
    return Step(_number(row, "t", where, 0.0), str(action), posture, seconds)


def _spot(table: object, vertical: str, default: Spot, where: str) -> Spot:
    """A spot of the file; `vertical` is "depth" (downwards) or "height" (upwards)."""
    if table is None:
        return default
    allowed = ("azimuth_deg", "reach", vertical)
    if not isinstance(table, Mapping) or not set(table) <= set(allowed):
        raise InputError(f"{where} is {table!r}; allowed are the fields {', '.join(allowed)}.")
    values = {field: _signed(value, f"{where}.{field}") for field, value in table.items()}
    sign = -1.0 if vertical == "depth" else 1.0
    azimuth = values.get("azimuth_deg")
    return Spot(
        default.azimuth if azimuth is None else math.radians(azimuth),
        values.get("reach", default.reach),
        sign * values[vertical] if vertical in values else default.height,
    )
