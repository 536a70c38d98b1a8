from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from fusion_world import Motion, World, feed, pose_at
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backend.fusion.imu import pitch_roll
from backend.fusion.motion import tilt
from backend.fusion.pose import Validity
from backend.fusion.rig import Rig
from backend.spatial.rotation import from_attitude

ARM = ("base", "upper_link", "boom_link", "stick_link", "bucket_link")
angle = st.floats(-0.4, 0.4)


@given(yaw=st.floats(-3.0, 3.0), pitch=angle, roll=st.floats(-math.pi, math.pi))
@settings(max_examples=50, deadline=None)
def test_pitch_and_roll_from_the_vertical(yaw: float, pitch: float, roll: float) -> None:
    R = from_attitude(yaw, pitch, roll)
    found = pitch_roll(R[2])
    assert found[0] == pytest.approx(pitch, abs=1e-12)
    assert math.remainder(found[1] - roll, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(tilt(pitch, roll), from_attitude(0.0, pitch, roll), atol=1e-15)


@pytest.mark.parametrize("name", ["base", "upper_link"])
def test_tilt_from_an_imu_below_or_above_the_swing(rig: Rig, name: str) -> None:
    motion = Motion(pitch=0.12, roll=-0.08, rates=(0.4, 0.1, 0.0, 0.0))
    world = World(rig, motion=motion, imus=(name,))
    pose = pose_at(rig, feed(rig, world.samples(0.0, 2.0)), 2.05)
    assert pose.validity is Validity.VALID
    assert (pose.pitch, pose.roll) == pytest.approx((0.12, -0.08), abs=1e-5)
    np.testing.assert_allclose(pose.position, motion.position, atol=1e-4)


@given(pitch=angle, roll=angle, swing=st.floats(-3.0, 3.0), boom=st.floats(-0.8, 1.3))
@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_joint_angles_from_the_links_imus(
    rig: Rig, pitch: float, roll: float, swing: float, boom: float
) -> None:
    motion = Motion(
        pitch=pitch, roll=roll, joints=(swing, boom, -1.2, -0.9), rates=(0.3, 0.1, -0.2, 0.3)
    )
    world = World(rig, motion=motion, imus=ARM, joints=False)
    pose = pose_at(rig, feed(rig, world.samples(0.0, 0.5)), 0.55)
    assert pose.validity is Validity.VALID, pose.reasons
    wrapped = np.remainder(pose.joints - motion.q(pose.time) + math.pi, 2 * math.pi) - math.pi
    np.testing.assert_allclose(wrapped, 0.0, atol=2e-4)
    np.testing.assert_allclose(pose.joint_velocities, motion.rates, atol=1e-3)
    np.testing.assert_allclose((pose.pitch, pose.roll), (pitch, roll), atol=1e-6)


def test_a_joint_without_sensor_is_named(rig: Rig) -> None:
    world = World(rig, imus=("base", "upper_link", "boom_link"), joints=False)
    pose = pose_at(rig, feed(rig, world.samples(0.0, 0.5)), 0.55)
    assert pose.validity is Validity.UNKNOWN
    assert "has sent no joint angles yet" in pose.reasons


def test_swing_alone_from_a_sensor_and_the_arm_from_imus(rig: Rig) -> None:
    world = World(rig, imus=("base", "boom_link", "stick_link", "bucket_link"))
    samples = [
        s
        if getattr(s, "names", None) is None
        else type(s)("left", s.stamp, s.arrival, ("swing",), s.position[:1], s.velocity)
        for s in world.samples(0.0, 0.5)
    ]
    pose = pose_at(rig, feed(rig, samples), 0.55)
    assert pose.validity is Validity.VALID, pose.reasons
    np.testing.assert_allclose(pose.joints, world.motion.joints, atol=1e-6)
    without = [s for s in samples if getattr(s, "link", "") != "stick_link"]
    pose = pose_at(rig, feed(rig, without), 0.55)
    assert pose.validity is Validity.UNKNOWN
    assert pose.reasons[0] == "stick angle is not published"


def test_an_imu_mounted_upside_down_passes_the_wrap(varied: Callable[..., Rig]) -> None:
    """The bucket's IMU crosses +-180 deg of pitch; its joint angle and rate stay smooth."""
    rig = varied()
    motion = Motion(joints=(0.0, -0.8, -2.4, -0.2), rates=(0.0, -0.02, 0.0, 0.4))
    world = World(rig, motion=motion, imus=ARM, joints=False)
    streams = feed(rig, world.samples(0.0, 0.3))
    for sample in world.samples(0.3, 1.2):
        streams = feed(rig, [sample], streams)
        now = getattr(sample, "arrival", 0.0)
        pose = pose_at(rig, streams, now) if now else None
        if pose is not None and pose.validity is Validity.VALID:
            error = pose.joints - motion.q(pose.time)
            assert np.abs(error).max() < 1e-3


def test_a_lost_imu_makes_the_pose_stale_not_level(rig: Rig) -> None:
    world = World(rig, motion=Motion(pitch=0.1), imus=("base",))
    samples = world.samples(0.0, 2.0)
    kept = [s for s in samples if not (getattr(s, "link", "") == "base" and s.stamp > 1.0)]
    pose = pose_at(rig, feed(rig, kept), 2.05)
    assert pose.validity is Validity.STALE
    assert pose.reasons == ("attitude is 1.1 s old",)
    assert pose.pitch == pytest.approx(0.1, abs=1e-6)


def test_an_arm_imu_that_nothing_needs_may_go_silent(rig: Rig) -> None:
    world = World(rig, motion=Motion(pitch=0.1), imus=("base", "boom_link"))
    samples = world.samples(0.0, 2.0)
    kept = [s for s in samples if not (getattr(s, "link", "") == "boom_link" and s.stamp > 1.0)]
    assert pose_at(rig, feed(rig, kept), 2.05).validity is Validity.VALID


def test_of_two_imus_on_a_part_the_newer_counts(rig: Rig) -> None:
    old = World(rig, motion=Motion(pitch=0.2), imus=("base_link",)).samples(0.0, 0.2)
    new = World(rig, motion=Motion(pitch=0.1), imus=("base",)).samples(0.2, 1.0)
    assert pose_at(rig, feed(rig, old + new), 1.05).pitch == pytest.approx(0.1, abs=1e-6)
