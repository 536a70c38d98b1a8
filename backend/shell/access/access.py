"""The access control of one program: who is at the other end of a connection."""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from backend.control.person import SUPERVISOR, Person
from backend.documents.access import EntranceDocument, MeDocument
from backend.shell.access.attempts import Attempts, network
from backend.shell.access.audit import Audit
from backend.shell.access.links import Links
from backend.shell.access.sessions import Session, Sessions
from backend.shell.access.users import Users

LOCAL = Person("local", SUPERVISOR)
"""Everybody, where a program was told to ask for no login."""

PER_ADDRESS, PER_NAME, PERIOD = 20, 5, 300.0  # wrong attempts, and in how long [s]


class Connection(Protocol):
    """What is asked of a request or a websocket."""

    @property
    def cookies(self) -> Mapping[str, str]: ...


@dataclass(frozen=True)
class SignIn:
    """What became of an attempt. token: for the cookie, None when refused; wait [s]: until the
    next attempt makes sense; words: why not.
    """

    token: str | None = None
    wait: float = 0.0
    words: str = ""


@dataclass(frozen=True)
class Access:
    """users: with passwords; links: one-time links; everybody: who all are without any login.

    cookie: the session's name in browsers (cookies know no ports, so it differs by port); https:
    whether pages come over HTTPS; metrics_token: lets a program read /metrics without a session.
    """

    sessions: Sessions
    audit_log: Audit
    cookie: str
    users: Users | None = None
    links: Links | None = None
    everybody: Person | None = None
    https: bool = False
    metrics_token: str | None = None
    addresses: Attempts = field(default_factory=lambda: Attempts(PER_ADDRESS, PERIOD))
    names: Attempts = field(default_factory=lambda: Attempts(PER_NAME, PERIOD))

    def identify(self, connection: Connection) -> Person | None:
        """Who is there; None when nobody is signed in. Counts as use of the session."""
        return self._current(connection)[0]

    def audit(self, event: str, who: str | None, details: Mapping[str, Any]) -> None:
        """One line in the audit log; never waits."""
        self.audit_log.write(event, who, details)

    def sign_in(self, name: str, password: str, address: str) -> SignIn:
        """With a password. Takes its time: call it in a worker thread."""
        where, key = network(address), hashlib.sha256(name.casefold().encode()).hexdigest()
        if self.users is None:
            return SignIn(words=self.way_in)
        if (wait := self.addresses.take(where) or self.names.take(key)) > 0.0:
            return _too_often(wait)
        found = self.users.sign_in(name, password)
        if found is None:
            # A wrong name may be a password in the wrong field: it stays out of the log.
            who = name if self.users.knows(name) else None
            self.audit("login failed", who, {"address": address})
            return SignIn(words="Name or password is wrong.")
        self.addresses.undo(where)
        self.names.forget(key)
        person, seal = found
        return self._begin(person, "password", seal, address)

    def follow_link(self, token: str, address: str) -> SignIn:
        """With a one-time link."""
        where = network(address)
        if self.links is None:
            return SignIn(words=self.way_in)
        if (wait := self.addresses.take(where)) > 0.0:
            return _too_often(wait)
        if not self.links.use(token):
            self.audit("login failed", None, {"address": address, "how": "link"})
            return SignIn(words="This link was used already, or is too old. " + self.way_in)
        self.addresses.undo(where)
        return self._begin(self.links.person, "link", "", address)

    def sign_out(self, connection: Connection, address: str) -> None:
        """Ends the session; its websockets are closed within a second."""
        ended = self.sessions.end(self._token(connection))
        if ended is not None:
            self.audit("logout", ended.person.who, {"address": address})

    def me(self, connection: Connection) -> MeDocument | None:
        """What a page may know about who is signed in."""
        person, session = self._current(connection)
        if person is None:
            return None
        return MeDocument.model_validate(
            {
                **vars(person),
                "may_drive": person.may_drive,
                "may_override": person.may_override,
                "how": "no login" if session is None else session.how,
                "idle": None if session is None else self.sessions.idle,
                "left": None if session is None else self.sessions.left(session),
            }
        )

    def entrance(self, connection: Connection) -> EntranceDocument:
        """How one signs in here. Who asks stands at the door: a link that is too old is renewed."""
        person = self.identify(connection)
        if person is None and self.links is not None:
            self.links.ask()
        return EntranceDocument(
            passwords=self.users is not None,
            link=self.links is not None,
            who=None if person is None else person.who,
        )

    def reads_metrics(self, authorization: str | None) -> bool:
        """Whether an Authorization header carries the token for /metrics."""
        if self.metrics_token is None or authorization is None:
            return False
        kind, _, token = authorization.partition(" ")
        expected = self.metrics_token.encode()
        return kind.lower() == "bearer" and secrets.compare_digest(token.encode(), expected)

    def close(self) -> None:
        """Writes what the audit log still has to."""
        self.audit_log.close()

    @property
    def way_in(self) -> str:
        """How to get in, in words."""
        if self.links is not None:
            return "Open the newest link that the cockpit has printed in its terminal."
        return "Sign in with your name and password."

    def _begin(self, person: Person, how: str, seal: str, address: str) -> SignIn:
        self.audit("login", person.who, {"address": address, "role": person.role, "how": how})
        return SignIn(self.sessions.begin(person, how, seal))

    def _current(self, connection: Connection) -> tuple[Person | None, Session | None]:
        if self.everybody is not None:
            return self.everybody, None
        token = self._token(connection)
        session = self.sessions.find(token) if token else None
        if session is None:
            return None, None
        if not session.seal:  # began with a link
            return (session.person, session) if self.links is not None else (None, None)
        if self.users is None:
            return None, None
        # Role and password as they are now, not as they were when the session began.
        person = self.users.person(session.person.who, session.seal)
        if person is None:
            self.sessions.end(token)
            return None, None
        return person, session

    def _token(self, connection: Connection) -> str:
        return connection.cookies.get(self.cookie, "")


def _too_often(wait: float) -> SignIn:
    left = f"{wait:.0f} s" if wait < 90.0 else f"{wait / 60.0:.0f} minutes"
    return SignIn(wait=wait, words=f"Too many attempts. Try again in {left}.")
