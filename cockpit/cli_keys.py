"""`cockpit keys`: what a site needs for an authenticated and encrypted link."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

LinkConfig = Annotated[
    Path | None,
    typer.Option(help="Zenoh configuration (JSON5) for the link, such as `cockpit keys` makes."),
]


def keys(
    site: Annotated[str, typer.Argument(help="Shipped site's name or path of a site file.")],
    out: Annotated[Path, typer.Option(help="Folder to write: one folder per party in it.")],
    backend: Annotated[
        list[str] | None,
        typer.Option(help="NAME=HOST,HOST: a backend and where machines reach it; repeatable."),
    ] = None,
    listener: Annotated[
        list[str] | None,
        typer.Option(help="Name of a host that hears everything and says nothing; repeatable."),
    ] = None,
    port: Annotated[int, typer.Option(min=1, max=65535, help="Of the backends' link.")] = 7447,
    days: Annotated[int, typer.Option(min=1, max=3650, help="How long certificates hold.")] = 365,
    renew: Annotated[
        bool, typer.Option("--renew", help="New certificates also for those who have one.")
    ] = False,
) -> None:
    """Make a private authority, a certificate for each machine and backend, and their rules."""
    from cockpit.keys import run_keys

    run_keys(site, out, tuple(backend or ()), tuple(listener or ()), port, days, renew)
