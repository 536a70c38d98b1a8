"""The ballast scene in simulated time: close to the limits, never in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.collision.scene import scene
from backend.collision.server import closest
from backend.collision.verdict import contact
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.shell.sim.program_file import load_program
from backend.shell.sim.simulate import simulate
from backend.site.bodies import site_bodies
from backend.site.gauge_in_force import own_tracks
from backend.site.site import load_site
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make

SITE = load_site("ballast")
BODIES = site_bodies(SITE).without({"T1"})  # which RAIL stands on
PERIOD = 50.0


def placed(name: str, seconds: float) -> list[Boxes]:
    """Where the bodies of one machine are, every 0.2 s of its second cycle."""
    machine, start = load_machine(SITE.machine(name).model), SITE.machine(name).start
    assert start is not None
    at = SITE.frame.from_projected(np.array(start.position))
    base = make(from_attitude(*start.attitude), at)
    done = simulate(machine, load_program(machine, SITE, name), 2.0 * seconds, 0.04)
    half = len(done.q) // 2
    return [body_boxes(machine, link_poses(machine, q, base)) for q in done.q[half::5]]


@pytest.fixture(scope="module")
def rail() -> list[Boxes]:
    return placed("rail", PERIOD)


def test_the_gauge_holds_what_the_thesis_says() -> None:
    assert set(BODIES.idle) == {"below"}
    start = SITE.machine("rail").start
    assert start is not None
    at = SITE.frame.from_projected(np.array(start.position))
    assert own_tracks(site_bodies(SITE), at, start.attitude[0]) == ("T1",)
    kinds = {v.name: v.kind for v in BODIES.volumes}
    assert kinds["T2"] == "track"
    assert kinds["wire-T2"] == "overhead"
    t2 = next(v for v in BODIES.volumes if v.name == "T2")
    # Mäkinen 2021, Section 2.1.2: 1.845 m to either side of the middle of the track at -4.5 m.
    np.testing.assert_array_equal(
        t2.contains(np.array([[0.0, -2.66, 1.0], [0.0, -2.64, 1.0]])), [True, False]
    )


def test_rail_comes_close_to_the_limits_and_stays_out(rail: list[Boxes]) -> None:
    limits = scene(BODIES.boxes, BODIES.full_names)
    found: list[Any] = [closest(limits, boxes, 5.0, k=1) for boxes in rail]
    near = np.array([c.distance.min() for c in found])
    assert 0.25 < near.min() < 0.8
    assert not any(contact(boxes, BODIES.boxes)[0] for boxes in rail)  # python-fcl's word
    # The wire and the track both come into play.
    at = {BODIES.full_names[c.body[np.argmin(c.distance)]].split("/")[0] for c in found}
    assert {"gauge:T2", "gauge:wire-T1"} <= at


def test_the_machines_keep_clear_of_each_other(rail: list[Boxes]) -> None:
    support = placed("support", 40.0)
    apart = [closest_pairs(a, b).distance[0] for a, b in zip(rail, support, strict=False)]
    assert min(apart) > 1.0
