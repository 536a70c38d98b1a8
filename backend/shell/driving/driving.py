"""Driving: from what operators do on their pages to commands within limits, each cycle.

    page → seat (console, sticks) → wish → method → limiter → command and limits → machine's agent

Everything here may die at any moment: commands and limits have a time-to-live that the machine's
agent enforces, leases end when nobody refreshes them, and nothing arms itself afterwards.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from backend.control import seat as seats
from backend.control.console import State
from backend.control.lease import Kind
from backend.control.person import Person
from backend.control.seat import Seat
from backend.machine.model import Machine
from backend.pipeline.records import Snapshot
from backend.safety.limiter import Decision, Latch, limit, open_latch
from backend.safety.limits import Delay
from backend.safety.surmounting import Surmounting
from backend.shell.driving import pages
from backend.shell.driving.document import machine_document, seat_document
from backend.shell.driving.follows import Followed, Follows, NoPlans, Plans
from backend.shell.driving.leases import REFRESH, Held, Leases
from backend.shell.driving.methods import Methods, Told
from backend.shell.driving.outlet import Outlet
from backend.shell.link.messages import AgentStatus

MOST_UP = 1.0
"""What is looked ahead for a way of unknown length [s]; nothing moves then anyway."""

LATE = 0.4
"""A cycle that comes later than this after the last pauses whatever moves: it stood already [s]."""

FAILED = 5.0
"""Without a cycle for longer than this, driving has failed: its leases are left to end [s]."""

NO_PLANS = NoPlans()

Event = Callable[[str, str, dict[str, Any]], None]
"""Told what happened ("lease", "console", "stop", ...), who did it, and details."""


@dataclass(frozen=True)
class _Fencing:
    """What belongs to one lease of a machine: another token begins with an open latch."""

    token: int
    latch: Latch


class Driving:
    """All seats of one cockpit. Thread-safe; `cycle` belongs to the fast loop.

    machines: those that may be driven from here; statuses: the newest reports of all agents;
    methods: what shapes the wishes before the limiter; plans: what may be followed.
    """

    def __init__(
        self,
        machines: Mapping[str, Machine],
        outlets: Mapping[str, Outlet],
        leases: Leases,
        statuses: Callable[[], Mapping[str, AgentStatus]],
        methods: Methods,
        event: Event = lambda *_: None,
        clock: Callable[[], float] = time.monotonic,
        plans: Plans = NO_PLANS,
    ) -> None:
        self._machines = dict(machines)
        self._outlets = dict(outlets)
        self._leases = leases
        self._statuses = statuses
        self._methods = methods
        self._event = event
        self._clock = clock
        self._lock = threading.Lock()
        self._seats: dict[str, Seat] = {}
        self._follows = Follows(plans)
        self._unfollowed: dict[tuple[str, str], str] = {}  # by seat and machine, why not
        self._decisions: dict[str, tuple[Decision, Told]] = {}
        self._fencing: dict[str, _Fencing] = {}
        self._stopped: dict[str, str] = {}  # machines that nobody has reset since, and why
        self._refused: set[str] = set()
        self._opened = 0
        self._cycled = clock()
        self._stopping = threading.Event()
        self._refresher = threading.Thread(target=self._refresh, name="leases", daemon=True)

    def start(self) -> None:
        """Leases are refreshed from now on, however busy the fast loop is."""
        self._refresher.start()

    def open(self, person: Person) -> str:
        """Somebody sits down; the name of their seat."""
        with self._lock:
            self._opened += 1
            name = str(self._opened)
            self._seats[name] = Seat(person)
        self._leases.open(name)
        return name

    def close(self, name: str) -> None:
        """A page is gone: what its seat held is given back, and nothing more is sent for it."""
        with self._lock:
            self._seats.pop(name, None)
            self._refused.discard(name)
            for key in [key for key in self._unfollowed if key[0] == name]:
                del self._unfollowed[key]
        self._leases.drop(name)

    def on_message(self, name: str, message: dict[str, Any]) -> bool:
        """What a page said; whether it was about driving at all. Anything malformed is left out."""
        if message.get("type") not in pages.KINDS:
            return False
        said = pages.parse(message)
        seat = self._seats.get(name)
        if said is None or seat is None:
            return True
        if isinstance(said, pages.StopSaid):  # by anybody who is signed in
            self._stop(name, seat)
        elif not seat.person.may_drive:
            self._refuse(name, seat, message["type"])
        elif isinstance(said, pages.LeaseSaid):
            self._ask(name, seat, said)
        else:
            self._hear(name, said)
        return True

    def driven(self) -> tuple[str, ...]:
        """Machines whose lease a seat of this cockpit holds."""
        return tuple(sorted(self._leases.all()))

    def followed(self, machine: str) -> Followed | None:
        """What is or was followed with a machine last; None where its lease is another one now."""
        lease = self._leases.all().get(machine)
        with self._lock:
            found = self._follows.newest(machine)
        current = lease is not None and found is not None and found.token == lease.token
        return found if current else None

    def surmounting(self) -> dict[str, Surmounting]:
        """By machine what it climbs by plan, for the next cycle of the pipeline."""
        with self._lock:
            return self._follows.surmounting(self._clock())

    def cycle(self, snapshot: Snapshot) -> None:
        """Sends what the newest snapshot allows of what the operators wish."""
        for name, status in self._statuses().items():
            if name in self._outlets:
                self._outlets[name].hear(status)
        held = self._leases.all()
        told: list[tuple[str, dict[str, Any]]] = []
        with self._lock:
            now = self._clock()  # not the snapshot's time: input that came since is none of later
            on_time = now - self._cycled <= LATE
            self._cycled = now
            networks = {name: on_time and self._outlets[name].condition(now).known for name in held}
            for name, seat in self._seats.items():
                mine = {machine: lease.seat == name for machine, lease in held.items()}
                after = seats.advance(seat, mine, networks, now)
                told += _changes(seat, after)
                self._seats[name] = after
                for machine in _reset(seat, after):
                    self._stopped.pop(machine, None)
            present = dict(self._seats)
            self._follows.forget({m: (lease.seat, lease.token) for m, lease in held.items()})
        decisions = {
            machine: self._drive(machine, present[lease.seat], lease, snapshot, now)
            for machine, lease in held.items()
            if lease.seat in present
        }
        self._decisions = decisions
        with self._lock:
            over = self._follows.ended()
        told += [
            (present[one.seat].person.who, {"machine": machine, "follow": one.follow.ended})
            for machine, one in over
            if one.seat in present
        ]
        for who, details in told:
            self._event("console", who, details)

    def shut(self) -> None:
        """Gives every lease back and sends nothing more."""
        self._stopping.set()
        if self._refresher.is_alive():
            self._refresher.join(timeout=1.0)
        with self._lock:
            names = list(self._seats)
        for name in names:
            self.close(name)
        for outlet in self._outlets.values():
            outlet.close()

    def document(self) -> dict[str, Any]:
        """What backend.shell.app.models.DrivingModel describes."""
        now = self._clock()
        held, statuses = self._leases.all(), self._statuses()
        with self._lock:
            present = dict(self._seats)
        conditions = {name: self._outlets[name].condition(now) for name in held}
        return {
            "machines": {
                name: machine_document(
                    statuses.get(name), held.get(name), conditions.get(name), now
                )
                for name in self._machines
            },
            "seats": {
                name: seat_document(
                    name,
                    seat,
                    held,
                    {machine: self._leases.refused(name, machine) for machine in self._machines},
                    self._decisions,
                    self._machines,
                    {machine: self._follows.of(machine, name) for machine in self._machines},
                    {m: self._unfollowed.get((name, m), "") for m in self._machines},
                )
                for name, seat in present.items()
            },
        }

    def _drive(
        self, name: str, seat: Seat, lease: Held, snapshot: Snapshot, now: float
    ) -> tuple[Decision, Told]:
        machine, outlet = self._machines[name], self._outlets[name]
        fencing = self._fencing.get(name)
        if fencing is None or fencing.token != lease.token:
            fencing = _Fencing(lease.token, open_latch(machine))
        link = outlet.condition(snapshot.time)
        # How the round trip divides is not known: all of it may be the command's way.
        up = min(link.round_trip, MOST_UP)
        delay = Delay(up, math.inf if link.locked else link.round_trip)
        sticks, override = seats.wish(seat, name, machine), seats.override(seat, name)
        with self._lock:
            sat = lease.seat, seat, lease.token
            followed = self._follows.wish(name, machine, sat, snapshot, delay, now)
        sticks = followed or sticks
        shaped, told = self._methods.shape(
            name, seat.setting.method, sticks, snapshot, overridden=override is not None
        )
        decision = limit(
            name,
            machine,
            snapshot.machines[name].pose.joints,
            shaped,
            snapshot.concerns,
            delay,
            fencing.latch,
            snapshot.time,
            override,
            sticks,
        )
        if link.locked:
            decision = replace(decision, locked=link.locked)
        if followed is not None:
            with self._lock:
                self._follows.allowed(name, decision.joints, decision.tracks)
        self._fencing[name] = _Fencing(lease.token, decision.latch)
        outlet.send(decision, lease.who, lease.token)
        return decision, told

    def _refresh(self) -> None:
        while not self._stopping.wait(REFRESH / 3.0):
            self.refresh()

    def refresh(self) -> None:
        """Keeps what is held, as long as commands can come of it."""
        if self._clock() - self._cycled <= FAILED:
            self._leases.refresh()

    def _stop(self, name: str, by: Seat) -> None:
        """Latches every seat that holds a machine: whoever sees danger stops what moves.

        What another cockpit drives is stopped by its agent, which ends the lease.
        """
        held = self._leases.all()
        elsewhere = sorted(
            machine
            for machine, status in self._statuses().items()
            if machine in self._machines and status.holder and machine not in held
        )
        for machine in elsewhere:
            self._leases.stop(machine, name, by.person)
        if elsewhere:
            details = {"role": by.person.role, "machines": elsewhere, "elsewhere": True}
            self._event("stop", by.person.who, details)
        with self._lock:
            news = held.keys() - self._stopped.keys()
            self._stopped |= dict.fromkeys(held, f"{by.person.who} pressed stop")
            for holder in {lease.seat for lease in held.values()} & set(self._seats):
                seat = self._seats[holder]
                self._seats[holder] = replace(seat, buttons=replace(seat.buttons, stop=True))
        if news:  # pressed again and again it is one stop
            details = {"role": by.person.role, "machines": sorted(news)}
            self._event("stop", by.person.who, details)

    def _refuse(self, name: str, seat: Seat, kind: str) -> None:
        """Once for a seat: whoever floods it fills no log."""
        if name not in self._refused:
            self._refused.add(name)
            self._event("refused", seat.person.who, {"said": kind, "role": seat.person.role})

    def _ask(self, name: str, seat: Seat, said: pages.LeaseSaid) -> None:
        if said.machine not in self._machines:
            return
        details = {"do": said.do, "machine": said.machine, "to": said.to, "reason": said.reason}
        self._event("lease", seat.person.who, details)
        with self._lock:
            now = self._seats.get(name)
            if now is None:
                return
            if said.kind is Kind.RELEASE:
                self._seats[name] = seats.without_console(now, said.machine)
            elif said.kind is not Kind.HAND_OVER:
                stopped = self._stopped.get(said.machine, "")
                self._seats[name] = seats.with_console(now, said.machine, stopped)
        self._leases.request(said.kind, said.machine, name, seat.person, said.to, said.reason)

    def _hear(self, name: str, said: pages.Said) -> None:
        now = self._clock()
        if isinstance(said, pages.FollowSaid):
            return self._follow(name, said)
        with self._lock:
            seat = self._seats.get(name)
            if seat is None:
                return None
            self._seats[name] = _heard(seat, said, now)
        if not isinstance(said, pages.SticksSaid):
            kind = type(said).__name__.removesuffix("Said").lower()
            details = {k: getattr(said, k) for k in said.__struct_fields__}
            self._event(kind, seat.person.who, details)
        return None

    def _follow(self, name: str, said: pages.FollowSaid) -> None:
        lease = self._leases.all().get(said.machine)
        with self._lock:
            seat = self._seats.get(name)
            if seat is None:
                return
            if said.do == "drop":
                self._follows.drop(said.machine, name)
                refused = ""
            elif lease is None or lease.seat != name:
                refused = "who follows holds the machine's lease"
            else:
                refused = self._follows.accept(said.machine, name, lease.token, said.plan)
            self._unfollowed[name, said.machine] = refused
        details = {"do": said.do, "machine": said.machine, "plan": said.plan, "refused": refused}
        self._event("follow", seat.person.who, details)


def _heard(seat: Seat, said: pages.Said, now: float) -> Seat:
    if isinstance(said, pages.SticksSaid):
        return seats.said(seat, said.input(now))
    if isinstance(said, pages.DriveSaid):
        return seats.drives(seat, said.machine, now) if said.machine in seat.desk.consoles else seat
    if isinstance(said, pages.SettingSaid):
        return seats.set_up(seat, said.pattern, said.fine, said.method)
    if isinstance(said, pages.OverrideSaid):
        return replace(seat, reason=said.reason if seat.person.may_override else "")
    if isinstance(said, pages.ResetSaid):
        return replace(seat, buttons=replace(seat.buttons, reset=True))
    return replace(seat, buttons=replace(seat.buttons, pause=True))


def _reset(before: Seat, after: Seat) -> list[str]:
    """Machines whose stop was reset."""
    return [
        machine
        for machine, console in before.desk.consoles.items()
        if console.state is State.STOP and after.desk.consoles[machine].state is not State.STOP
    ]


def _changes(before: Seat, after: Seat) -> list[tuple[str, dict[str, Any]]]:
    """Consoles whose motion began or ended, stopped or were overridden."""
    found = []
    for machine, console in after.desk.consoles.items():
        old = before.desk.consoles.get(machine)
        if old is None or old.state is console.state:
            continue
        if {old.state, console.state} == {State.ENABLED, State.ACTIVE}:
            continue  # the stick, not the console
        details = {
            "machine": machine,
            "from": old.state.value,
            "to": console.state.value,
            "why": console.why,
            **({"reason": after.reason} if console.state is State.OVERRIDE else {}),
        }
        found.append((after.person.who, details))
    return found
