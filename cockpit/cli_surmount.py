"""`cockpit surmount` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def surmount(
    task: Annotated[Path, typer.Argument(help="The task, JSON; see cockpit schema surmount-task.")],
    site: Annotated[
        str | None,
        typer.Option("--site", help="Shipped site's name or path; omitted: a local frame."),
    ] = None,
    keep: Annotated[
        Path | None,
        typer.Option(
            help="File of simulations: an interrupted search goes on from what it holds.",
            show_default=False,
        ),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Find how to surmount a step with the arm (Jayasekara and Arisumi 2015), or say what forbids.

    Ctrl-C cancels.
    """
    from cockpit.surmount import run_surmount

    run_surmount(task, site, keep, json_)
