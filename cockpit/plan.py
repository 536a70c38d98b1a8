"""`cockpit plan`: a task in, a trajectory out."""

from __future__ import annotations

import json
from pathlib import Path

from rich.console import Console

from backend.documents.plan import plan_document
from backend.documents.plan_document import PlanDocument, parse_plan_task
from backend.errors import InputError
from backend.planning.trajectory.penalty import STEPS, Iteration
from backend.planning.trajectory.plan import METHODS
from backend.shell.app.wire import dumps
from backend.site.site import load_site
from cockpit.states import States, read_text


def run_plan(path: Path, site_name: str | None, method: str | None, as_json: bool) -> None:
    """Prints the trajectory, or why there is none; method: the task's when None."""
    known = {name: name for name in METHODS}
    if method is not None and method not in known:
        raise InputError(f"--method {method} is not known; allowed are {', '.join(METHODS)}.")
    states = States(None if site_name is None else load_site(site_name), path.parent)
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON: {error}.") from error
    task = parse_plan_task(data, str(path))
    _, machines = states.parse(task.state.model_dump_json(), f"{path}: state")
    chosen = None if method is None else known[method]
    with Console(stderr=True).status(f"a trajectory for {task.machine}") as status:

        def told(step: Iteration) -> None:
            if step.number % 50 == 0:
                status.update(
                    f"step {step.number} of {STEPS}: {step.duration:.2f} s, beyond limits by "
                    f"{step.acceleration:.3g} (accelerations), {step.speed:.3g} (speeds), "
                    f"{step.place:.3g} (places)"
                )

        made = plan_document(task, machines, states.frame, str(path), states.bodies, chosen, told)
    print(dumps(made.model_dump()) if as_json else _words(made))


def _words(made: PlanDocument) -> str:
    if not made.ok and not made.violations:
        sure = "proven" if made.proven else "not proven"
        return f"no trajectory for {made.machine} ({sure}): {made.why}"
    assert made.checks is not None
    checks = made.checks
    lines = [
        f"{made.machine}: {made.duration:.2f} s, {len(made.time)} rows, {made.way}",
        f"  clearance    {_metres(checks.min_clearance, 'nothing in reach')}",
        f"  tipping      {_metres(checks.min_stability_margin, 'not judged')} to the nearest edge",
        f"  joints       {100 * checks.worst_rate:.0f} % of their speed, "
        f"{100 * checks.worst_acceleration:.0f} % of their acceleration at most",
    ]
    lines += [f"  note         {note}" for note in made.notes]
    return "\n".join([*lines, *(f"  VIOLATED     {found}" for found in made.violations)])


def _metres(value: float | None, none: str) -> str:
    return none if value is None else f"{value:.2f} m"
