"""A fused pose to bodies in the site frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.fusion.pose import FusedPose
from backend.machine import kinematics
from backend.machine.model import Machine
from backend.pipeline.records import Body3D
from backend.spatial import rotation, transform
from backend.spatial.angles import interpolate, wrap
from backend.spatial.types import Array


def base_transform(pose: FusedPose) -> Array:
    """T_site_root (4, 4)."""
    R = rotation.from_attitude(pose.yaw, pose.pitch, pose.roll)
    return transform.make(R, pose.position)


def place(machine: Machine, q: Array, T_site_root: Array) -> Body3D:
    """The machine at joint values q (n,) [rad] on a base T_site_root (4, 4)."""
    link_poses = kinematics.posture(machine, q, T_site_root)
    end_point = kinematics.end_point_of(machine, link_poses)
    swing_center = kinematics.swing_center(machine, T_site_root)
    return Body3D(
        link_poses=link_poses,
        boxes=kinematics.posture_boxes(machine, link_poses),
        end_point=end_point,
        swing_center=swing_center,
        azimuth=float(kinematics.azimuth(machine, q, T_site_root)),
        reach=float(np.hypot(*(end_point - swing_center)[:2])),
    )


def between(machine: Machine, before: FusedPose, after: FusedPose, at: float) -> Body3D:
    """The machine at a time between two of its poses, before.time <= at <= after.time [s]; outside
    it is where the nearer one has it.
    """
    span = after.time - before.time
    share = min(max((at - before.time) / span, 0.0), 1.0) if span > 0.0 else 0.0
    turned = np.where(
        [joint.continuous for joint in machine.joints],
        wrap(after.joints - before.joints),
        after.joints - before.joints,
    )
    pose = replace(
        before,
        position=before.position + share * (after.position - before.position),
        yaw=interpolate(before.yaw, after.yaw, share),
        pitch=interpolate(before.pitch, after.pitch, share),
        roll=interpolate(before.roll, after.roll, share),
    )
    return place(machine, before.joints + share * turned, base_transform(pose))
