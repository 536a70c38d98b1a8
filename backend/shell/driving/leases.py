"""The leases that this cockpit's seats hold, as the machines' agents grant them.

An agent's word counts: a lease is held from an answer that grants it until it ends, counted from
when it was asked for. Refreshing is not asking anew: whoever lost a lease gets no other by itself.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

from backend.control.lease import TERM, Answer, Kind, Request
from backend.control.person import Person

REFRESH = 0.3
"""Between two refreshes, each of which may be lost twice [s]."""
NO_ANSWER = "the machine does not answer"

Asking = Callable[[str, Request, Callable[[Answer | None], None]], None]
"""Asks a machine's agent; the answer, or None when none came, is told once."""


@dataclass(frozen=True)
class Held:
    """seat: whose lease it is; token: the agent's; asked: when the last refresh was sent [s];
    until: when it ends unless refreshed [s]; offered_to: whom it is being handed to.
    """

    seat: str
    who: str
    token: int
    asked: float
    until: float
    offered_to: str = ""


class Leases:
    """Thread-safe. granted: told the machine, the seat and whether it was granted, with words."""

    def __init__(
        self,
        ask: Asking,
        clock: Callable[[], float],
        told: Callable[[str, str, Request, Answer | None], None] = lambda *_: None,
    ) -> None:
        self._ask = ask
        self._clock = clock
        self._told = told
        self._lock = threading.Lock()
        self._seats: set[str] = set()
        self._held: dict[str, Held] = {}
        self._newest: dict[str, int] = {}  # token ever granted to a seat of this cockpit
        self._refused: dict[tuple[str, str], str] = {}

    def open(self, seat: str) -> None:
        """Somebody sits down; only a seat that is open can be granted anything."""
        self._seats.add(seat)

    def held(self, machine: str) -> Held | None:
        """The lease of a machine, if one of this cockpit's seats holds it now."""
        found = self._held.get(machine)
        return found if found is not None and self._clock() < found.until else None

    def all(self) -> dict[str, Held]:
        with self._lock:
            now = self._clock()
            return {name: held for name, held in self._held.items() if now < held.until}

    def refused(self, seat: str, machine: str) -> str:
        """What the last request of a seat was refused with; empty when it was not."""
        return self._refused.get((seat, machine), "")

    def request(
        self, kind: Kind, machine: str, seat: str, person: Person, to: str = "", reason: str = ""
    ) -> None:
        """Asks the machine's agent; what comes of it is seen in `held` and `refused`."""
        held = self._held.get(machine)
        token = held.token if held is not None and held.seat == seat else 0
        request = Request(kind, person.who, person.role, token, to, reason)
        if kind is Kind.RELEASE:
            with self._lock:
                if token:
                    del self._held[machine]
        asked = self._clock()
        self._ask(machine, request, lambda a: self._on_answer(machine, seat, request, asked, a))

    def refresh(self) -> None:
        """Asks for more time for everything that is held and due. Called often."""
        now = self._clock()
        with self._lock:
            due = [(name, h) for name, h in self._held.items() if now - h.asked >= REFRESH]
            for name, held in due:
                self._held[name] = replace(held, asked=now)
        for name, held in due:
            request = Request(Kind.REFRESH, held.who, token=held.token)
            self._ask(name, request, self._refreshed(name, held.seat, request, now))

    def stop(self, machine: str, seat: str, person: Person) -> None:
        """Ends the lease that somebody elsewhere holds."""
        request = Request(Kind.STOP, person.who, person.role)
        self._ask(machine, request, lambda answer: self._told(machine, seat, request, answer))

    def drop(self, seat: str) -> None:
        """Gives back everything that a seat holds; for a page that is gone."""
        with self._lock:
            self._seats.discard(seat)
            mine = {name: held for name, held in self._held.items() if held.seat == seat}
            for name in mine:
                del self._held[name]
            self._refused = {key: why for key, why in self._refused.items() if key[0] != seat}
        for name, held in mine.items():
            self._give_back(name, held.who, held.token)

    def _give_back(self, machine: str, who: str, token: int) -> None:
        self._ask(machine, Request(Kind.RELEASE, who, token=token), lambda _: None)

    def _refreshed(
        self, machine: str, seat: str, request: Request, asked: float
    ) -> Callable[[Answer | None], None]:
        return lambda answer: self._on_answer(machine, seat, request, asked, answer)

    def _on_answer(
        self, machine: str, seat: str, request: Request, asked: float, answer: Answer | None
    ) -> None:
        with self._lock:
            held, gone = self._held.get(machine), False
            if request.kind is Kind.REFRESH:
                if held is None or held.token != request.token:
                    return  # given back or granted anew meanwhile
                if answer is not None and answer.granted:
                    until = max(held.until, asked + min(answer.expires_in, TERM))
                    self._held[machine] = replace(held, until=until)
                elif answer is not None:
                    del self._held[machine]
                    self._refused[(seat, machine)] = answer.why
                if answer is None or answer.granted:
                    return
            elif answer is not None and answer.granted:
                self._refused.pop((seat, machine), None)
                gone = seat not in self._seats
                if not gone:
                    self._grant(machine, seat, request, asked, answer)
            else:
                self._refused[(seat, machine)] = NO_ANSWER if answer is None else answer.why
        if gone and answer is not None and answer.token:
            self._give_back(machine, request.who, answer.token)
        self._told(machine, seat, request, answer)

    def _grant(
        self, machine: str, seat: str, request: Request, asked: float, answer: Answer
    ) -> None:
        held = self._held.get(machine)
        if request.kind in (Kind.REQUEST, Kind.TAKE_OVER):
            # An answer that was overtaken on the way grants nothing any more.
            if answer.token > self._newest.get(machine, 0):
                self._newest[machine] = answer.token
                until = asked + min(answer.expires_in, TERM)
                self._held[machine] = Held(seat, request.who, answer.token, asked, until)
        elif request.kind is Kind.HAND_OVER and held is not None:
            self._held[machine] = replace(held, offered_to=request.to)
