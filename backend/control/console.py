"""The states of an operator's console for one machine.

    RESERVED: another holds the lease, or nobody does        IDLE: own lease, not enabled
    ENABLED: dead-man held, sticks neutral                   ACTIVE: enabled, a stick is moved
    PAUSE: interrupted; neutral and a new press resume       OVERRIDE: a supervisor holds it to run
    STOP: latched; a reset leads to IDLE and never further

Nothing arms itself: every way to motion begins with the dead-man pressed anew, sticks in neutral.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

PRESENT = 0.2
"""Input of the operator's that is older than this counts as let go [s]: a zero command leaves
within a quarter of a second of the last input. What is let go by hand is told at once."""


class State(Enum):
    RESERVED = "Reserved"
    IDLE = "Idle"
    ENABLED = "Enabled"
    ACTIVE = "Active"
    PAUSE = "Pause"
    OVERRIDE = "Override"
    STOP = "Stop"


MOVING = (State.ENABLED, State.ACTIVE, State.OVERRIDE)
"""States in which commands may be other than zero."""


@dataclass(frozen=True)
class Event:
    """What the console knows at one moment.

    time: when the operator's input was read [s]; lease: whether the machine's lease is ours; focus,
    gamepad, network: whether page, device and radio are there; enable: dead-man held; neutral: all
    sticks; stop, reset, pause: buttons; override: a supervisor's button held, with a reason.
    """

    time: float
    lease: bool = True
    focus: bool = True
    gamepad: bool = True
    network: bool = True
    enable: bool = False
    neutral: bool = True
    stop: bool = False
    reset: bool = False
    pause: bool = False
    override: bool = False


@dataclass(frozen=True)
class Console:
    """armed: the dead-man was seen released since the last interruption; why: of PAUSE, STOP."""

    state: State = State.RESERVED
    armed: bool = False
    why: str = ""
    since: float = -math.inf

    @property
    def may_move(self) -> bool:
        return self.state in MOVING


def advance(console: Console, event: Event, now: float) -> Console:
    """The console after an event, judged at `now` [s]."""
    state, why = _next(console, event, now)
    # Only a dead-man seen released in a calm state makes the next press count as a new one.
    present = 0.0 <= now - event.time <= PRESENT
    released = present and not event.enable and state is not State.STOP
    armed = released or (console.armed and state in (State.IDLE, State.PAUSE) and not event.enable)
    if state in MOVING:
        armed = False
    since = console.since if state is console.state else now
    return replace(console, state=state, armed=armed, why=why, since=since)


def _next(console: Console, event: Event, now: float) -> tuple[State, str]:
    if event.stop:
        return State.STOP, "stop was pressed"
    if console.state is State.STOP:
        if event.reset and event.neutral and not event.enable:
            return (State.IDLE if event.lease else State.RESERVED), ""
        return State.STOP, console.why
    if not event.lease:
        return State.RESERVED, ""
    if console.state is State.RESERVED:
        return State.IDLE, ""
    lost = _lost(event, now)
    moving = console.state in MOVING
    if lost:
        return (State.PAUSE, lost) if moving or console.state is State.PAUSE else (State.IDLE, lost)
    if moving:
        if event.pause:
            return State.PAUSE, "paused"
        if not event.enable:
            return State.PAUSE, "dead-man released"
        if event.override:
            return State.OVERRIDE, ""
        if console.state is State.OVERRIDE:
            # What the limits kept from moving must not start because the override ends.
            return State.PAUSE, "override released"
        return (State.ENABLED if event.neutral else State.ACTIVE), ""
    if event.enable and event.neutral and console.armed:
        return State.ENABLED, ""
    return console.state, console.why if console.state is State.PAUSE else ""


def _lost(event: Event, now: float) -> str:
    if not 0.0 <= now - event.time <= PRESENT:
        return "no input from the operator"
    if not event.gamepad:
        return "gamepad is disconnected"
    if not event.focus:
        return "page is not in front"
    return "" if event.network else "connection is lost"
