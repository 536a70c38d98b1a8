"""What arrives from a machine, as time-stamped records.

stamp: the source's clock [s since its epoch]; arrival: the local clock [s]. Live, simulated and
recorded input are the same records.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from backend.spatial.types import Array


class Fix(Enum):
    """Quality of a GNSS position, best first."""

    RTK_FIXED = "RTK fixed"
    RTK_FLOAT = "RTK float"
    SBAS = "SBAS"
    SINGLE = "single"
    NONE = "no fix"


@dataclass(frozen=True)
class JointSample:
    """names: as published: URDF names or roles of joints, or names of cylinders (`Stroke.names`).

    position: (n,) [rad], of a cylinder what its sensor reads [m]; velocity: (n,) [rad/s, m/s] or
    empty.
    """

    machine: str
    stamp: float
    arrival: float
    names: tuple[str, ...]
    position: Array
    velocity: Array


@dataclass(frozen=True)
class FixSample:
    """Antenna position: latitude, longitude [deg], ellipsoidal height [m].

    covariance: (3, 3) east-north-up [m^2], zeros when unknown.
    """

    machine: str
    stamp: float
    arrival: float
    latitude: float
    longitude: float
    altitude: float
    covariance: Array
    fix: Fix


@dataclass(frozen=True)
class ProjectedSample:
    """Antenna position (3,) easting, northing, height in the site's projected CRS [m]."""

    machine: str
    stamp: float
    arrival: float
    position: Array
    covariance: Array  # (3, 3) [m^2]


@dataclass(frozen=True)
class HeadingSample:
    """Heading [rad], counter-clockwise from east (ENU orientation yaw), its variance [rad^2]."""

    machine: str
    stamp: float
    arrival: float
    heading: float
    variance: float


@dataclass(frozen=True)
class AttitudeSample:
    """An IMU on `link`: orientation (w, x, y, z) of the link in ENU; rate (3,) [rad/s] in it."""

    machine: str
    stamp: float
    arrival: float
    link: str
    orientation: Array
    rate: Array
    variance: float  # of roll and pitch [rad^2]


@dataclass(frozen=True)
class ClockSample:
    """One round trip: sent and received on the local clock, remote on the machine's clock [s]."""

    machine: str
    sent: float
    remote: float
    received: float


Sample: TypeAlias = (
    JointSample | FixSample | ProjectedSample | HeadingSample | AttitudeSample | ClockSample
)
