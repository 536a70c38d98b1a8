"""The lease of one machine: who may command it, and the fencing token that proves it.

Only the machine's own agent keeps this record. Every grant raises the token, and commands carry it:
whoever lost the lease without noticing holds an older token and is refused (fencing tokens,
Kleppmann 2016). A lease ends `TERM` after it was last refreshed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

TERM = 1.0
"""A lease that is not refreshed ends after this [s]."""
SUPERVISOR = "supervisor"
LONGEST = 256  # characters of a name or a reason


class Kind(Enum):
    """REQUEST the lease; REFRESH or RELEASE one's own; HAND_OVER it to another, who then requests
    it; TAKE_OVER from whoever holds it, by a supervisor with a reason; STOP ends anybody's lease,
    by anybody: whoever sees danger stops what moves, also what another cockpit drives.
    """

    REQUEST = "request"
    REFRESH = "refresh"
    RELEASE = "release"
    HAND_OVER = "hand_over"
    TAKE_OVER = "take_over"
    STOP = "stop"


@dataclass(frozen=True)
class Request:
    """who: the operator; role: as authenticated by the cockpit; token: of the own lease, for what
    only its holder may do; to: whom it is handed to; reason: of a take-over.
    """

    kind: Kind
    who: str
    role: str = "operator"
    token: int = 0
    to: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Lease:
    """token: the newest issued, which never falls; holder: empty when nobody holds it; expires [s];
    offered_to: whom the holder hands it to; reason: of the take-over that granted it, else empty;
    stopped_by: who ended it by a stop, until it is granted anew.
    """

    token: int
    holder: str = ""
    expires: float = -math.inf
    offered_to: str = ""
    reason: str = ""
    stopped_by: str = ""

    def held(self, now: float) -> bool:
        return bool(self.holder) and now < self.expires

    def admits(self, token: int, now: float) -> bool:
        """Whether a command with that token is the holder's."""
        return self.held(now) and token == self.token


@dataclass(frozen=True)
class Answer:
    """granted: whether it was done; token: of the asker's lease, 0 without; holder: who holds it
    now; expires_in [s]; why: in words when refused, or the reason of a take-over.
    """

    granted: bool
    token: int
    holder: str
    expires_in: float
    why: str = ""


def fresh(first: int = 0) -> Lease:
    """Nobody's lease. first: no later token is below it, so that an agent that is started again
    never issues a token twice.
    """
    return Lease(first)


def ask(lease: Lease, request: Request, now: float) -> tuple[Lease, Answer]:
    """The lease after a request at `now` [s], and the answer to it."""
    why = _unsound(request) or _REFUSALS[request.kind](lease, request, now)
    if why:
        return lease, _answer(lease, request.who, now, granted=False, why=why)
    after = _DONE[request.kind](lease, request, now)
    return after, _answer(after, request.who, now, granted=True, why=after.reason)


def _unsound(request: Request) -> str:
    if not request.who.strip():
        return "a lease needs a name"
    if max(len(request.who), len(request.to), len(request.reason)) > LONGEST:
        return f"names and reasons have at most {LONGEST} characters"
    return ""


def _cannot_request(lease: Lease, request: Request, now: float) -> str:
    # The same operator on a page that was loaded again is no rival: the old page is fenced off.
    if not lease.held(now) or request.who in (lease.holder, lease.offered_to):
        return ""
    return f"{lease.holder} is in control"


def _not_own(lease: Lease, request: Request, now: float) -> str:
    if not lease.held(now):
        return f"{lease.stopped_by} pressed stop" if lease.stopped_by else "the lease has ended"
    if request.token != lease.token or request.who != lease.holder:
        return f"{lease.holder} is in control"
    return ""


def _cannot_hand_over(lease: Lease, request: Request, now: float) -> str:
    if not request.to.strip() or request.to == request.who:
        return "hand over to whom?"
    return _not_own(lease, request, now)


def _cannot_take_over(lease: Lease, request: Request, now: float) -> str:
    if request.role != SUPERVISOR:
        return f"only a {SUPERVISOR} takes over"
    return "" if request.reason.strip() else "a take-over needs a reason"


def _cannot_stop(lease: Lease, request: Request, now: float) -> str:
    return "" if lease.held(now) else "nobody is in control"


def _granted(lease: Lease, request: Request, now: float) -> Lease:
    reason = request.reason if request.kind is Kind.TAKE_OVER else ""
    return Lease(lease.token + 1, request.who, now + TERM, reason=reason)


def _refreshed(lease: Lease, request: Request, now: float) -> Lease:
    return replace(lease, expires=now + TERM)


def _released(lease: Lease, request: Request, now: float) -> Lease:
    return Lease(lease.token)


def _stopped(lease: Lease, request: Request, now: float) -> Lease:
    return Lease(lease.token, stopped_by=request.who)


def _offered(lease: Lease, request: Request, now: float) -> Lease:
    return replace(lease, offered_to=request.to)


_REFUSALS = {
    Kind.REQUEST: _cannot_request,
    Kind.REFRESH: _not_own,
    Kind.RELEASE: _not_own,
    Kind.HAND_OVER: _cannot_hand_over,
    Kind.TAKE_OVER: _cannot_take_over,
    Kind.STOP: _cannot_stop,
}
_DONE = {
    Kind.REQUEST: _granted,
    Kind.REFRESH: _refreshed,
    Kind.RELEASE: _released,
    Kind.HAND_OVER: _offered,
    Kind.TAKE_OVER: _granted,
    Kind.STOP: _stopped,
}


def _answer(lease: Lease, who: str, now: float, granted: bool, why: str) -> Answer:
    held = lease.held(now)
    own = held and granted and lease.holder == who
    return Answer(
        granted,
        lease.token if own else 0,
        lease.holder if held else "",
        lease.expires - now if held else 0.0,
        why,
    )
