"""`cockpit convert` and `cockpit export`: other programs' recordings, in and out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def convert(
    recording: Annotated[
        Path, typer.Argument(help="rosbag2 folder or file, CAN log, or table of poses.")
    ],
    site: Annotated[
        str, typer.Option("--site", help="Shipped site's name or path of a site file.")
    ],
    out: Annotated[Path, typer.Option(help="The .mcap file to write.")],
    dbc: Annotated[
        Path | None, typer.Option(help="CAN logs: the DBC; omitted: the one the map names.")
    ] = None,
    map_: Annotated[
        Path | None,
        typer.Option("--map", help="CAN logs: which signal is what; a shipped name or a file."),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Turn another program's recording into a session that this one plays."""
    from cockpit.convert import run_convert

    run_convert(recording, site, out, dbc, map_, json_)


def export(
    session: Annotated[Path, typer.Argument(help="Session: a file or a folder of files.")],
    format_: Annotated[str, typer.Option("--format", help="csv, parquet or ros2.")],
    out: Annotated[Path, typer.Option(help="The folder to write.")],
    site: Annotated[
        str | None, typer.Option(help="Site, where the session does not hold its own.")
    ] = None,
    source: Annotated[
        str,
        typer.Option(
            help="Tables of what was recorded, or of what is evaluated now; the default is "
            "recorded where there are snapshots."
        ),
    ] = "",
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Write a session as tables of poses, clearances and alarms, or as a ROS 2 recording."""
    from cockpit.export import run_export

    run_export(session, format_, out, site, source, json_)
