"""One operator's machines: several leases, one machine driven at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from backend.control.console import Console, Event, State, advance


@dataclass(frozen=True)
class Desk:
    """consoles: of every machine whose lease was asked for, by name; driven: the machine that the
    sticks belong to, empty for none.
    """

    consoles: Mapping[str, Console] = field(default_factory=dict)
    driven: str = ""


def choose(desk: Desk, machine: str, event: Event) -> Desk:
    """The desk after the operator chose a machine: only with sticks in neutral and the dead-man
    released, else unchanged. The machine that is left pauses.
    """
    if not event.neutral or event.enable or desk.driven == machine:
        return desk
    consoles = {name: _left(console) for name, console in desk.consoles.items()}
    consoles.setdefault(machine, Console())
    return Desk(consoles, machine)


def _left(console: Console) -> Console:
    if not console.may_move:
        return console
    return replace(console, state=State.PAUSE, why="another machine is driven", armed=False)


def advance_all(desk: Desk, event: Event, leases: Mapping[str, bool], now: float) -> Desk:
    """Every console after an event; the sticks reach only the machine that is driven.

    leases: whether each machine's lease is ours.
    """
    consoles = {}
    for name, console in desk.consoles.items():
        mine = replace(event, lease=leases.get(name, False))
        if name != desk.driven:
            mine = replace(mine, enable=False, override=False, neutral=True)
        consoles[name] = advance(console, mine, now)
    return replace(desk, consoles=consoles)
