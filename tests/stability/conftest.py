"""Machines whose masses are trusted, and motions of them."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest

from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.spatial import rotation, transform

_loaded = functools.cache(load_machine)


@pytest.fixture(params=["mini", "ex13", "rail6"])
def machine(request: pytest.FixtureRequest) -> Machine:
    return _loaded(request.param)


@pytest.fixture
def ex13() -> Machine:
    return _loaded("ex13")


@pytest.fixture
def mini() -> Machine:
    return _loaded("mini")


@pytest.fixture(scope="session")
def draw() -> Callable[[Machine, np.random.Generator, int], tuple[np.ndarray, ...]]:
    """Random q, qd, qdd (count, n): within the limits, as fast as can be, twice as hard."""

    def within(machine: Machine, random: np.random.Generator, count: int) -> tuple[np.ndarray, ...]:
        low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
        high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
        shape = (count, len(low))
        v, a = machine.max_velocity, 2.0 * machine.max_acceleration
        return (
            random.uniform(low, high, shape),
            random.uniform(-v, v, shape),
            random.uniform(-a, a, shape),
        )

    return within


@pytest.fixture(scope="session")
def slope() -> Callable[..., np.ndarray]:
    """T_site_root (4, 4) of a base with this yaw, pitch and roll [rad], somewhere."""

    def stand(yaw: float, pitch: float, roll: float) -> np.ndarray:
        return transform.make(
            rotation.from_attitude(yaw, pitch, roll), np.array([30.0, -12.0, 4.0])
        )

    return stand
