"""The console's states: nothing arms itself, everything that is lost stops."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.control.console import MOVING, PRESENT, Console, Event, State, advance
from backend.control.desk import Desk, advance_all, choose

CALM = Event(0.0)
HELD = Event(0.0, enable=True)
MOVED = Event(0.0, enable=True, neutral=False)


def run(*events: Event, start: Console | None = None) -> Console:
    """The console after events 20 ms apart."""
    console = start or Console()
    t = max(console.since, 0.0)
    for event in events:
        t += 0.02
        console = advance(console, replace(event, time=t), t)
    return console


ACTIVE = run(CALM, CALM, HELD, MOVED)


def test_the_way_to_motion() -> None:
    assert Console().state is State.RESERVED
    assert run(CALM).state is State.IDLE
    assert run(CALM, CALM, HELD).state is State.ENABLED
    assert ACTIVE.state is State.ACTIVE
    assert ACTIVE.may_move


def test_a_dead_man_already_pressed_does_not_arm() -> None:
    assert not run(*[HELD] * 5).may_move


def test_neutral_is_required_to_begin() -> None:
    assert not run(CALM, CALM, MOVED, MOVED).may_move


@pytest.mark.parametrize("lost", ["focus", "gamepad", "network", "enable"])
def test_what_is_lost_stops_at_once_and_needs_a_new_press(lost: str) -> None:
    stopped = run(replace(MOVED, **{lost: False}), start=ACTIVE)
    assert stopped.state is State.PAUSE
    assert stopped.why
    assert not run(MOVED, HELD, start=stopped).may_move  # the dead-man stayed pressed
    assert not run(CALM, MOVED, start=stopped).may_move  # sticks not in neutral
    assert run(CALM, HELD, start=stopped).state is State.ENABLED


def test_the_pause_button_interrupts_and_needs_a_new_press() -> None:
    paused = run(replace(MOVED, pause=True), start=ACTIVE)
    assert (paused.state, paused.why) == (State.PAUSE, "paused")
    assert not run(MOVED, HELD, start=paused).may_move
    assert run(CALM, HELD, start=paused).state is State.ENABLED


def test_the_lease_lost_is_reserved_and_comes_back_idle() -> None:
    stopped = run(replace(MOVED, lease=False), start=ACTIVE)
    assert stopped.state is State.RESERVED
    assert run(HELD, HELD, start=stopped).state is State.IDLE


def test_silence_of_the_operators_device_stops() -> None:
    t = ACTIVE.since
    late = advance(ACTIVE, replace(MOVED, time=t), t + PRESENT + 1e-6)
    assert late.state is State.PAUSE
    assert PRESENT <= 0.2  # with a cycle more, a zero command leaves within 250 ms


def test_a_time_from_the_future_counts_as_no_input() -> None:
    assert advance(ACTIVE, replace(MOVED, time=5.0), 1.0).state is State.PAUSE


def test_stop_latches_and_reset_is_not_restart() -> None:
    stop = run(replace(MOVED, stop=True), start=ACTIVE)
    assert stop.state is State.STOP
    assert run(CALM, CALM, HELD, MOVED, start=stop).state is State.STOP
    for bad in (replace(HELD, reset=True), replace(CALM, reset=True, neutral=False)):
        assert run(bad, start=stop).state is State.STOP
    reset = run(replace(CALM, reset=True), start=stop)
    assert reset.state is State.IDLE
    assert run(CALM, replace(CALM, neutral=False), MOVED, start=reset).state is State.IDLE
    assert run(HELD, start=reset).state is State.ENABLED  # a press of its own


def test_stop_wins_over_everything() -> None:
    for console in (Console(), ACTIVE, run(CALM)):
        event = Event(0.0, lease=False, focus=False, stop=True, reset=True, override=True)
        assert run(event, start=console).state is State.STOP


def test_override_is_held_to_run() -> None:
    over = run(replace(MOVED, override=True), start=ACTIVE)
    assert over.state is State.OVERRIDE
    assert run(MOVED, start=over).state is State.PAUSE
    assert run(replace(CALM, override=True), start=over).state is State.PAUSE  # dead-man released
    assert not run(replace(CALM, override=True), start=run(CALM)).may_move


NAMES = (
    *("lease", "focus", "gamepad", "network", "enable"),
    *("neutral", "stop", "reset", "pause", "override"),
)
EVENTS = st.builds(
    Event,
    time=st.just(0.0),
    **{name: st.booleans() for name in NAMES},
)


@given(st.lists(EVENTS, max_size=30))
def test_no_sequence_moves_without_everything(events: list[Event]) -> None:
    console = Console()
    for k, event in enumerate(events):
        t = 0.02 * k
        before, console = console, advance(console, replace(event, time=t), t)
        if console.may_move:
            assert event.lease
            assert event.enable
            assert event.focus
            assert event.gamepad
            assert event.network
            assert not event.stop
        if console.may_move and before.state not in MOVING:
            assert event.neutral
            assert not events[k - 1].enable  # pressed anew
        if before.state is State.STOP:
            assert console.state in (State.STOP, State.IDLE, State.RESERVED)


def test_several_machines_one_driven() -> None:
    leases = {"left": True, "right": True}

    def after(desk: Desk, *events: Event) -> Desk:
        t = max((c.since for c in desk.consoles.values()), default=0.0)
        for event in events:
            t = max(t, 0.0) + 0.02
            desk = advance_all(desk, replace(event, time=t), leases, t)
        return desk

    desk = choose(choose(Desk(), "left", CALM), "right", CALM)
    assert desk.driven == "right"
    desk = after(desk, CALM, CALM, HELD, MOVED)
    assert desk.consoles["right"].state is State.ACTIVE
    assert not desk.consoles["left"].may_move
    assert choose(desk, "left", MOVED) is desk  # not while a stick is moved
    assert choose(desk, "left", HELD) is desk  # nor while the dead-man is held
    desk = choose(desk, "left", CALM)
    assert desk.driven == "left"
    assert not any(c.may_move for c in desk.consoles.values())
    desk = after(desk, CALM, HELD, MOVED)
    assert desk.consoles["left"].state is State.ACTIVE
    assert not desk.consoles["right"].may_move
