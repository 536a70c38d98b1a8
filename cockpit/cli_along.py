"""`cockpit along` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def along(
    track: Annotated[str, typer.Argument(help="Name of a track of the site.")],
    site: Annotated[
        str, typer.Option("--site", help="Shipped site's name or path of a site file.")
    ],
    machine: Annotated[str, typer.Option(help="Machine of the site that goes along the track.")],
    cycle: Annotated[
        Path | None,
        typer.Option(
            help="Work cycle: postures in degrees, .csv or .json; default: its simulated program."
        ),
    ] = None,
    start: Annotated[float | None, typer.Option("--from", help="First station [m].")] = None,
    end: Annotated[float | None, typer.Option("--to", help="Last station [m].")] = None,
    step: Annotated[float, typer.Option(help="Length of the pieces that are judged [m].")] = 0.5,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
    svg: Annotated[
        Path | None, typer.Option(help="Also draw clearance over station into this .svg file.")
    ] = None,
) -> None:
    """Where along a track would a machine's work cycle violate the limits? Stations from 0 m."""
    from cockpit.along import run_along

    run_along(track, site, machine, cycle, (start, end), step, json_, svg)
