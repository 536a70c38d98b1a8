"""Signed-in browsers. The server keeps only hashes of what it gave them."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from backend.control.person import Person
from backend.shell.access.places import others_may, write_private

log = logging.getLogger(__name__)

IDLE = 1800.0  # without a request and without an open page [s]
ABSOLUTE = 12 * 3600.0  # after signing in, whatever is done [s]
MOST = 1000  # the one not used for longest goes first


@dataclass(frozen=True)
class Session:
    """seal: of the password it began with, empty for a link; how: as in `MeDocument`;
    began, used [s since 1970].
    """

    person: Person
    seal: str
    how: str
    began: float
    used: float


class Sessions:
    """All sessions of one program. Methods may be called from any thread.

    path: where those that began with a password outlive the program, so that pages come back by
    themselves when it is started again; None: nowhere. clock: seconds since 1970.
    """

    def __init__(
        self,
        path: Path | None = None,
        idle: float = IDLE,
        absolute: float = ABSOLUTE,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.idle, self.absolute = idle, absolute
        self._clock, self._path = clock, path
        self._lock = threading.Lock()
        self._sessions: dict[str, Session] = _read(path, clock())
        self._tidy()

    def begin(self, person: Person, how: str, seal: str = "") -> str:
        """A new session's token: 256 random bits, kept here as its SHA-256 only."""
        token, now = secrets.token_urlsafe(32), self._clock()
        with self._lock:
            self._sessions[digest(token)] = Session(person, seal, how, now, now)
            self._tidy()
            if len(self._sessions) > MOST:
                del self._sessions[min(self._sessions, key=lambda k: self._sessions[k].used)]
            self._write()
        return token

    def find(self, token: str) -> Session | None:
        """The session of a token, which counts as used; None when it is unknown or over."""
        key, now = digest(token), self._clock()
        with self._lock:
            session = self._sessions.get(key)
            if session is None:
                return None
            if self._over(session, now):
                del self._sessions[key]
                return None
            self._sessions[key] = replace(session, used=now)
            return session

    def end(self, token: str) -> Session | None:
        """Ends a session and returns what it was."""
        with self._lock:
            session = self._sessions.pop(digest(token), None)
            if session is not None:
                self._write()
            return session

    def left(self, session: Session) -> float:
        """Until it is over in any case [s]."""
        return max(0.0, session.began + self.absolute - self._clock())

    def _over(self, session: Session, now: float) -> bool:
        ages = now - session.used, now - session.began
        # A clock that was set back must not make anything last longer.
        return not (0.0 <= ages[0] < self.idle and 0.0 <= ages[1] < self.absolute)

    def _tidy(self) -> None:
        now = self._clock()
        self._sessions = {k: s for k, s in self._sessions.items() if not self._over(s, now)}

    def _write(self) -> None:
        if self._path is None:
            return
        kept = {key: session for key, session in self._sessions.items() if session.seal}
        try:
            write_private(self._path, msgspec.json.encode(kept))
        except OSError as error:
            log.error("sessions will not outlive this program: %s", error)


def digest(token: str) -> str:
    """What is kept of a token that a browser has."""
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()


def _read(path: Path | None, now: float) -> dict[str, Session]:
    """Sessions of the program before this one; what cannot be trusted or read is none."""
    if path is None:
        return {}
    with contextlib.suppress(OSError, ValueError):
        if not others_may(path):
            kept = msgspec.json.decode(path.read_bytes(), type=dict[str, Session])
            # While no program ran, no page could say that it was there.
            return {key: replace(session, used=now) for key, session in kept.items()}
    return {}
