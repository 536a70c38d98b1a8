"""One page in front of which somebody sits: what they last did, and what follows from it.

Input is never invented: what is not said anew within `console.PRESENT` counts as let go, and only
the machine that is driven is moved by the sticks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from backend.control.console import Console, Event, State
from backend.control.desk import Desk, advance_all, choose
from backend.control.patterns import (
    Method,
    Pattern,
    Setting,
    Sticks,
    neutral,
    velocities,
    with_method,
    with_pattern,
)
from backend.control.person import Person
from backend.machine.model import Machine
from backend.safety.limiter import Override, Wish


@dataclass(frozen=True)
class Input:
    """What a page said of its levers. time: of its arrival [s]; sequence: rises with every one;
    source: "gamepad", "keyboard", "screen" or empty; the rest as in `console.Event`.
    """

    time: float = -math.inf
    sequence: int = -1
    sticks: Sticks = field(default_factory=Sticks)
    enable: bool = False
    focus: bool = False
    gamepad: bool = True
    override: bool = False
    source: str = ""


@dataclass(frozen=True)
class Buttons:
    """Pressed since the last cycle; each counts once."""

    stop: bool = False
    reset: bool = False
    pause: bool = False


@dataclass(frozen=True)
class Seat:
    """desk: the consoles of every machine that was asked for; reason: of an override."""

    person: Person
    desk: Desk = field(default_factory=Desk)
    setting: Setting = field(default_factory=Setting)
    input: Input = field(default_factory=Input)
    buttons: Buttons = field(default_factory=Buttons)
    reason: str = ""


def said(seat: Seat, new: Input) -> Seat:
    """The seat after an input; one that is not newer than the last is left out."""
    return replace(seat, input=new) if new.sequence > seat.input.sequence else seat


def set_up(seat: Seat, pattern: Pattern, fine: bool, method: Method | None = None) -> Seat:
    """The seat after the operator chose a pattern and a method (both only in neutral) and a speed.

    method: None for the one that it has.
    """
    sticks = seat.input.sticks
    setting = with_pattern(replace(seat.setting, fine=fine), pattern, sticks)
    return replace(seat, setting=with_method(setting, method or setting.method, sticks))


def drives(seat: Seat, machine: str, now: float) -> Seat:
    """The seat after the operator chose which machine the sticks belong to."""
    return replace(seat, desk=choose(seat.desk, machine, event_of(seat, True, now)))


def with_console(seat: Seat, machine: str, stopped: str) -> Seat:
    """The seat with a console for a machine that was asked for; the first one is driven.

    stopped: why the machine was stopped, which latches; empty when it was not.
    """
    if machine in seat.desk.consoles:
        return seat
    console = Console(State.STOP, why=stopped) if stopped else Console()
    consoles = {**seat.desk.consoles, machine: console}
    return replace(seat, desk=Desk(consoles, seat.desk.driven or machine))


def without_console(seat: Seat, machine: str) -> Seat:
    """The seat after its operator gave a machine back."""
    consoles = {name: c for name, c in seat.desk.consoles.items() if name != machine}
    driven = "" if seat.desk.driven == machine else seat.desk.driven
    return replace(seat, desk=Desk(consoles, driven or next(iter(consoles), "")))


def event_of(seat: Seat, network: bool, now: float) -> Event:
    """What the seat's input and buttons mean for its consoles at `now` [s]."""
    given, buttons = seat.input, seat.buttons
    # A page that is there for the first time and has said nothing has nothing pressed.
    time = now if given.sequence < 0 else given.time
    return Event(
        time=time,
        focus=given.focus or given.sequence < 0,
        gamepad=given.gamepad,
        network=network,
        enable=given.enable,
        neutral=neutral(given.sticks),
        stop=buttons.stop,
        reset=buttons.reset,
        pause=buttons.pause,
        override=given.override and seat.person.may_override and bool(seat.reason.strip()),
    )


def advance(
    seat: Seat, leases: Mapping[str, bool], networks: Mapping[str, bool], now: float
) -> Seat:
    """The seat one cycle later; its buttons are spent.

    leases: whether each machine's lease is this seat's; networks: whether each machine answers.
    """
    event = event_of(seat, networks.get(seat.desk.driven, True), now)
    desk = advance_all(seat.desk, event, leases, now)
    return replace(seat, desk=desk, buttons=Buttons())


def wish(seat: Seat, name: str, machine: Machine) -> Wish:
    """What the sticks ask of a machine now: nothing but of the one that is driven and enabled."""
    console = seat.desk.consoles.get(name)
    if console is None or name != seat.desk.driven or not console.may_move:
        return Wish(np.zeros(len(machine.joints)), np.zeros(2))
    return Wish(*velocities(machine, seat.input.sticks, seat.setting))


def override(seat: Seat, name: str) -> Override | None:
    """The override that is held for a machine, if any."""
    console = seat.desk.consoles.get(name)
    if console is None or console.state is not State.OVERRIDE:
        return None
    return Override(seat.person.who, seat.person.role, seat.reason)
