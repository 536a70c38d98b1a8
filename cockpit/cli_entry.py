"""Options about who gets in, for every command that opens a page, and `cockpit users`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

UsersFile = Annotated[
    Path | None,
    typer.Option("--users", help="Users file; default: the one `cockpit users` writes."),
]
NoLogin = Annotated[
    bool, typer.Option("--no-login", help="Ask nobody to sign in. On the loopback only.")
]
OneTimeLink = Annotated[
    bool,
    typer.Option(
        "--one-time-link", help="Print links that sign in a supervisor. On the loopback only."
    ),
]
Cert = Annotated[Path | None, typer.Option("--cert", help="HTTPS with this certificate (PEM).")]
Key = Annotated[Path | None, typer.Option("--key", help="The certificate's private key (PEM).")]
SelfSigned = Annotated[
    bool, typer.Option("--self-signed", help="HTTPS with a certificate made here and kept.")
]
InsecureHttp = Annotated[
    bool,
    typer.Option("--insecure-http", help="Plain HTTP although others than this computer hear it."),
]

users = typer.Typer(help="Who may sign in, and with which role.", no_args_is_help=True)

Name = Annotated[str, typer.Argument(help="The name they sign in with.")]
Role = Annotated[str, typer.Option(help="viewer, operator or supervisor.")]
File = Annotated[
    Path | None, typer.Option("--file", help="Users file; default: in the user's configuration.")
]
FromStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password's line from standard input.")
]


@users.command()
def add(name: Name, role: Role, file: File = None, password_stdin: FromStdin = False) -> None:
    """Add somebody. The password is asked for twice and not shown."""
    from cockpit.users import run_add

    run_add(name, role, file, password_stdin)


@users.command("list")
def list_(
    file: File = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """List everybody who may sign in."""
    from cockpit.users import run_list

    run_list(file, json_)


@users.command()
def remove(name: Name, file: File = None) -> None:
    """Remove somebody. A running cockpit signs them out within a second."""
    from cockpit.users import run_remove

    run_remove(name, file)


@users.command()
def role(
    name: Name,
    role: Annotated[str, typer.Argument(help="viewer, operator or supervisor.")],
    file: File = None,
) -> None:
    """Give somebody another role, also in a running cockpit."""
    from cockpit.users import run_role

    run_role(name, role, file)


@users.command()
def password(name: Name, file: File = None, password_stdin: FromStdin = False) -> None:
    """Give somebody another password; where they are signed in they no longer are."""
    from cockpit.users import run_password

    run_password(name, file, password_stdin)
