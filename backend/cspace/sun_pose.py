"""A machine's fused pose in the terms of Sun 2020."""

from __future__ import annotations

import numpy as np

from backend.cspace.sun import SunPose
from backend.fusion.pose import FusedPose
from backend.machine.model import Machine
from backend.spatial import rotation, transform


def sun_pose(machine: Machine, pose: FusedPose) -> SunPose:
    """Posture of `machine` as Sun 2020, Fig. 2 measures it, through the machine's `SunMap`.

    The arm's azimuth is yaw + azimuth_sign * swing + azimuth_offset on level ground; on a slope
    it is the azimuth of the tilted arm. Pitch is the base's attitude resolved in the arm's plane:
    it changes sign when the arm swings to the back. The position is that of the swing joint's
    origin. Left out, as in the paper: heights, so also the shift of a tilted boom pivot, and tilt
    across the arm. Raises ValueError when the pose holds values that are not finite.
    """
    swing, boom, stick, bucket = np.asarray(pose.joints, dtype=float)[:4]
    sun = machine.sun
    azimuth = sun.azimuth_sign * swing + sun.azimuth_offset
    R_site_root = rotation.from_attitude(pose.yaw, pose.pitch, pose.roll)
    T_site_swing = transform.make(R_site_root, pose.position) @ machine.arm.T_root_swing
    arm = T_site_swing[:3, :3] @ [np.cos(azimuth), np.sin(azimuth), 0.0]
    theta = np.array(sun.signs) * [boom, stick, bucket] + sun.offsets
    return SunPose(
        position=T_site_swing[:2, 3],
        yaw=float(np.arctan2(arm[1], arm[0])),
        pitch=float(np.arcsin(np.clip(arm[2], -1.0, 1.0))),
        boom=float(theta[0]),
        stick=float(theta[1]),
        bucket=float(theta[2]),
        lengths=np.array(sun.lengths),
    )
