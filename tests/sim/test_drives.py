"""A small sample of the careless drives, and that their judge sees contacts."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.verdict import contact
from backend.control.patterns import Sticks, neutral
from backend.machine.load import load_machine
from backend.pipeline.place import place
from backend.shell.sim.careless import SETTLE, Careless
from backend.shell.sim.drives import Drive, drive, twin
from backend.spatial import transform

SOON = [(5, ("mini", "ex13")), (12, ("mini", "mini")), (10, ("ex13", "mini"))]
"""Drives that end in contact within 6 s when nothing is limited."""


@pytest.mark.parametrize(("seed", "models"), SOON)
def test_what_ends_in_contact_does_not_with_the_limiter(seed, models) -> None:
    plan = Drive(seed, models, seconds=6.0)
    free = drive(twin(plan))
    assert free.contact is not None
    limited = drive(plan)
    end = len(free.path) - 1
    part = sum(limited.path[end]) / sum(free.path[end])
    print(f"\nseed {seed}: contact without the limiter at {free.contact:.1f} s")
    print(f"  with it        expected none     measured {limited.contact}")
    print(f"  nearest        expected > 0      measured {limited.nearest:.2f} m")
    print(f"  joint travel   expected >= 50 %  measured {part:.0%}")
    assert limited.contact is None
    assert part >= 0.5


class Hold:
    """One stick held at full deflection."""

    def __init__(self, **deflected: float) -> None:
        self.sticks = Sticks(**deflected)

    def at(self, t: float) -> Sticks:
        return self.sticks if t > SETTLE else Sticks()


def test_swung_into_a_standing_partner_it_stops_before_p_l_and_not_far_from_it() -> None:
    plan, hands = Drive(0, seconds=7.0), (Hold(left_x=1.0), Hold())
    free, limited = drive(twin(plan), hands), drive(plan, hands)
    assert free.contact is not None
    assert limited.contact is None
    # p_l = 0.2 m, and twice 0.1 m that poses may be wrong by.
    assert 0.2 < limited.nearest < 0.6
    assert limited.path[-1][0] > 0.9 * free.path[-1][0]


def test_a_radio_too_slow_locks_motion_and_says_why() -> None:
    found = drive(Drive(1, up=0.3, down=0.3, seconds=2.5))
    assert sum(found.path[-1]) == 0.0
    assert any("locked above 400 ms" in reason for reason in found.reasons)


def test_the_judge_sees_contact_and_bounds_what_is_left() -> None:
    machine = load_machine("mini")
    q = np.array([0.0, 0.3, -1.2, -0.4])
    here = place(machine, q, np.eye(4)).boxes
    for x, touches in ((0.5, True), (1.5, True), (12.0, False)):
        there = place(machine, q, transform.make(np.eye(3), np.array([x, 0.0, 0.0]))).boxes
        found, apart = contact(here, there)
        assert found is touches
        assert (apart > 0.0) is not touches


def test_sticks_are_thrown_to_full_and_begin_in_neutral() -> None:
    sticks = Careless(np.random.default_rng(1))
    assert neutral(sticks.at(SETTLE))
    seen = [vars(sticks.at(t)) for t in np.arange(SETTLE + 0.01, 30.0, 0.1)]
    for name in seen[0]:
        assert {s[name] for s in seen} == {-1.0, 0.0, 1.0}
