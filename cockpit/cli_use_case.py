"""`cockpit use-case` on the command line."""

from __future__ import annotations

from typing import Annotated

import typer


def use_case(
    name: Annotated[str, typer.Argument(help="pole, or ballast.")],
    method: Annotated[
        str,
        typer.Option(help="none, scaling, potential, constrained; default: all of them."),
    ] = "",
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Run a use case of the working gauge in simulated time (Mäkinen 2021, Chapter 4)."""
    from cockpit.use_case import run_use_case_command

    run_use_case_command(name, method, json_)
