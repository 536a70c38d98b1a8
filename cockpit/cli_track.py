"""`cockpit track` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def track(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="IN.csv",
            help="Detections: header time,x,y plus any of z,yaw,length,width,height; rows of one "
            "scan share their time, a scan without detections is one row with blank x,y. Or KITTI "
            "tracking labels (.txt).",
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="CSV of tracks; printed without it.")] = None,
    sigma: Annotated[float, typer.Option(help="Standard deviation of x and y [m].")] = 0.08,
    detected: Annotated[
        float, typer.Option(help="Probability that somebody in sight is detected in a scan.")
    ] = 0.95,
    clutter: Annotated[
        float, typer.Option(help="False detections per scan and square metre.")
    ] = 1e-3,
    coast: Annotated[
        float, typer.Option(help="How long a track that is not seen is kept [s].")
    ] = 3.0,
    kitti: Annotated[
        bool, typer.Option("--kitti", help="KITTI tracking labels, whatever the file's name.")
    ] = False,
    period: Annotated[float, typer.Option(help="Seconds from one KITTI frame to the next.")] = 0.1,
) -> None:
    """Follow people and objects through recorded detections, and say where they are in a second."""
    from backend.tracking.records import Settings
    from cockpit.track import run_track

    settings = Settings(detected=detected, clutter=clutter, coast=coast)
    run_track(source, out, sigma, settings, kitti, period)
