"""The users file: who may sign in, with which role."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import logging
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from pydantic import ValidationError

from backend.control.person import ROLES, Person
from backend.documents.access import NAME, UserEntry, UserRow, UsersFileDocument
from backend.errors import InputError
from backend.shell.access.passwords import hashed, matches
from backend.shell.access.places import config_folder, others_may, write_private

log = logging.getLogger(__name__)

LOOK_AGAIN = 1.0  # at most so often at the file [s]


def default_file() -> Path:
    return config_folder() / "users.json"


def read_users(path: Path) -> dict[str, UserEntry]:
    """All users by name. Raises InputError for a file that is missing, wrong, or open to others."""
    try:
        if others_may(path):
            mode = path.stat().st_mode & 0o777
            raise InputError(
                f"{path}: its mode is {mode:04o}; allowed is 0600, for its owner only "
                f'(chmod 600 "{path}").'
            )
        users = UsersFileDocument.model_validate_json(path.read_bytes()).users
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no users file; `cockpit users add NAME --role operator` makes one."
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise InputError(
            f"{path}: {where or 'its text'} is wrong ({first['msg']}); "
            "allowed is what `cockpit schema users-file` describes."
        ) from None
    for name in users:
        _checked_name(name, str(path))
    return users


def list_users(path: Path) -> list[UserRow]:
    """Everybody in the file, by name. Raises InputError."""
    return [UserRow(name=name, role=user.role) for name, user in sorted(read_users(path).items())]


def check_new(path: Path, name: str, role: str) -> None:
    """Raises InputError for what `add_user` would refuse before it looks at the password."""
    _checked_name(name, "NAME")
    _checked_role(role)
    if path.exists():
        _not_taken(read_users(path), name, path)


def check_known(path: Path, name: str) -> None:
    """Raises InputError for a name that is not in the file."""
    _known(read_users(path), name, path)


def add_user(path: Path, name: str, role: str, password: str) -> None:
    """Adds somebody new; makes the file when there is none. Raises InputError."""
    check_new(path, name, role)
    entry = UserEntry.model_validate({"role": role, "password": hashed(password)})
    with _changing(path, create=True) as users:
        _not_taken(users, name, path)
        users[name] = entry


def remove_user(path: Path, name: str) -> None:
    """Removes somebody, who is signed out within a second. Raises InputError."""
    with _changing(path) as users:
        _known(users, name, path)
        del users[name]


def set_role(path: Path, name: str, role: str) -> None:
    """Gives somebody another role, at once. Raises InputError."""
    _checked_role(role)
    with _changing(path) as users:
        known = _known(users, name, path)
        users[name] = UserEntry.model_validate({**known.model_dump(), "role": role})


def set_password(path: Path, name: str, password: str) -> None:
    """Gives somebody another password, which signs them out. Raises InputError."""
    kept = hashed(password)
    with _changing(path) as users:
        users[name] = _known(users, name, path).model_copy(update={"password": kept})


class Users:
    """The users of a running program. It sees what is changed in the file within a second."""

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        """Raises InputError, also for a file without users."""
        self.path, self._clock = path, clock
        self._users = read_users(path)
        if not self._users:
            raise InputError(
                f"{path}: has no users; `cockpit users add NAME --role operator` adds one."
            )
        self._seen, self._looked = self._mark(), clock()
        self._lock = threading.Lock()

    def sign_in(self, name: str, password: str) -> tuple[Person, str] | None:
        """Person and seal, or None, after the same time for a wrong name as for a password."""
        user = self._now().get(name)
        if not matches(None if user is None else user.password, password) or user is None:
            return None
        return Person(name, user.role), seal_of(user)

    def person(self, name: str, seal: str) -> Person | None:
        """Somebody who signed in, as the file has them now; None: removed, or a new password."""
        user = self._now().get(name)
        return Person(name, user.role) if user is not None and seal_of(user) == seal else None

    def knows(self, name: str) -> bool:
        return name in self._now()

    def _now(self) -> dict[str, UserEntry]:
        with self._lock:
            now = self._clock()
            if now - self._looked >= LOOK_AGAIN:
                self._looked = now
                mark = self._mark()
                if mark is None:
                    self._users, self._seen = {}, None
                elif mark != self._seen:
                    self._seen = mark
                    try:
                        self._users = read_users(self.path)
                    except InputError as error:  # somebody is at it: as it was, until it is whole
                        log.error("the users stay as they were: %s", error)
            return self._users

    def _mark(self) -> tuple[int, int, int] | None:
        """What changes when the file does; None when there is none."""
        try:
            stat = self.path.stat()
        except OSError:
            return None
        return stat.st_ino, stat.st_ctime_ns, stat.st_size


@contextlib.contextmanager
def _changing(path: Path, create: bool = False) -> Iterator[dict[str, UserEntry]]:
    """The users, written when the block ends well; one program at a time."""
    try:
        if create:
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        if not create or path.exists():
            read_users(path)  # before the lock: what is wrong is said in its own words
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            users = read_users(path) if path.exists() else {}
            yield users
            document = UsersFileDocument(users=users).model_dump_json(indent=2)
            write_private(path, document.encode() + b"\n")
        finally:
            os.close(folder)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}.") from None


def _not_taken(users: dict[str, UserEntry], name: str, path: Path) -> None:
    taken = next((known for known in users if known.casefold() == name.casefold()), None)
    if taken is not None:
        raise InputError(
            f'NAME: "{taken}" is in {path} already; `cockpit users role` or '
            "`cockpit users password` changes it."
        )


def _known(users: dict[str, UserEntry], name: str, path: Path) -> UserEntry:
    if name not in users:
        known = ", ".join(sorted(users)) or "none yet"
        raise InputError(f'NAME: there is no "{name}" in {path}; there are {known}.')
    return users[name]


def _checked_name(name: str, field: str) -> None:
    if not re.match(NAME, name) or name.endswith("\n"):
        raise InputError(
            f"{field}: {name!r} is no name; allowed are 1 to 64 letters, digits, spaces and _.@-, "
            "the first a letter or digit."
        )


def _checked_role(role: str) -> None:
    if role not in ROLES:
        raise InputError(f'--role "{role}" is unknown; allowed are {", ".join(ROLES)}.')


def seal_of(user: UserEntry) -> str:
    """Changes with the password: what was signed in with the old one is signed out."""
    return hashlib.sha256(user.password.encode()).hexdigest()[:32]
