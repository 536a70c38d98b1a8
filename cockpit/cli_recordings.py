"""`cockpit recordings`: what was recorded, and keeping some of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

recordings = typer.Typer(
    help="List recordings, or pin the last minutes so that they are never deleted.",
    invoke_without_command=True,
)

Folder = Annotated[
    Path | None,
    typer.Option(help="Folder of all recordings, as given to --record; default: the user's."),
]


@recordings.callback()
def list_recordings(
    context: typer.Context,
    folder: Folder = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """List all recordings, the pinned ones too."""
    if context.invoked_subcommand is None:
        from cockpit.recordings import run_list

        run_list(folder, json_)


@recordings.command()
def pin(
    name: Annotated[str, typer.Argument(help="What to call it.")],
    minutes: Annotated[
        float, typer.Option(min=0.01, max=100_000.0, help="How much, back from now [min].")
    ] = 10.0,
    site: Annotated[
        str, typer.Option(help="Name of the site; default: the one recorded last.")
    ] = "",
    folder: Folder = None,
) -> None:
    """Keep the last minutes of a site's recording for good, also while it is being written."""
    from cockpit.recordings import run_pin

    run_pin(name, minutes, site, folder)
