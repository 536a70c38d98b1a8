"""`cockpit gauge` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def gauge(
    file: Annotated[
        Path, typer.Argument(help="LandXML or Inframodel (.xml), CSV, a mesh, or IFC.")
    ],
    site: Annotated[
        str | None, typer.Option(help="Site whose CRS the file is in, whatever the file says.")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
    step: Annotated[
        float, typer.Option(help="Distance of the points along alignments, with --json [m].")
    ] = 1.0,
    svg: Annotated[Path | None, typer.Option(help="Also draw a plan into this .svg file.")] = None,
) -> None:
    """Say what a file of drawings or models holds: tracks, surfaces, cables, pipes, conflicts."""
    from cockpit.gauge import run_gauge

    run_gauge(file, site, json_, step, svg)
