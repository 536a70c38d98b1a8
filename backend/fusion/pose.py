"""One machine's fused state at one common time."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from backend.fusion.samples import Fix
from backend.spatial.types import Array


class Validity(Enum):
    """VALID: usable. STALE: was valid, too old now. UNKNOWN: never complete, or not computable."""

    VALID = "VALID"
    STALE = "STALE"
    UNKNOWN = "UNKNOWN"


@dataclass(frozen=True)
class StreamStatus:
    """One stream's health. age [s], inf before the first sample; rate [Hz] over the last 2 s.

    age_source: "offset" (round-trip estimate, worst case of its bounds) or "arrival".
    """

    age: float
    rate: float
    age_source: str
    received: int
    rejected: int  # malformed, NaN, duplicate, out of order or late


@dataclass(frozen=True)
class FusedPose:
    """Site frame: east, north, up [m] about the site's origin; angles [rad].

    position: (3,) of the URDF root; yaw: of the root (tracks), CCW from grid east;
    joints, joint_velocities: (n,) in the order of Machine.joints [rad, rad/s];
    base_velocity: (3,) [m/s]; yaw_rate: of the tracks [rad/s]; sigmas are standard deviations:
    sigma_joints of the least certain joint, sigma_each: (n,) of each, None where all have that.
    When validity is not VALID the last known values stay, for drawing only.
    """

    machine: str
    time: float
    validity: Validity
    reasons: tuple[str, ...]
    position: Array
    yaw: float
    pitch: float
    roll: float
    joints: Array
    joint_velocities: Array
    base_velocity: Array
    sigma_position: float
    sigma_yaw: float
    sigma_joints: float
    fix: Fix
    streams: dict[str, StreamStatus]  # "joints", "position", "heading", "attitude"
    clock_offset: tuple[float, float] | None  # bounds of local minus remote [s]
    yaw_rate: float = 0.0
    sigma_each: Array | None = None

    @property
    def joint_sigmas(self) -> Array:
        """(n,) standard deviation of each joint [rad]."""
        if self.sigma_each is not None:
            return self.sigma_each
        return np.full(len(self.joints), self.sigma_joints)
