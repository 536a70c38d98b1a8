"""A made-up machine's sensors: what they would send, from a known motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from backend.fusion.fuse import common_time, fuse
from backend.fusion.pose import FusedPose
from backend.fusion.rig import Rig
from backend.fusion.samples import (
    AttitudeSample,
    ClockSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    Sample,
)
from backend.fusion.streams import Streams, ingest
from backend.machine.kinematics import link_poses
from backend.spatial import transform
from backend.spatial.rotation import from_attitude, rz, to_quaternion
from backend.spatial.types import Array


@dataclass(frozen=True)
class Motion:
    """Constant rates: position, attitude and joints at the local time t are linear in t."""

    position: tuple[float, float, float] = (5.0, 2.0, 0.4)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 1.0
    yaw_rate: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    joints: tuple[float, ...] = (0.3, 0.5, -1.2, 0.3)
    rates: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)

    def q(self, t: float) -> Array:
        return np.array(self.joints) + t * np.array(self.rates)

    def T(self, t: float) -> Array:
        R = from_attitude(self.yaw + t * self.yaw_rate, self.pitch, self.roll)
        return transform.make(R, np.array(self.position) + t * np.array(self.velocity))


@dataclass(frozen=True)
class World:
    """Sensors of one machine. skew: local minus remote clock [s]; latency: stamp to arrival [s]."""

    rig: Rig
    motion: Motion = field(default_factory=Motion)
    skew: float = 0.0
    latency: float = 0.06
    with_velocity: bool = False
    imus: tuple[str, ...] = ()
    clock: bool = True
    joints: bool = True
    fix: Fix = Fix.RTK_FIXED
    covariance: float = 0.0004
    convergence: float = 0.0  # added when the receiver counts from true north [rad]

    def _times(self, t: float) -> tuple[str, float, float]:
        return self.rig.name, t - self.skew, t + self.latency

    def joint(self, t: float) -> JointSample:
        velocity = np.array(self.motion.rates) if self.with_velocity else np.zeros(0)
        names = tuple(joint.name for joint in self.rig.machine.joints)
        return JointSample(*self._times(t), names, self.motion.q(t), velocity)

    def links(self, t: float) -> Array:
        return link_poses(self.rig.machine, self.motion.q(t), self.motion.T(t))

    def gnss(self, t: float) -> FixSample:
        antenna = self.rig.machine.antenna
        point = transform.apply(self.links(t)[antenna.link], antenna.position[None])[0]
        latitude, longitude, height = self.rig.frame.to_geodetic(point)
        return FixSample(
            *self._times(t), latitude, longitude, height, np.eye(3) * self.covariance, self.fix
        )

    def heading(self, t: float) -> HeadingSample:
        machine = self.rig.machine
        R = self.motion.T(t)[:3, :3]
        axis = np.array([math.cos(machine.heading_offset), math.sin(machine.heading_offset), 0.0])
        if machine.heading_of == "upper":
            axis = rz(self.motion.q(t)[0]) @ axis
        ahead = R @ axis
        return HeadingSample(
            *self._times(t), math.atan2(ahead[1], ahead[0]) + self.convergence, 1e-6
        )

    def imu(self, t: float, name: str) -> AttitudeSample:
        names = [link.name for link in self.rig.machine.links]
        index = 0 if name == "base" else names.index(name)
        before, after = self.links(t - 1e-4)[index, :3, :3], self.links(t + 1e-4)[index, :3, :3]
        skew = before.T @ after / 4e-4
        rate = np.array([skew[2, 1] - skew[1, 2], skew[0, 2] - skew[2, 0], skew[1, 0] - skew[0, 1]])
        R = self.links(t)[index, :3, :3]
        return AttitudeSample(*self._times(t), name, to_quaternion(R), rate, 1e-6)

    def round_trip(self, t: float) -> ClockSample:
        return ClockSample(self.rig.name, t, t + 0.001 - self.skew, t + 0.002)

    def samples(self, start: float, stop: float) -> list[Sample]:
        """Joints at 100 Hz, IMUs at 50 Hz, GNSS and heading at 20 Hz, round trips at 2 Hz."""
        found: list[tuple[float, Sample]] = []
        for k in range(math.ceil(start * 100), math.ceil(stop * 100)):
            t = k / 100
            if self.joints:
                found.append((t + self.latency, self.joint(t)))
            if k % 2 == 0:
                found += [(t + self.latency, self.imu(t, name)) for name in self.imus]
            if k % 5 == 0:
                found.append((t + self.latency, self.gnss(t)))
                found.append((t + self.latency, self.heading(t)))
            if self.clock and k % 50 == 0:
                found.append((t + 0.002, self.round_trip(t)))
        return [sample for _, sample in sorted(found, key=lambda pair: pair[0])]


def arrival(sample: Sample) -> float:
    return sample.received if isinstance(sample, ClockSample) else sample.arrival


def feed(rig: Rig, samples: list[Sample], streams: Streams | None = None) -> Streams:
    streams = streams or Streams()
    for sample in samples:
        streams = ingest(rig, streams, sample)
    return streams


def pose_at(rig: Rig, streams: Streams, now: float) -> FusedPose:
    return fuse(rig, streams, now, common_time([(rig, streams)], now))
