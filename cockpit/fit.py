"""`cockpit fit`: a long search for the boxes of a machine's meshes, printed for its sidecar."""

from __future__ import annotations

import math

from rich.console import Console
from rich.progress import Progress

from backend.errors import InputError
from backend.machine.load import FitTask, fit_tasks
from backend.machine.long_fit import long_fit
from backend.machine.sidecar import BodiesTable, BoxTable
from backend.machine.stated import as_toml, boxes_of, tables_of


def run_fit(
    model: str, sidecar: str | None, links: tuple[str, ...], starts: int, seed: int
) -> None:
    """Prints the sidecar's table `[bodies.boxes]`: links that are not searched keep their boxes."""
    with Progress(console=Console(stderr=True), transient=True) as bar:
        reading = bar.add_task(f"reading {model}", total=1.0)
        tasks, side = fit_tasks(
            model, sidecar, progress=lambda text, share: bar.update(reading, completed=share)
        )
        bar.update(reading, completed=1.0)
        for name in links:
            if name not in tasks:
                known = ", ".join(tasks) or "none"
                raise InputError(f'--link "{name}" has nothing to fit; links that have: {known}.')
        found = dict(side.bodies.boxes)
        notes: dict[str, str] = {}
        for name in links or tuple(tasks):
            found[name], excess = _searched(name, tasks[name], side.bodies, starts, seed, bar)
            notes[name] = f"{excess:.3f} m beyond the meshes at most"
    ordered = {name: found[name] for name in tasks if name in found}
    print(as_toml(ordered, notes), end="")


def _searched(
    name: str, task: FitTask, stated: BodiesTable, starts: int, seed: int, bar: Progress
) -> tuple[tuple[BoxTable, ...], float]:
    row = bar.add_task(name, total=1.0)

    def report(share: float, least: float) -> None:
        best = "" if math.isinf(least) else f", best {least:.3f} m"
        bar.update(row, completed=share, description=f"{name}{best}")

    known = stated.boxes.get(name)
    begin = None if known is None else boxes_of(known)
    boxes, excess = long_fit(
        task.triangles, task.max_boxes, stated.max_excess, starts, seed, begin, report
    )
    return tables_of(boxes), excess
