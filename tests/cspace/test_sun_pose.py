"""From a machine's fused pose to Sun's angles, against the machine's own kinematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.cspace.sun import SunPose
from backend.cspace.sun_pose import sun_pose
from backend.fusion.pose import FusedPose, Validity
from backend.fusion.samples import Fix
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.site.site import load_site
from backend.spatial import rotation, transform
from backend.spatial.angles import difference
from backend.spatial.types import Array

angle = st.floats(-3.0, 3.0)
tilt = st.floats(-0.3, 0.3)


@pytest.fixture(scope="module")
def mini() -> Machine:
    return load_machine("mini")


def fused(position: Array, attitude: tuple[float, float, float], joints: Array) -> FusedPose:
    return FusedPose(
        machine="left",
        time=0.0,
        validity=Validity.VALID,
        reasons=(),
        position=position,
        yaw=attitude[0],
        pitch=attitude[1],
        roll=attitude[2],
        joints=joints,
        joint_velocities=np.zeros(len(joints)),
        base_velocity=np.zeros(3),
        sigma_position=0.02,
        sigma_yaw=0.005,
        sigma_joints=0.003,
        fix=Fix.RTK_FIXED,
        streams={},
        clock_offset=None,
    )


@given(angle, tilt, tilt, st.tuples(angle, angle, angle, angle))
def test_azimuth_and_reach_are_the_machines_own(
    mini: Machine, yaw: float, pitch: float, roll: float, q: tuple[float, ...]
) -> None:
    joints, position = np.array(q), np.array([3.0, -4.0, 0.5])
    R = rotation.from_attitude(yaw, pitch, roll)
    T_site_root = transform.make(R, position)
    pose = sun_pose(mini, fused(position, (yaw, pitch, roll), joints))
    azimuth = kinematics.azimuth(mini, joints, T_site_root)
    assert difference(pose.yaw, azimuth) == pytest.approx(0.0, abs=1e-9)
    assert pose.position == pytest.approx(kinematics.swing_center(mini, T_site_root)[:2])
    # Along the arm Sun's length is exact in a vertical plane; what tilt across the arm takes from
    # it is the arm's height times the plane's lean.
    tip = kinematics.end_point(mini, joints, T_site_root)[:2] - pose.position
    along = abs(tip @ [np.cos(pose.yaw), np.sin(pose.yaw)])
    lean = abs(np.tan(pose.pitch)) * (np.cos(pose.pitch) - R[2, 2])
    assert abs(pose.d - along) <= lean * mini.max_reach + 1e-9
    assert lean < 0.03


@given(angle, tilt, angle)
def test_pitch_turns_into_roll_and_back_with_the_swing(
    mini: Machine, yaw: float, pitch: float, swing: float
) -> None:
    joints = np.array([swing, 0.5, -1.0, 0.5])
    pose = sun_pose(mini, fused(np.zeros(3), (yaw, pitch, 0.0), joints))
    assert np.sin(pose.pitch) == pytest.approx(np.sin(pitch) * np.cos(swing), abs=1e-12)


def test_level_base_adds_swing_to_yaw_with_its_sign_and_offset(mini: Machine) -> None:
    pose = fused(np.zeros(3), (0.3, 0.0, 0.0), np.array([0.2, 0.5, -1.0, 0.4]))
    plain = sun_pose(mini, pose)
    assert plain.yaw == pytest.approx(0.5)
    assert plain.angles == pytest.approx([0.0, 0.5, -1.0, 0.4])
    sun = replace(
        mini.sun,
        signs=(-1.0, 1.0, -1.0),
        offsets=(0.1, -0.2, 0.3),
        azimuth_sign=-1.0,
        azimuth_offset=0.05,
    )
    mapped = sun_pose(replace(mini, sun=sun), pose)
    assert mapped.yaw == pytest.approx(0.3 - 0.2 + 0.05)
    assert mapped.angles == pytest.approx([0.0, -0.5 + 0.1, -1.0 - 0.2, -0.4 + 0.3])


def test_unusable_poses_are_refused(mini: Machine) -> None:
    with pytest.raises(ValueError, match="finite"):
        sun_pose(mini, fused(np.zeros(3), (0.0, 0.0, 0.0), np.full(4, np.nan)))


@pytest.mark.parametrize("site", ["simulation", "driving", "experiment"])
def test_shipped_sites_start_at_the_papers_postures(
    site: str, request: pytest.FixtureRequest, mini: Machine
) -> None:
    loaded = load_site(f"sun2020-{site}")
    expected: tuple[SunPose, SunPose] = request.getfixturevalue(site)
    for machine, want in zip(loaded.machines, expected, strict=True):
        assert machine.model == "mini"
        assert machine.sim.program == "hold"
        assert machine.start is not None
        position = loaded.frame.from_projected(np.array([machine.start.position]))[0]
        joints = np.array([machine.start.joints[r] for r in ("swing", "boom", "stick", "bucket")])
        pose = sun_pose(mini, fused(position, machine.start.attitude, joints))
        # The pitched base moves the swing joint, 0.65 m above the ground, by up to 14 mm.
        assert pose.position == pytest.approx(want.position, abs=0.014)
        assert difference(pose.yaw, want.yaw) == pytest.approx(0.0, abs=1e-9)
        assert pose.angles == pytest.approx(want.angles, abs=1e-9)
        assert pose.lengths == pytest.approx(want.lengths)
        inside = (joints >= mini.lower[:4]) & (joints <= mini.upper[:4])
        assert inside.all(), joints
