"""`cockpit detect` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def detect(
    clouds: Annotated[
        list[Path],
        typer.Argument(
            metavar="CLOUD...",
            help="PCD, PLY or LAS files, in metres, z up; several are scans, in their order.",
        ),
    ],
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Also write the boxes as CSV, which `cockpit track` reads.")
    ] = None,
    stages: Annotated[
        Path | None,
        typer.Option(help="Also write what became of every point, as arrays of numpy (.npz)."),
    ] = None,
    ground: Annotated[
        bool, typer.Option(help="Look for the ground and take it out; or there is none.")
    ] = True,
    ground_by: Annotated[
        str,
        typer.Option(help='How the ground is looked for: msac, or "scikit-learn" (an extra).'),
    ] = "msac",
    link: Annotated[
        float, typer.Option(help="Points nearer than this are one object, 0.1 to 2 m.")
    ] = 0.4,
    origin: Annotated[
        str,
        typer.Option(help="The sensor's place x,y,z in metres; else a PCD's viewpoint, or 0,0,0."),
    ] = "",
    reach: Annotated[
        float, typer.Option(help="Only what is within this many metres of the sensor counts.")
    ] = 25.0,
    period: Annotated[float, typer.Option(help="Seconds from one file to the next.")] = 0.1,
    stamped: Annotated[
        bool,
        typer.Option("--stamped", help="Files are named by their times, e.g. 1700000000.1.pcd."),
    ] = False,
) -> None:
    """Find people and objects in a LiDAR's point clouds."""
    from cockpit.detect import Times, run_detect

    times = Times(period, stamped)
    run_detect(clouds, json_, out, ground, link, origin, reach, times, stages, ground_by)
