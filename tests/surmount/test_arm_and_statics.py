"""Joints by Eqs. (12)-(15), forces and torques against principles that know nothing of them."""

from __future__ import annotations

import numpy as np
import pytest
from surmounting import HOLDING, STEPS, climbing

from backend.machine.kinematics import end_point, link_poses
from backend.machine.sun_map import sun_angles
from backend.surmount.judge import course_of, judge
from backend.surmount.records import SEQUENCES
from backend.surmount.sequences import joints_of
from backend.surmount.statics import weights_of

NAMES = list(STEPS)
U = np.linspace(0.0, 1.0, 201)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("sequence", SEQUENCES)
def test_the_bucket_stays_where_it_is(name: str, sequence: str) -> None:
    climber, step = climbing(name)
    course = course_of(sequence, climber, step, HOLDING[name], U)
    joints = joints_of(climber, course)
    assert joints.reached.all()
    tip = end_point(climber.machine, joints.q, joints.T)
    assert np.abs(tip[:, [0, 2]] - course.held).max() < 1e-9
    assert np.abs(tip[:, 1]).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("sequence", SEQUENCES)
def test_the_angles_are_the_papers(name: str, sequence: str) -> None:
    """(12)-(15), with the bucket upright: theta_1 from the platform's plane, theta_2 and theta_3
    positive where they fold (Fig. 6); delta_1 and delta_2 belong to how joints are counted."""
    climber, step = climbing(name)
    machine = climber.machine
    course = course_of(sequence, climber, step, HOLDING[name], U)
    joints = joints_of(climber, course)
    _, L1, L2, l4 = machine.sun.lengths
    T = link_poses(machine, joints.q, joints.T)
    p1 = T[:, machine.joint_links[1], :3, 3][:, [0, 2]] * [course.way, 1.0]
    p2 = (course.held + np.array([0.0, l4])) * [
        course.way,
        1.0,
    ]  # the bucket's joint, over its edge
    L3 = np.linalg.norm(p2 - p1, axis=1)
    theta2 = np.arccos((L3**2 - L1**2 - L2**2) / (2.0 * L1 * L2))  # (12), delta_2 = 0
    psi = np.arctan2(p2[1] - p1[:, 1], p2[0] - p1[:, 0])  # (14), upwards positive
    corner = np.arcsin(np.clip(L2 * np.sin(np.pi - theta2) / L3, -1.0, 1.0))
    obtuse = L3**2 + L1**2 < L2**2
    corner = np.where(obtuse, np.pi - corner, corner)
    theta1 = corner + psi  # (13), delta_1 = 0, over the horizontal
    alpha = course.alpha * course.way
    found = sun_angles(machine, joints.q)
    assert np.abs(found[:, 0] - (theta1 - alpha)).max() < 1e-9
    assert np.abs(found[:, 1] + theta2).max() < 1e-9
    # (15): what is left to the upright bucket.
    theta3 = np.pi - (0.5 * np.pi - theta1) - theta2
    assert np.abs(found[:, 2] + theta3).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_slow_work_is_the_rise_of_the_centre_of_mass(name: str) -> None:
    """Virtual work: with upright forces only the joints do any, and it lifts everything."""
    climber, step = climbing(name)
    _, sequences = judge(climber, step, HOLDING[name], rows=801)
    for one in sequences:
        dq = np.diff(one.joints.q, axis=0)
        torques = 0.5 * (one.loads.torques[1:] + one.loads.torques[:-1])
        work = (torques * dq).sum(axis=1)
        lifted = climber.weight * np.diff(one.centre[:, 2])
        assert np.abs(work - lifted).max() < 2e-4 * np.abs(lifted).max() + 1e-9 * climber.weight


@pytest.mark.parametrize("name", NAMES)
def test_the_ground_bears_the_weight(name: str) -> None:
    climber, step = climbing(name)
    _, sequences = judge(climber, step, HOLDING[name])
    for one in sequences:
        assert one.loads.bucket + one.loads.crawler == pytest.approx(climber.weight)
        assert (one.loads.bucket > -1e-9 * climber.weight).all()
        assert (one.loads.crawler > 0.0).all()
        assert (one.margin > 0.0).all()


def test_gravity_torques_are_the_slope_of_the_potential() -> None:
    climber, step = climbing("ex13")
    course = course_of(SEQUENCES[0], climber, step, HOLDING["ex13"], U[::40])
    joints = joints_of(climber, course)
    found = weights_of(climber, joints.T, joints.q).gravity
    for k in range(4):
        nudge = np.zeros(4)
        nudge[k] = 1e-5
        above = weights_of(climber, joints.T, joints.q + nudge).centre[:, 2]
        below = weights_of(climber, joints.T, joints.q - nudge).centre[:, 2]
        slope = climber.weight * (above - below) / 2e-5
        assert found[:, k] == pytest.approx(slope, abs=1e-3 * climber.weight * 1e-3 + 1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_energies_are_in_their_order(name: str) -> None:
    climber, step = climbing(name)
    verdict, sequences = judge(climber, step, HOLDING[name])
    assert verdict.holds, verdict.why
    assert verdict.energy >= sum(one.potential for one in sequences) * (1.0 - 1e-6)
