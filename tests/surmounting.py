"""What tests of surmounting share: machines before steps that they can climb."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from backend.machine.load import load_machine
from backend.spatial.types import Array
from backend.surmount.machine import Climber, climber
from backend.surmount.plan import demands_of
from backend.surmount.records import Parameters, Step

STEPS = {"shovel": 0.066, "mini": 0.25, "ex13": 0.5}
"""[m]; the shovel's is that of the paper, Table 1."""
HOLDING = {
    "shovel": Parameters(0.2675, 0.21, 0.4396, 0.08, float(np.radians(16.75))),
    "mini": Parameters(1.534, 1.77, 2.36, 0.295, 0.30768349),
    "ex13": Parameters(3.185, 2.8, 4.2, 0.7, 0.2621467),
}
"""Parameters that hold; the shovel's are the paper's starting point, with a P4 of its own."""


@lru_cache(maxsize=8)
def climbing(name: str) -> tuple[Climber, Step]:
    """A machine and the step it climbs."""
    machine = load_machine(name)
    return climber(machine, demands_of(machine)), Step(STEPS[name])


def posture(machine_name: str) -> Array:
    """(4,) with the bucket in the air before the machine [rad]."""
    return np.array([0.0, 0.8, -1.5, -0.5])
