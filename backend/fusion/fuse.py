"""Streams to one pose per machine at one common time, with covariance, age and validity."""

from __future__ import annotations

import math
from collections.abc import Iterable

from backend.fusion.motion import joints_at, root_at, tilt, yaw_at
from backend.fusion.pose import FusedPose
from backend.fusion.rig import Rig
from backend.fusion.samples import Fix
from backend.fusion.streams import Streams
from backend.fusion.validity import judge, statuses


def common_time(
    pairs: Iterable[tuple[Rig, Streams]], now: float, previous: float = -math.inf
) -> float:
    """The local time [s] at which all machines are fused in this cycle.

    The newest joint sample of any machine whose joints are alive, but at most the stated
    extrapolation (0.1 s) after the newest of the slowest one. Positions and headings, which change
    slowly, are carried on to it. Never before `previous` (the last cycle's) nor after `now`.
    """
    newest = []
    limit = math.inf
    for rig, streams in pairs:
        offset = streams.offset(now)
        buffers = [streams.joints] if streams.joints.entries else streams.attitudes.values()
        stamps = [buffer.entries[-1].stamp for buffer in buffers if buffer.entries]
        if offset is None or not stamps:
            continue
        at = max(stamps) + (offset[0] + offset[1]) / 2.0
        if now - at <= rig.config.joints_stale:
            newest.append(at)
            limit = min(limit, rig.config.max_extrapolation)
    if not newest:
        return now if previous == -math.inf else min(previous, now)
    return min(now, max(previous, min(max(newest), min(newest) + limit)))


def fuse(rig: Rig, streams: Streams, now: float, common: float) -> FusedPose:
    """The machine's pose at the local time `common`, judged at `now` [s].

    Everything is interpolated at `common`, or carried on from the newest sample with its velocity
    for at most 0.1 s and held after that, sigma growing with the gap. Antenna positions become
    positions of the root with the swing that belonged to each of them, so that a swinging antenna
    is no motion of the base. Sensors that were never seen read zero, and the pose is UNKNOWN.
    """
    offset = streams.offset(now)
    stamp = common - (offset[0] + offset[1]) / 2.0 if offset else common
    arm = joints_at(rig, streams, stamp)
    M = tilt(arm.pitch, arm.roll)
    course = yaw_at(rig, streams, stamp, M, arm)
    base = root_at(rig, streams, stamp, M, arm, course)
    fix = _fix(streams)
    status = statuses(rig, streams, now, offset, arm.from_imus)
    validity, reasons = judge(rig, streams, now, status, fix, base.sigma, arm.unknown)
    return FusedPose(
        machine=rig.name,
        time=common,
        validity=validity,
        reasons=reasons,
        position=base.position,
        yaw=course.yaw,
        pitch=arm.pitch,
        roll=arm.roll,
        joints=arm.q,
        joint_velocities=arm.rates,
        base_velocity=base.velocity,
        sigma_position=base.sigma,
        sigma_yaw=course.sigma,
        sigma_joints=arm.sigma if arm.sigma_each is None else float(arm.sigma_each.max()),
        fix=fix,
        streams=status,
        clock_offset=offset[:2] if offset and offset[2] == "offset" else None,
        yaw_rate=course.rate,
        sigma_each=arm.sigma_each,
    )


def _fix(streams: Streams) -> Fix:
    """The newest position's quality; NONE before the first, and after a newer "no fix"."""
    newest = streams.position.last
    if newest is None:
        return Fix.NONE
    entries = streams.position.entries
    since = entries[-1].stamp if entries else -math.inf
    return Fix.NONE if streams.no_fix > since else newest.fix
