"""People and objects that LiDARs see, as far as the scene shows them. Site frame [m]."""

from __future__ import annotations

import math
from dataclasses import dataclass

from backend.safety.swing_risk import Risk
from backend.spatial.types import Array
from backend.tracking.records import Status


@dataclass(frozen=True)
class SeenTrack:
    """position: (3,) middle of its box, site frame [m]; yaw [rad]; size: (3,) length, width, height
    [m]; ahead: (2,) in a second [m]; cov: (2, 2) of it [m^2]; risk: the worst for any machine;
    distance: to the nearest body of the machine that it is worst for [m], NaN when unknown.
    """

    id: int
    person: bool
    status: Status
    position: Array
    yaw: float
    size: Array
    ahead: Array
    cov: Array
    risk: Risk = Risk.SAFE
    distance: float = math.nan

    @property
    def code(self) -> str:
        """As operators read it: P7 is a person, O9 an object."""
        return f"{'P' if self.person else 'O'}{self.id}"


@dataclass(frozen=True)
class SeenLost:
    """A track that was given up. position: (3,) where it was last seen [m]; seen: how long ago."""

    id: int
    position: Array
    seen: float


@dataclass(frozen=True)
class SeenSensor:
    """A LiDAR. position: (3,) of its newest scan [m]; age: since then [s], NaN before the first."""

    position: Array
    age: float


@dataclass(frozen=True)
class SeenPeople:
    """reason: why people are not known, else empty; age: since the newest scan [s], NaN before."""

    tracks: tuple[SeenTrack, ...]
    lost: tuple[SeenLost, ...]
    sensors: tuple[SeenSensor, ...]
    age: float
    reason: str = ""
