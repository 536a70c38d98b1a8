"""`cockpit users`: who may sign in."""

from __future__ import annotations

import getpass
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from backend.documents.access import UsersDocument
from backend.errors import InputError
from backend.shell.access import users


def run_add(name: str, role: str, file: Path | None, from_stdin: bool) -> None:
    """Add a user. Raises InputError."""
    path = file or users.default_file()
    users.check_new(path, name, role)
    users.add_user(path, name, role, _password(from_stdin))
    print(f"{name} may sign in as {role} ({path}).")


def run_list(file: Path | None, as_json: bool) -> None:
    """Print all users. Raises InputError."""
    path = file or users.default_file()
    document = UsersDocument(file=str(path), users=users.list_users(path))
    if as_json:
        print(document.model_dump_json(indent=2))
        return
    table = Table("name", "role", title=str(path))
    for row in document.users:
        table.add_row(row.name, row.role)
    Console().print(table)


def run_remove(name: str, file: Path | None) -> None:
    """Remove a user. Raises InputError."""
    path = file or users.default_file()
    users.remove_user(path, name)
    print(f"{name} may no longer sign in ({path}).")


def run_role(name: str, role: str, file: Path | None) -> None:
    """Change a user's role. Raises InputError."""
    path = file or users.default_file()
    users.set_role(path, name, role)
    print(f"{name} is {role} now ({path}).")


def run_password(name: str, file: Path | None, from_stdin: bool) -> None:
    """Change a user's password. Raises InputError."""
    path = file or users.default_file()
    users.check_known(path, name)
    users.set_password(path, name, _password(from_stdin))
    print(f"{name} has another password now ({path}).")


def _password(from_stdin: bool) -> str:
    """One line of standard input, or what is typed twice without being shown."""
    if from_stdin:
        return sys.stdin.readline().rstrip("\r\n")
    if not sys.stdin.isatty():
        raise InputError(
            "password: there is no terminal to ask for it; allowed is --password-stdin."
        )
    first = getpass.getpass("Password: ")
    if getpass.getpass("Again: ") != first:
        raise InputError("password: the second one is not the first; allowed is the same twice.")
    return first
