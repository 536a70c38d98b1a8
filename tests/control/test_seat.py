"""A seat: input that is not there is none, and only the driven machine is moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.control.console import PRESENT, State
from backend.control.patterns import Method, Pattern, Sticks
from backend.control.person import Person
from backend.control.seat import (
    Buttons,
    Input,
    Seat,
    advance,
    drives,
    override,
    said,
    set_up,
    wish,
    with_console,
    without_console,
)
from backend.machine.load import load_machine

MINI = load_machine("mini")
BOTH = {"left": True, "right": True}
ANN = Person("ann", "operator")
SUE = Person("sue", "supervisor")
MOVED = Sticks(left_x=0.8)


class Sat:
    """A seat in time, a cycle every 20 ms with fresh input."""

    def __init__(self, person: Person = ANN, *machines: str) -> None:
        self.seat = Seat(person)
        self.now, self.sequence = 10.0, 0
        for name in machines or ("left",):
            self.seat = with_console(self.seat, name, "")
        self.leases = dict.fromkeys(self.seat.desk.consoles, True)

    def cycle(self, count: int = 1, **given: object) -> Seat:
        for _ in range(count):
            self.now += 0.02
            self.sequence += 1
            new = replace(Input(self.now, self.sequence, focus=True), **given)  # type: ignore[arg-type]
            self.seat = advance(said(self.seat, new), self.leases, BOTH, self.now)
        return self.seat

    def state(self, machine: str = "left") -> State:
        return self.seat.desk.consoles[machine].state

    def drive(self) -> Sat:
        self.cycle(3)
        self.cycle(2, enable=True)
        self.cycle(2, enable=True, sticks=MOVED)
        assert self.state() is State.ACTIVE
        return self

    def swing(self, machine: str = "left") -> float:
        return float(wish(self.seat, machine, MINI).joints[0])


def test_sticks_move_the_driven_machine_once_enabled() -> None:
    sat = Sat()
    sat.cycle(3, sticks=MOVED)
    assert sat.swing() == 0.0
    assert sat.drive().swing() != 0.0


def test_input_that_is_not_said_anew_is_let_go() -> None:
    sat = Sat().drive()
    kept = advance(sat.seat, sat.leases, BOTH, sat.now + PRESENT - 1e-6)
    assert kept.desk.consoles["left"].state is State.ACTIVE
    gone = advance(sat.seat, sat.leases, BOTH, sat.now + PRESENT + 1e-3)
    assert gone.desk.consoles["left"].state is State.PAUSE
    assert not wish(gone, "left", MINI).joints.any()


def test_an_old_input_does_not_count_again() -> None:
    sat = Sat().drive()
    old = sat.seat.input
    sat.cycle(1)
    assert said(sat.seat, old) is sat.seat


@pytest.mark.parametrize("lost", [{"focus": False}, {"gamepad": False}, {"enable": False}])
def test_what_is_lost_stops_at_once(lost: dict[str, bool]) -> None:
    sat = Sat().drive()
    sat.cycle(1, **{"enable": True, "sticks": MOVED, **lost})
    assert sat.state() is State.PAUSE
    assert sat.swing() == 0.0
    sat.cycle(5, enable=True, sticks=MOVED)  # back as before: not enough
    assert sat.state() is State.PAUSE


def test_a_machine_that_does_not_answer_pauses() -> None:
    sat = Sat().drive()
    seat = advance(sat.seat, sat.leases, {"left": False}, sat.now)
    assert seat.desk.consoles["left"].state is State.PAUSE


def test_stop_latches_over_release_and_a_new_request() -> None:
    sat = Sat().drive()
    sat.seat = replace(sat.seat, buttons=Buttons(stop=True))
    sat.cycle(1, enable=True, sticks=MOVED)
    assert sat.state() is State.STOP
    again = with_console(without_console(sat.seat, "left"), "left", "ann pressed stop")
    assert again.desk.consoles["left"].state is State.STOP
    sat.seat = replace(sat.seat, buttons=Buttons(reset=True))
    sat.cycle(1, enable=True)
    assert sat.state() is State.STOP  # not while the dead-man is held
    sat.seat = replace(sat.seat, buttons=Buttons(reset=True))
    sat.cycle(1)
    assert sat.state() is State.IDLE


def test_one_operator_two_machines_one_is_driven() -> None:
    sat = Sat(ANN, "left", "right").drive()
    assert sat.swing("right") == 0.0
    assert drives(sat.seat, "right", sat.now).desk.driven == "left"  # not while it is driven
    sat.cycle(2)
    sat.seat = drives(sat.seat, "right", sat.now)
    assert sat.seat.desk.driven == "right"
    sat.cycle(3)
    sat.cycle(2, enable=True)
    sat.cycle(2, enable=True, sticks=MOVED)
    assert sat.swing("right") != 0.0
    assert sat.swing("left") == 0.0


def test_the_pattern_changes_in_neutral_only() -> None:
    sat = Sat().drive()
    assert set_up(sat.seat, Pattern.SAE, False).setting.pattern is Pattern.ISO
    sat.cycle(1)
    assert set_up(sat.seat, Pattern.SAE, True).setting.pattern is Pattern.SAE


def test_the_method_changes_in_neutral_only() -> None:
    sat = Sat().drive()
    assert sat.seat.setting.method is Method.BRAKING
    held = set_up(sat.seat, Pattern.ISO, True, Method.SCALING)
    assert (held.setting.method, held.setting.fine) == (Method.BRAKING, True)
    sat.cycle(1)
    chosen = set_up(sat.seat, Pattern.ISO, False, Method.SCALING)
    assert chosen.setting.method is Method.SCALING
    assert set_up(chosen, Pattern.SAE, False).setting.method is Method.SCALING


def test_fine_is_slower() -> None:
    sat = Sat().drive()
    fine = set_up(sat.seat, Pattern.ISO, True)
    ratio = wish(fine, "left", MINI).joints[0] / sat.swing()
    np.testing.assert_allclose(ratio, 0.3)


def test_an_override_needs_a_supervisor_a_reason_and_the_hold() -> None:
    for person, reason, held in (
        (ANN, "stuck", True),
        (SUE, " ", True),
        (SUE, "stuck", False),
    ):
        sat = Sat(person).drive()
        sat.seat = replace(sat.seat, reason=reason)
        sat.cycle(1, enable=True, sticks=MOVED, override=held)
        assert override(sat.seat, "left") is None
    sat = Sat(SUE).drive()
    sat.seat = replace(sat.seat, reason="stuck")
    sat.cycle(1, enable=True, sticks=MOVED, override=True)
    held_now = override(sat.seat, "left")
    assert held_now is not None
    assert held_now.reason == "stuck"
    sat.cycle(1, enable=True, sticks=MOVED)
    assert sat.state() is State.PAUSE


def test_a_lease_that_is_lost_reserves() -> None:
    sat = Sat().drive()
    sat.leases = {"left": False}
    sat.cycle(1, enable=True, sticks=MOVED)
    assert sat.state() is State.RESERVED
    assert sat.swing() == 0.0
