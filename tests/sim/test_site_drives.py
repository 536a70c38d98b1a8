"""Full speed at what stands on the site, in simulated time; python-fcl judges the true poses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from backend.control.patterns import Sticks
from backend.shell.sim.careless import SETTLE
from backend.shell.sim.drives import Drive, drive, twin
from backend.shell.sim.dynamics import SimState
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation
from backend.spatial.boxes import Boxes

Q = np.array([0.0, 0.4, -1.2, -0.4])


class Hold:
    """Sticks held at full deflection."""

    def __init__(self, **deflected: float) -> None:
        self.sticks = Sticks(**deflected)

    def at(self, t: float) -> Sticks:
        return self.sticks if t > SETTLE else Sticks()


def start() -> list[SimState]:
    """The machine at the origin, its partner out of everybody's way."""
    places = np.zeros(3), np.array([80.0, 0.0, 0.0])
    return [SimState(Q, np.zeros(4), p, 0.0, 0.0, 0.0, np.zeros(2)) for p in places]


def wall(x: float, y: float, yaw: float = 0.0, thick: float = 0.01) -> SiteBodies:
    """20 m long and 5 m high."""
    boxes = Boxes(np.array([[x, y, 2.5]]), rotation.rz(yaw)[None], np.array([[thick, 10.0, 2.5]]))
    return SiteBodies(boxes, ("wall",))


AHEAD = {"track_left": 1.0, "track_right": 1.0}
# Sticks, a wall, seconds, and how near the machine still comes: p_l = 0.2 m, and about 0.1 m that
# the pose may be wrong by; where several motions are limited at once it is still on its way.
TRIALS = [
    ("mini", AHEAD, wall(7.0, 0.0), 9.0, 0.6),
    ("ex13", {"left_x": 1.0}, wall(0.0, -5.0, math.pi / 2), 7.0, 0.6),
    ("mini", {"left_x": 1.0}, wall(-1.0, -3.2, math.pi / 2), 6.0, 0.6),
    ("mini", {"left_y": 1.0, **AHEAD}, wall(6.0, 0.0, 0.1), 6.0, 1.0),
    ("mini", {"left_x": -1.0, "track_right": 1.0}, wall(2.6, 2.6, 0.8), 4.0, 0.6),
]


@pytest.mark.parametrize(("model", "sticks", "bodies", "seconds", "most"), TRIALS)
def test_at_a_wall_it_stops_before_p_l_and_without_the_limiter_it_does_not(
    model, sticks, bodies, seconds, most
) -> None:
    plan = Drive(0, (model, "mini"), seconds=seconds)
    hands = Hold(**sticks), Hold()
    free = drive(twin(plan), hands, bodies, start())
    limited = drive(plan, hands, bodies, start())
    print(f"\n{model} {sticks}")
    print(f"  contact without the limiter  expected one          measured {free.contact} s")
    print(f"  contact with it              expected none         measured {limited.contact}")
    print(
        f"  nearest                      expected 0.2 to {most}   measured {limited.nearest:.2f} m"
    )
    assert free.contact is not None
    assert limited.contact is None
    assert 0.2 < limited.nearest < most


def test_swinging_and_driving_into_many_boxes() -> None:
    rng = np.random.default_rng(3)
    bearing, away = rng.uniform(-np.pi, np.pi, 400), rng.uniform(3.6, 13.0, 400)
    centers = np.stack([away * np.cos(bearing), away * np.sin(bearing), rng.uniform(0, 4, 400)], 1)
    turns = rotation.from_quaternion(rng.normal(size=(400, 4)))
    boxes = Boxes(centers, turns, rng.uniform(0.02, 0.4, (400, 3)))
    bodies = SiteBodies(boxes, tuple(f"post/{k}" for k in range(400)))
    plan, hands = Drive(4, seconds=4.5), (Hold(left_x=1.0, **AHEAD), Hold())
    free, limited = drive(twin(plan), hands, bodies, start()), drive(plan, hands, bodies, start())
    assert free.contact is not None
    assert limited.contact is None
    assert limited.path[-1][0] > 0.05
