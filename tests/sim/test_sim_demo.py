"""The demo's choreography, in simulated time: close again and again, never in contact."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.shell.sim.program import motions
from backend.shell.sim.program_file import load_program
from backend.shell.sim.simulate import simulate
from backend.site.site import load_site
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make

SITE = load_site("demo")
NAMES = ("left", "right")
MACHINES = {n: load_machine(SITE.machine(n).model) for n in NAMES}
PROGRAMS = {n: load_program(MACHINES[n], SITE, n) for n in NAMES}
CYCLE_START = 60.0
PERIOD = 40.0


def base(name):
    start = SITE.machine(name).start
    return make(from_attitude(*start.attitude), SITE.frame.from_projected(np.array(start.position)))


@pytest.fixture(scope="module")
def run():
    """(times (k,), distances (k,), joints by machine) of script and one cycle, every 0.2 s."""
    done = {n: simulate(MACHINES[n], PROGRAMS[n], CYCLE_START + PERIOD, 0.04) for n in NAMES}
    picked = slice(None, None, 5)
    times = done["left"].times[picked]
    joints = {n: done[n].q[picked] for n in NAMES}
    distances = []
    for row in zip(*(joints[n] for n in NAMES), strict=True):
        left, right = (
            body_boxes(MACHINES[n], link_poses(MACHINES[n], q, base(n)))
            for n, q in zip(NAMES, row, strict=True)
        )
        distances.append(closest_pairs(left, right).distance[0])
    return times, np.array(distances), joints


def test_never_in_contact(run):
    assert run[1].min() >= 0.12


def test_first_minute_is_as_told(run):
    times, distance, joints = run

    def d(t):
        return distance[np.argmin(np.abs(times - t))]

    def swing(name, t):
        return joints[name][np.argmin(np.abs(times - t)), 0]

    assert d(5) > 3.0  # digging, far apart
    assert swing("left", 12) - swing("left", 8) > 0.3  # LEFT swings to its left
    assert d(15) > 2.0
    assert swing("right", 20) - swing("right", 15) > 0.5  # RIGHT turns in
    assert 0.70 < d(22) < 0.85
    assert 0.12 <= d(28) <= 0.2
    assert swing("left", 37) - swing("left", 34) < -0.2  # away to its right
    assert d(37) > 1.0
    assert d(50) > 3.0  # nothing near while RIGHT is silent
    assert np.argmin(distance[times < CYCLE_START]) == pytest.approx(140, abs=30)  # 28 s to 34 s


def test_each_cycle_brings_them_near_and_apart(run):
    times, distance, _ = run
    inside = distance[times >= CYCLE_START]
    assert 0.3 <= inside.min() <= 1.0
    assert inside.max() > 3.0
    near = inside < 1.0
    assert np.count_nonzero(near[1:] & ~near[:-1]) == 2  # twice in each cycle


def test_laps_can_be_made_for_long():
    """Variations never ask for more than there is, and never change where the machines meet."""
    for name in NAMES:
        program = PROGRAMS[name]
        meeting = [m.goal for m in motions(program, 0) if m.goal[0] > np.radians(-60.0)]
        for lap in range(25):
            goals = [m.goal for m in motions(program, lap) if m.goal[0] > np.radians(-60.0)]
            np.testing.assert_allclose(goals, meeting, atol=1e-12)
