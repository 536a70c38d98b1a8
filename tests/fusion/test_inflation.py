from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fusion_world import Motion, World, feed, pose_at
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backend.fusion.inflation import OLDEST, eta, levers
from backend.fusion.pose import FusedPose
from backend.fusion.rig import Rig
from backend.machine.kinematics import end_point


@pytest.fixture
def pose(rig: Rig) -> FusedPose:
    motion = Motion(rates=(0.3, 0.2, -0.1, 0.4), velocity=(0.3, 0.4, 0.0))
    return pose_at(rig, feed(rig, World(rig, motion=motion).samples(0.0, 1.0)), 1.05)


def aged(pose: FusedPose, age: float) -> FusedPose:
    streams = {name: replace(status, age=age) for name, status in pose.streams.items()}
    return replace(pose, streams=streams)


def test_by_hand(rig: Rig, pose: FusedPose) -> None:
    pose = aged(
        replace(
            pose,
            sigma_position=0.02,
            sigma_yaw=0.005,
            sigma_joints=0.003,
            base_velocity=np.array([0.3, 0.4, 0.0]),
            joint_velocities=np.array([0.3, 0.2, -0.1, 0.4]),
        ),
        0.1,
    )
    # Reaches of l = 1, 1.72, 0.951, 0.7 m
    arm = [4.371, 3.371, 1.651, 0.7]
    sigma = math.sqrt(0.02**2 + (4.371 * 0.005) ** 2 + sum((a * 0.003) ** 2 for a in arm))
    speed = 0.5 + 4.371 * 0.3 + 3.371 * 0.2 + 1.651 * 0.1 + 0.7 * 0.4
    assert eta(rig.machine, pose, 0.1) == pytest.approx(0.1 + 3 * sigma + 0.1 * speed, abs=1e-3)


@given(ages=st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 2.0)))
@settings(
    max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_older_is_never_smaller(rig: Rig, pose: FusedPose, ages: tuple[float, float]) -> None:
    young, old = sorted(ages)
    assert eta(rig.machine, aged(pose, young), 0.1) <= eta(rig.machine, aged(pose, old), 0.1)


def test_it_grows_before_the_pose_is_stale(rig: Rig, pose: FusedPose) -> None:
    assert eta(rig.machine, aged(pose, 0.19), 0.1) > eta(rig.machine, aged(pose, 0.06), 0.1) + 0.1


def test_it_stays_finite_for_drawing(rig: Rig, pose: FusedPose) -> None:
    never = eta(rig.machine, aged(pose, math.inf), 0.1)
    assert never == eta(rig.machine, aged(pose, OLDEST), 0.1)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=50, deadline=None)
def test_levers_bound_the_tip_speed_in_every_posture(rig: Rig, seed: int) -> None:
    generator = np.random.default_rng(seed)
    low = np.maximum(rig.machine.lower, -math.pi)
    high = np.minimum(rig.machine.upper, math.pi)
    q, rates = generator.uniform(low, high), generator.uniform(-1.0, 1.0, len(low))
    h = 1e-6
    moved = end_point(rig.machine, q + h * rates) - end_point(rig.machine, q - h * rates)
    speed = float(np.linalg.norm(moved)) / (2 * h)
    assert speed <= float(levers(rig.machine) @ np.abs(rates)) + 1e-6
