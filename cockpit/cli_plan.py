"""`cockpit plan` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def plan(
    task: Annotated[Path, typer.Argument(help="The task, JSON; see cockpit schema plan-task.")],
    site: Annotated[
        str | None,
        typer.Option("--site", help="Shipped site's name or path; omitted: a local frame."),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="Of the timing: toppra or casadi; or penalty, the one of Yamashita 2025, to "
            "compare with. Omitted: the task's.",
            show_default=False,
        ),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Find a trajectory to a goal that touches nothing and does not tip, or say what blocks."""
    from cockpit.plan import run_plan

    run_plan(task, site, method, json_)
