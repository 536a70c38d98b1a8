"""Stages are wanted while somebody looks, not too often, and are not shown when they are old."""

from __future__ import annotations

import math

import numpy as np

from backend.perception.detect import Objects
from backend.perception.stages import StagedScan
from backend.shell import stages_look
from backend.shell.stages_look import StagesLook

NONE = Objects(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.int64))


def stages(time: float) -> StagedScan:
    none = np.zeros(0, np.uint8)
    return StagedScan(time, np.zeros((0, 3)), none, none, (0,) * 5, None, NONE)


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_nobody_looks_and_nothing_is_made() -> None:
    clock = Clock()
    look = StagesLook(clock)
    assert not look.wanted()
    clock.now += 1.0
    assert not look.wanted()


def test_made_at_most_twice_a_second_and_only_while_looked_at() -> None:
    clock = Clock()
    look = StagesLook(clock)
    made = []
    for k in range(120):  # 10 Hz of scans for twelve seconds; looked at for the first five
        clock.now = 100.0 + 0.1 * k
        if k <= 50 and k % 4 == 0:
            look.look()
        if look.wanted():
            look.keep(stages(clock.now - 0.05))
            made.append(clock.now)
    assert min(np.diff(made)) > stages_look.PERIOD - 1e-6
    assert 12 <= len(made) <= 15
    assert made[-1] < 105.0 + stages_look.LOOKED


def test_what_is_told() -> None:
    clock = Clock()
    look = StagesLook(clock)
    first = look.look()
    assert (first.stages, first.reason) == (None, "waiting for a scan")
    assert math.isnan(first.age)
    newest = stages(99.9)
    look.keep(newest)
    clock.now = 100.5
    told = look.look()
    assert told.stages is newest
    assert (round(told.age, 6), told.reason) == (0.6, "")
    clock.now = 101.2
    old = look.look()
    assert (old.stages, old.reason) == (None, "no scan for 1.3 s")
    assert look.look("the process ended").reason == "the process ended"
    clock.now = 140.0  # looked at again after a while: not "no scan for 40 s"
    assert look.look().reason == "waiting for a scan"
