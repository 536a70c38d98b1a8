"""`cockpit surmount`: a task in, a manoeuvre out."""

from __future__ import annotations

import json
import math
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from backend.documents.surmount import surmount_document
from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_task import parse_surmount_task
from backend.errors import InputError
from backend.shell.app.wire import dumps
from backend.shell.surmount_pool import Kept, Pool
from backend.site.site import load_site
from backend.surmount.halves import one_by_one
from cockpit.states import States, read_text


def run_surmount(path: Path, site_name: str | None, keep: Path | None, as_json: bool) -> None:
    """Prints the manoeuvre, or why there is none; keep: file of simulations, read and added to."""
    states = States(None if site_name is None else load_site(site_name), path.parent)
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON: {error}.") from error
    task = parse_surmount_task(data, str(path))
    _, machines = states.parse(task.state.model_dump_json(), f"{path}: state")
    # A dozen simulations are done before processes have begun.
    few = task.effort == "quick" and keep is None
    opened = one_by_one if few else Pool(Kept(keep))
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("a way", total=None)

        def told(done: int, of: int, words: str) -> bool:
            progress.update(bar, completed=done, total=of or None, description=words)
            return True

        made = surmount_document(
            task, machines, states.frame, opened, told, str(path), states.bodies
        )
    print(dumps(made.model_dump()) if as_json else words_of(made))


def words_of(made: SurmountDocument) -> str:
    """For people."""
    if not made.ok or made.obstacle is None or made.parameters is None or made.checks is None:
        return f"no way for {made.machine} ({made.kind}): {made.why}"
    p, checks = made.parameters, made.checks
    lines = [
        f"{made.machine}: a step of {made.obstacle.height:.3f} m in {made.duration:.0f} s "
        f"({made.method})",
        f"  parameters   P1 {p.p1:.3f}  P2 {p.p2:.3f}  P3 {p.p3:.3f}  P4 {p.p4:.3f} m, lean "
        f"{math.degrees(p.alpha_f):.1f} deg",
        f"  energy       {_joules(made.energy)} in the sequences; at least "
        f"{_joules(made.energy_quasi_static)} when slow, {_joules(made.energy_potential)} for the "
        f"heights; {_joules(made.energy_moves)} for the arm between",
        f"  tipping      {checks.min_stability_margin:.2f} m to the nearest edge",
        f"  clearance    {checks.min_clearance:.3f} m of bodies beside tracks and bucket",
        f"  simulated    at most {1e3 * (checks.max_penetration or 0.0):.2f} mm into the ground, "
        f"bucket slips {1e3 * (checks.max_slip or 0.0):.1f} mm",
    ]
    if checks.worst_torque is not None:
        lines.append(f"  joints       {100 * checks.worst_torque:.0f} % of their torque at most")
    for phase in made.phases:
        margin = phase.min_stability_margin
        firm = "" if margin is None else f", {margin:.2f} m from tipping"
        lines.append(f"  {phase.start:6.1f} s  {phase.name:18} {_joules(phase.energy)}{firm}")
    lines += [f"  assumed      {what}" for what in made.assumptions]
    return "\n".join([*lines, *(f"  note         {note}" for note in made.notes)])


def _joules(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.1f} J" if abs(value) < 1e4 else f"{1e-3 * value:.1f} kJ"
