"""One-time links: who reads the terminal may come in, once for each link."""

from __future__ import annotations

import secrets
import threading
import time
from collections import deque
from collections.abc import Callable

from backend.control.person import Person
from backend.shell.access.sessions import digest

LASTS = 1800.0  # a link that nobody used [s]


class Links:
    """One link is valid at a time. person: whom it signs in; clock: any seconds.

    tell: called with a fresh token whenever one took the place of another; from any thread.
    """

    def __init__(
        self,
        person: Person,
        tell: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
        lasts: float = LASTS,
    ) -> None:
        self.person = person
        self._tell, self._clock, self._lasts = tell, clock, lasts
        self._lock = threading.Lock()
        self._valid, self._made = "", 0.0
        self._gone: deque[str] = deque(maxlen=100)

    def make(self) -> str:
        """The token of a fresh link, which is not told; the one before is no longer valid."""
        with self._lock:
            return self._make()

    def use(self, token: str) -> bool:
        """Whether a token lets somebody in, which it does once. Then the next one is told.

        A link that was right once and is not any more brings a fresh one to the terminal, too.
        """
        key = digest(token)
        with self._lock:
            right = secrets.compare_digest(key, self._valid) and not self._expired()
            if right or key in self._gone:
                self._renew(right)
            elif secrets.compare_digest(key, self._valid):
                self._renew(True)
            return right

    def ask(self) -> None:
        """Somebody stands at the door: sees to it that the link in the terminal is valid."""
        with self._lock:
            self._renew(False)

    def _renew(self, used: bool) -> None:
        if used or self._expired():
            self._tell(self._make())

    def _expired(self) -> bool:
        return self._clock() - self._made >= self._lasts

    def _make(self) -> str:
        if self._valid:
            self._gone.append(self._valid)
        token = secrets.token_urlsafe(32)
        self._valid, self._made = digest(token), self._clock()
        return token
