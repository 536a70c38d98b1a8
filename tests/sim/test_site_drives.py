"""Full speed at what stands on the site, in simulated time; python-fcl judges the true poses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from backend.control.patterns import Sticks
from backend.shell.sim.careless import SETTLE, Careless
from backend.shell.sim.drives import Drive, drive, machine_of, twin
from backend.shell.sim.dynamics import SimState
from backend.site.bodies import SiteBodies
from backend.spatial import rotation
from backend.spatial.boxes import Boxes

Q = np.array([0.0, 0.4, -1.2, -0.4])


class Hold:
    """Sticks held at full deflection."""

    def __init__(self, **deflected: float) -> None:
        self.sticks = Sticks(**deflected)

    def at(self, t: float) -> Sticks:
        return self.sticks if t > SETTLE else Sticks()


def start(yaw: float = 0.0) -> list[SimState]:
    """The machine at the origin, its partner out of everybody's way."""
    places = np.zeros(3), np.array([80.0, 0.0, 0.0])
    return [SimState(Q, np.zeros(4), p, yaw, 0.0, 0.0, np.zeros(2)) for p in places]


def wall(x: float, y: float, yaw: float = 0.0, thick: float = 0.01) -> SiteBodies:
    """20 m long and 5 m high."""
    boxes = Boxes(np.array([[x, y, 2.5]]), rotation.rz(yaw)[None], np.array([[thick, 10.0, 2.5]]))
    return SiteBodies(boxes, ("wall",))


AHEAD = {"track_left": 1.0, "track_right": 1.0}
TRIALS = [
    ("mini", AHEAD, wall(9.0, 0.0), 12.0),
    ("ex13", AHEAD, wall(16.0, 0.0, 0.3), 12.0),
    ("mini", {"left_x": 1.0}, wall(-1.0, -3.2, math.pi / 2), 6.0),
    ("mini", {"left_y": 1.0, "right_y": -1.0, **AHEAD}, wall(9.0, 0.0, 0.2), 12.0),
    ("mini", {"left_x": -1.0, "track_left": 1.0}, wall(5.5, 3.0, 0.8), 8.0),
]


@pytest.mark.parametrize(("model", "sticks", "bodies", "seconds"), TRIALS)
def test_at_a_wall_it_stops_before_p_l_and_without_the_limiter_it_does_not(
    model, sticks, bodies, seconds
) -> None:
    plan = Drive(0, (model, "mini"), seconds=seconds)
    hands = Hold(**sticks), Hold()
    free = drive(twin(plan), hands, bodies, start())
    limited = drive(plan, hands, bodies, start())
    print(f"\n{model} {sticks}")
    print(f"  contact without the limiter  expected one          measured {free.contact} s")
    print(f"  contact with it              expected none         measured {limited.contact}")
    print(f"  nearest                      expected 0.2 to 0.6   measured {limited.nearest:.2f} m")
    assert free.contact is not None
    assert limited.contact is None
    # p_l = 0.2 m, and about 0.1 m that the pose may be wrong by; it does not stop far off either.
    assert 0.2 < limited.nearest < 0.6


def test_careless_among_a_thousand_boxes() -> None:
    rng = np.random.default_rng(3)
    bearing, away = rng.uniform(-np.pi, np.pi, 1000), rng.uniform(5.5, 40.0, 1000)
    centers = np.stack([away * np.cos(bearing), away * np.sin(bearing), rng.uniform(0, 4, 1000)], 1)
    turns = rotation.from_quaternion(rng.normal(size=(1000, 4)))
    boxes = Boxes(centers, turns, rng.uniform(0.02, 0.4, (1000, 3)))
    bodies = SiteBodies(boxes, tuple(f"post/{k}" for k in range(1000)))
    plan = Drive(4, seconds=8.0)
    hands = [Careless(np.random.default_rng(k)) for k in range(2)]
    again = [Careless(np.random.default_rng(k)) for k in range(2)]
    free, limited = drive(twin(plan), hands, bodies, start()), drive(plan, again, bodies, start())
    assert free.contact is not None
    assert limited.contact is None
    assert limited.path[-1][0] > 0.5
    assert machine_of("mini").max_reach > 5.5
