"""The pole scene in simulated time: as near as in Mäkinen 2021, Fig. 4.3, and back; no contact."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.collision.verdict import contact
from backend.machine.kinematics import body_boxes, end_point, link_poses
from backend.machine.load import load_machine
from backend.planning import rail_site
from backend.shell.sim.program_file import load_program
from backend.shell.sim.simulate import simulate
from backend.site.bodies import site_bodies
from backend.site.site import load_site
from backend.spatial.boxes import Boxes

SITE = load_site("pole")
BODIES = site_bodies(SITE)
RAIL = load_machine("rail6")
STEP = 0.04


@pytest.fixture(scope="module")
def postures() -> np.ndarray:
    """The second of two cycles of 12 s, every STEP."""
    q = simulate(RAIL, load_program(RAIL, SITE, "rail"), 24.0, STEP).q
    return np.asarray(q[len(q) // 2 :])


@pytest.fixture(scope="module")
def bodies(postures: np.ndarray) -> list[Boxes]:
    # The machine's root is the site's origin, as in the use case.
    return [body_boxes(RAIL, link_poses(RAIL, q)) for q in postures[::5]]


def test_the_pole_stands_where_the_use_case_has_it() -> None:
    (box,) = (k for k, name in enumerate(BODIES.names) if name.startswith("gauge:pole"))
    want = rail_site.pole_limits().boxes
    np.testing.assert_allclose(BODIES.boxes.centers[box], want.centers[0], atol=0.01)
    assert set(BODIES.idle) == {"T1"}


def test_the_tool_comes_near_from_one_second_on_and_goes_back(
    postures: np.ndarray, bodies: list[Boxes]
) -> None:
    near = np.array([closest_pairs(boxes, BODIES.boxes).distance[0] for boxes in bodies])
    t = 5 * STEP * np.arange(len(near))
    assert near[0] > 1.4
    assert 0.3 < near.min() < 0.45  # between p_l and p_u
    assert 4.0 < t[near.argmin()] < 6.0
    assert near[-1] > 1.4
    assert not any(contact(boxes, BODIES.boxes)[0] for boxes in bodies)
    # Straight to the pole's side of the track: as far as 0.6 m/s go in the thesis, slowed down.
    tips = end_point(RAIL, postures)
    way = tips[int(5.0 / STEP)] - tips[0]
    assert way[1] > 0.8
    assert np.abs(way[[0, 2]]).max() < 0.25
