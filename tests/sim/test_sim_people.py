"""The people scene in simulated time: near LEFT now and then, through nothing; machines apart."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.machine.kinematics import body_boxes, link_poses, swing_center
from backend.machine.load import load_machine
from backend.shell.sim.program_file import load_program
from backend.shell.sim.simulate import simulate
from backend.shell.sim.walkers import boxes_around, people_at
from backend.site.site import load_site
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make

SITE = load_site("people")
MINI = load_machine("mini")
EVERY = 0.4  # [s]
SECONDS = 160.0


def base(name: str) -> np.ndarray:
    start = SITE.machine(name).start
    assert start is not None
    at = SITE.frame.from_projected(np.array(start.position))
    return make(from_attitude(*start.attitude), at)


@pytest.fixture(scope="module")
def bodies() -> dict[str, list[Boxes]]:
    """Of both machines over one cycle; the cycles after it vary a little."""
    found = {}
    for name in ("left", "right"):
        q = simulate(MINI, load_program(MINI, SITE, name), 40.0, 0.04).q[:: round(EVERY / 0.04)]
        found[name] = [body_boxes(MINI, link_poses(MINI, one, base(name))) for one in q]
    return found


def test_the_machines_never_touch(bodies: dict[str, list[Boxes]]) -> None:
    pairs = zip(bodies["left"], bodies["right"], strict=True)
    assert min(closest_pairs(left, right).distance[0] for left, right in pairs) > 0.1


def test_people_come_within_left_s_reach_now_and_then_but_not_into_it() -> None:
    center = swing_center(MINI, base("left"))[:2]
    times = np.arange(0.0, SECONDS, EVERY)
    for k in range(2):
        places = np.array([people_at(SITE, float(t))[k].place for t in times])
        far = np.linalg.norm(places - center, axis=1)
        within = far < MINI.max_reach
        assert 0.05 < within.mean() < 0.6
        assert (np.diff(within.astype(int)) == 1).sum() >= 3
        assert far.min() > 2.5


def test_nobody_walks_through_a_machine_or_the_post(bodies: dict[str, list[Boxes]]) -> None:
    cycle = len(bodies["left"]) - 1
    post = SITE.obstacle_boxes()
    nearest = np.inf
    for k in range(round(SECONDS / EVERY)):
        people = boxes_around(people_at(SITE, k * EVERY))
        for other in (bodies["left"][k % cycle], bodies["right"][k % cycle], post):
            nearest = min(nearest, float(closest_pairs(people, other).distance[0]))
    assert nearest > 0.3


def test_they_cross_each_other_s_ways() -> None:
    apart = [
        np.linalg.norm(np.subtract(*(p.place for p in people_at(SITE, float(t)))))
        for t in np.arange(0.0, 1200.0, 0.5)
    ]
    assert min(apart) < 2.0
