"""Leases as cockpits hold them, against the agent's own record, over a radio that delays."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable
from typing import Protocol

import pytest

from backend.control.lease import TERM, Answer, Kind, Lease, Request, ask, fresh
from backend.control.person import Person
from backend.shell.driving.leases import NO_ANSWER, REFRESH, Leases

ANN, BOB = Person("ann", "operator"), Person("bob", "operator")
SUE = Person("sue", "supervisor")


class Refreshing(Protocol):
    def refresh(self) -> None: ...


class Radio:
    """One machine's agent behind a radio with random delays and losses, in made-up time."""

    def __init__(self, seed: int = 0, delay: float = 0.0, loss: float = 0.0) -> None:
        self.now, self.lease = 0.0, fresh()
        self._rng, self._delay, self._loss = random.Random(seed), delay, loss
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0

    def clock(self) -> float:
        return self.now

    def ask(self, machine: str, request: Request, told: Callable[[Answer | None], None]) -> None:
        if self._rng.random() < self._loss:
            self.later(TERM, lambda: told(None))
            return

        def arrive() -> None:
            self.lease, answer = ask(self.lease, request, self.now)
            lost = self._rng.random() < self._loss
            self.later(self.way(), lambda: told(None if lost else answer))

        self.later(self.way(), arrive)

    def way(self) -> float:
        return self._rng.random() * self._delay

    def later(self, seconds: float, do: Callable[[], None]) -> None:
        self._count += 1
        heapq.heappush(self._due, (self.now + seconds, self._count, do))

    def run(
        self, seconds: float, *cockpits: Refreshing, each: Callable[[], None] = lambda: None
    ) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now += 0.01
            while self._due and self._due[0][0] <= self.now:
                heapq.heappop(self._due)[2]()
            for cockpit in cockpits:
                cockpit.refresh()
            each()


def cockpit(radio: Radio, *seats: str) -> Leases:
    made = Leases(radio.ask, radio.clock)
    for seat in seats:
        made.open(seat)
    return made


def test_a_lease_is_asked_for_refreshed_and_given_back() -> None:
    radio = Radio(delay=0.05)
    one = cockpit(radio, "1")
    one.request(Kind.REQUEST, "left", "1", ANN)
    radio.run(5.0, one)
    held = one.held("left")
    assert held is not None
    assert held.token == radio.lease.token == 1  # refreshed, never asked for anew
    one.request(Kind.RELEASE, "left", "1", ANN)
    assert one.held("left") is None  # at once
    radio.run(0.2, one)
    assert not radio.lease.held(radio.now)


def test_the_second_is_refused_in_words_and_gets_it_when_handed_over() -> None:
    radio = Radio()
    one, two = cockpit(radio, "1"), cockpit(radio, "2")
    one.request(Kind.REQUEST, "left", "1", ANN)
    radio.run(0.1, one, two)
    two.request(Kind.REQUEST, "left", "2", BOB)
    radio.run(0.1, one, two)
    assert two.held("left") is None
    assert two.refused("2", "left") == "ann is in control"
    one.request(Kind.HAND_OVER, "left", "1", ANN, to="bob")
    radio.run(0.1, one, two)
    two.request(Kind.REQUEST, "left", "2", BOB)
    radio.run(REFRESH + 0.1, one, two)
    assert two.held("left") is not None
    assert one.held("left") is None
    assert "bob" in one.refused("1", "left")
    assert two.refused("2", "left") == ""


def test_a_take_over_is_a_supervisors_and_has_a_reason() -> None:
    radio = Radio()
    one, two = cockpit(radio, "1"), cockpit(radio, "2")
    one.request(Kind.REQUEST, "left", "1", ANN)
    radio.run(0.1, one, two)
    for person, reason in ((BOB, "now"), (SUE, "")):
        two.request(Kind.TAKE_OVER, "left", "2", person, reason=reason)
        radio.run(0.1, one, two)
        assert two.held("left") is None
    two.request(Kind.TAKE_OVER, "left", "2", SUE, reason="ann has left")
    radio.run(REFRESH + 0.1, one, two)
    assert two.held("left") is not None
    assert one.held("left") is None


def test_a_machine_that_is_silent_ends_the_lease_within_its_term() -> None:
    radio = Radio()
    one = cockpit(radio, "1")
    one.request(Kind.REQUEST, "left", "1", ANN)
    radio.run(0.5, one)
    radio._loss = 1.0
    radio.run(TERM, one)
    assert one.held("left") is None
    radio._loss = 0.0
    radio.run(3.0, one)
    assert one.held("left") is None  # it does not come back by itself
    one.request(Kind.REQUEST, "right", "1", ANN)
    radio._loss = 1.0
    one.request(Kind.REQUEST, "left", "1", ANN)
    radio.run(2.0, one)
    assert one.refused("1", "left") == NO_ANSWER


@pytest.mark.parametrize("late", [False, True])
def test_a_page_that_is_gone_leaves_nothing_behind(late: bool) -> None:
    radio = Radio(delay=0.2)
    one = cockpit(radio, "1")
    one.request(Kind.REQUEST, "left", "1", ANN)
    if not late:
        radio.run(0.5, one)
        assert one.held("left") is not None
    one.drop("1")
    assert one.held("left") is None
    radio.run(1.0, one)
    assert one.held("left") is None
    assert not radio.lease.held(radio.now)


def test_two_pages_of_one_operator_only_the_newer_is_in_control() -> None:
    radio = Radio()
    one = cockpit(radio, "1", "2")
    one.request(Kind.REQUEST, "left", "1", ANN)
    radio.run(0.1, one)
    one.request(Kind.REQUEST, "left", "2", ANN)
    radio.run(1.0, one)
    held = one.held("left")
    assert held is not None
    assert held.seat == "2"
    one.request(Kind.RELEASE, "left", "1", ANN)  # not its own any more
    radio.run(0.2, one)
    assert one.held("left") is not None


def test_ten_thousand_races_without_an_overlap() -> None:
    """Two cockpits ask, give back, hand over and lose messages at random: never both in control."""
    races = overlaps = held_by_one = 0
    for seed in range(100):
        rng = random.Random(seed)
        radio = Radio(seed, delay=0.3, loss=0.05)
        pair = (cockpit(radio, "a"), "a", ANN), (cockpit(radio, "b"), "b", BOB)

        def check(
            pair: tuple[tuple[Leases, str, Person], ...] = pair, radio: Radio = radio
        ) -> None:
            nonlocal overlaps, held_by_one
            found = [one.held("left") for one, _, _ in pair]
            believed = [h for h in found if h is not None]
            admitted = [h for h in believed if radio.lease.admits(h.token, radio.now)]
            overlaps += len(admitted) > 1
            # Without a take-over nobody even believes to be in control when another is.
            overlaps += len(believed) > 1 and len(admitted) > 0 and not passed_on(radio.lease)
            held_by_one += len(admitted) == 1

        for _ in range(50):
            for one, seat, person in pair:
                kind = rng.choice([Kind.REQUEST, Kind.REQUEST, Kind.RELEASE])
                one.request(kind, "left", seat, person)
                races += 1
            radio.run(rng.random() * 0.8, *(one for one, _, _ in pair), each=check)
    assert races == 10_000
    assert overlaps == 0
    assert held_by_one > 10_000  # the checks saw control, not silence


def passed_on(lease: Lease) -> bool:
    return bool(lease.offered_to)
