"""`cockpit play` and `cockpit diff`: recorded sessions, seen again and judged anew."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import Annotated

import typer

from backend.errors import InputError
from cockpit.cli_entry import Cert, InsecureHttp, Key, NoLogin, SelfSigned, UsersFile

Seen = Annotated[
    str | None,
    typer.Option("--site", help="Site to see it on; default: the one in the recording."),
]
SOURCES = ("recorded", "evaluated")


def add_commands(app: typer.Typer, interrupted: Callable[[], Event]) -> None:
    """Adds both commands. interrupted: makes an event that Ctrl-C and SIGTERM set."""

    @app.command()
    def play(
        path: Annotated[
            Path | None,
            typer.Argument(help="Session (.mcap) or a folder of its parts; default: the newest."),
        ] = None,
        site: Seen = None,
        host: Annotated[
            str, typer.Option(help="Address of the page; loopback unless told otherwise.")
        ] = "127.0.0.1",
        port: Annotated[int, typer.Option(help="Port of the page; 0 takes any free one.")] = 8000,
        no_browser: Annotated[
            bool, typer.Option("--no-browser", help="Do not open a browser.")
        ] = False,
        source: Annotated[
            str | None,
            typer.Option(help="recorded: as it was; evaluated: as this program judges it now."),
        ] = None,
        speed: Annotated[float, typer.Option(min=0.1, max=50.0, help="Times real time.")] = 1.0,
        begin: Annotated[
            float,
            typer.Option("--from", min=0.0, help="Where to begin, in seconds since its beginning."),
        ] = 0.0,
        users: UsersFile = None,
        no_login: NoLogin = False,
        cert: Cert = None,
        key: Key = None,
        self_signed: SelfSigned = False,
        insecure_http: InsecureHttp = False,
    ) -> None:
        """Play a recorded session in the whole cockpit. Nothing can reach a machine."""
        if source is not None and source not in SOURCES:
            raise InputError(f'--source "{source}" is unknown; allowed are {", ".join(SOURCES)}.')
        from backend.control.person import SUPERVISOR, Person
        from cockpit.entry import EntryOptions, decide
        from cockpit.play import run_play

        options = EntryOptions(users, no_login, False, cert, key, self_signed, insecure_http)
        entry = decide(options, host, link_for=Person("playback", SUPERVISOR))
        run_play(path, site, entry, port, not no_browser, source, speed, begin, interrupted())

    @app.command()
    def diff(
        path: Annotated[Path, typer.Argument(help="Session (.mcap) or a folder of its parts.")],
        site: Seen = None,
        json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
    ) -> None:
        """Judge a session anew and compare: distances, levels, first warnings."""
        from cockpit.diff import run_diff

        run_diff(path, site, json_)

    @app.command()
    def report(
        path: Annotated[Path, typer.Argument(help="Session (.mcap) or a folder of its parts.")],
        out: Annotated[Path, typer.Option(help="The .html file to write.")],
        site: Seen = None,
        source: Annotated[
            str, typer.Option(help="recorded or evaluated; default: recorded where it was.")
        ] = "",
        with_diff: Annotated[
            bool, typer.Option("--diff", help="Also what this program judges otherwise.")
        ] = False,
    ) -> None:
        """Write what happened in a session: plots, incursions, a 3D replay; one HTML file."""
        if source and source not in SOURCES:
            raise InputError(f'--source "{source}" is unknown; allowed are {", ".join(SOURCES)}.')
        from cockpit.report.make import run_report

        run_report(path, out, site, source, with_diff)
