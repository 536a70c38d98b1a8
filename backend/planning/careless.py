"""Careless drives beside random limits: full-speed sticks that know nothing of what is near."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from backend.machine.model import Machine
from backend.planning.proximity import Limits
from backend.planning.records import Wish
from backend.planning.simulate import clearances
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import rz
from backend.spatial.types import Array

_CLEAR = 0.5  # [m] at the start
_TRIES = 200


class CarelessDrive(NamedTuple):
    """limits around the machine; q_start (n,); wish by time and posture; all from one seed."""

    limits: Limits
    q_start: Array
    wish: Callable[[float, Array], Wish]


def careless_drive(machine: Machine, seed: int, seconds: float) -> CarelessDrive:
    """Two to five boxes within reach, turned about the vertical, and sticks at full speed that stay
    so for half a second to three seconds each; the machine starts clear of everything.
    """
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 6))
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
    while True:
        around, far = random.uniform(-np.pi, np.pi, count), random.uniform(2.5, 6.0, count)
        half = random.uniform((0.15, 0.15, 0.3), (1.5, 1.5, 2.5), (count, 3))
        far += np.linalg.norm(half[:, :2], axis=1)  # beyond the the chassis
        height = random.uniform(-0.5, 4.5, count)
        centers = np.stack([far * np.cos(around), far * np.sin(around), height], axis=1)
        boxes = Boxes(centers, rz(random.uniform(0.0, np.pi, count)), half)
        limits = Limits(tuple(f"limit {k + 1}" for k in range(count)), boxes)
        for posture in random.uniform(low, high, (_TRIES, len(low))):
            if clearances(machine, limits, posture[None], cap=_CLEAR)[0] >= _CLEAR:
                return CarelessDrive(limits, posture, _sticks(machine, random, seconds))


def _sticks(
    machine: Machine, random: np.random.Generator, seconds: float
) -> Callable[[float, Array], Wish]:
    n = len(machine.joints)
    changes, values = [], []
    for _ in range(n):
        times = np.cumsum(random.uniform(0.5, 3.0, int(2.0 * seconds) + 2))
        changes.append(times)
        values.append(random.choice([-1.0, 0.0, 1.0], len(times) + 1, p=[0.4, 0.2, 0.4]))

    def wish(t: float, q: Array) -> Wish:
        lever = [v[np.searchsorted(c, t)] for v, c in zip(values, changes, strict=True)]
        return Wish(rates=np.array(lever) * machine.max_velocity)

    return wish
