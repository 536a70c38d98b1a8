"""The bar along the bucket's edge."""

from __future__ import annotations

import numpy as np
import pytest

from backend.contact.outfit import edge_half_width, edge_radius, lowest
from backend.machine.kinematics import body_boxes, end_point_of, link_poses
from backend.machine.load import load_machine
from backend.machine.sun_map import sun_angles


@pytest.mark.parametrize("name", ["shovel", "mini", "ex13"])
@pytest.mark.parametrize("degrees", [-120.0, -90.0, -60.0, -30.0])
def test_how_far_the_bucket_reaches_below_its_edge(name: str, degrees: float) -> None:
    machine = load_machine(name)
    q = np.array([0.4, 0.9, -1.4, 0.0])
    # The bucket's line at that elevation over the ground.
    q[3] += machine.sun.signs[2] * (np.radians(degrees) - sun_angles(machine, q).sum())
    poses = link_poses(machine, q)
    last = [k for k, link in enumerate(machine.body_links) if link == machine.end_link]
    low = body_boxes(machine, poses).take(np.array(last)).corners()[..., 2].min()
    tip = end_point_of(machine, poses)[2]
    assert lowest(machine, np.radians(degrees)) == pytest.approx(tip - low, abs=1e-9)


@pytest.mark.parametrize("name", ["shovel", "mini", "ex13"])
def test_the_bar_holds_the_bucket_off_the_ground(name: str) -> None:
    machine = load_machine(name)
    assert edge_radius(machine) >= lowest(machine, -0.5 * np.pi)
    assert 0.0 < edge_half_width(machine) < 0.5 * machine.tracks.gauge
