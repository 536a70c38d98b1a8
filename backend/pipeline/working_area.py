"""Working areas of fused machines, and who is in them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from backend.fusion.motion import JOINT_WINDOW
from backend.fusion.pose import FusedPose, Validity
from backend.machine.model import Machine
from backend.pipeline.people import boxes_of, largest
from backend.pipeline.people_records import Inside, People
from backend.pipeline.records import Body3D, MachineState
from backend.safety.area_records import Within, WorkingArea
from backend.safety.working_area import Stand, unknown, within, working_area

AHEAD = 1.0
"""How far ahead areas are predicted, counted from the cycle [s]."""
SIGMAS = 3.0
CONFIDENT = 2.45
"""Standard deviations of a foretold place: the ellipse that holds it with 95 %."""


def area_of(machine: Machine, pose: FusedPose, body: Body3D | None, now: float) -> WorkingArea:
    """Of one machine; unknown unless its pose is valid.

    Sensors do not tell how exact joint rates are. At worst they are those of a line through two
    values at both ends of the fusion's window: sigma_rate = sqrt(2) sigma_joints / JOINT_WINDOW.
    """
    if pose.validity is not Validity.VALID or body is None:
        return unknown(machine, pose.reasons[0] if pose.reasons else "is unknown")
    axis = body.link_poses[0, 2, :3] @ machine.arm.T_root_swing[:3, 2]
    off = body.swing_center - pose.position
    speed = math.hypot(*pose.base_velocity[:2].tolist())
    sigmas = pose.sigma_joints + pose.sigma_yaw + pose.sigma_position
    moving = speed + pose.yaw_rate + body.azimuth + float(axis)
    if not math.isfinite(sigmas + moving + float((pose.joints + pose.joint_velocities).sum())):
        return unknown(machine, "motion is unknown")
    stand = Stand(
        q=pose.joints,
        rates=pose.joint_velocities,
        sigma_q=pose.sigma_joints,
        sigma_rate=math.sqrt(2.0) * pose.sigma_joints / JOINT_WINDOW,
        center=body.swing_center[:2],
        azimuth=body.azimuth,
        tilt=math.acos(min(max(float(axis), -1.0), 1.0)),
        yaw_rate=pose.yaw_rate,
        sigma_yaw=pose.sigma_yaw,
        speed=speed + abs(pose.yaw_rate) * math.hypot(*off[:2].tolist()),
        sigma_position=pose.sigma_position,
    )
    return working_area(machine, stand, AHEAD + max(now - pose.time, 0.0))


def inside(people: People, machines: Mapping[str, MachineState]) -> tuple[Inside, ...]:
    """Who is in a working area of a machine now, or will be in a second; nobody while unknown."""
    tracked = people.tracked
    if people.reason or not len(tracked):
        return ()
    half = np.hypot(*boxes_of(tracked).half_extents[:, :2].T)
    places = np.concatenate([tracked.position[:, :2], tracked.ahead])
    radius = np.concatenate(
        [
            half + SIGMAS * np.minimum(tracked.sigma, 1.0),
            half + CONFIDENT * np.minimum(largest(tracked.ahead_cov), 1.0),
        ]
    )
    found: list[Inside] = []
    for name, state in machines.items():
        if state.area is None or state.area.reason:
            continue
        kinds = within(state.area, places, radius).reshape(2, -1).T.tolist()
        found += [
            Inside(int(tracked.id[k]), name, Within(now), Within(ahead))
            for k, (now, ahead) in enumerate(kinds)
            if now or ahead
        ]
    return tuple(found)
