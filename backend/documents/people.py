"""People and objects that LiDARs see, as a snapshot's document has them under the key `people`."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import BaseModel, Field

Point = tuple[float, float, float]
Plane = tuple[float, float]
LevelModel = Literal["SAFE", "WARNING", "EMERGENCY"]
KindModel = Literal["person", "object"]
LEAST_INDEX = -1000.0
"""The warning index of what is within the safety clearance of a swing that brakes for nothing:
minus infinity, which JSON has no number for, and null already says that nothing needs to brake."""

TTC = "time to collision with a swing [s]; null when it never comes"
INDEX = (
    "warning index x: braking distances left beyond the safety clearance; null when nothing needs "
    f"to brake, {LEAST_INDEX:g} for minus infinity"
)


class SensorModel(BaseModel):
    """A LiDAR of a machine."""

    machine: str
    name: str
    age: float | None = Field(description="since its newest scan [s]; null before the first")
    position: Point = Field(description="of its newest scan, site frame [m]")
    points: int = Field(ge=0, description="of its newest scan")


class AheadModel(BaseModel):
    """Where a track will be in a second."""

    position: Plane = Field(description="east, north in the site frame [m]")
    cov: tuple[Plane, Plane] = Field(description="covariance of it [m^2]")


class TrackModel(BaseModel):
    """Somebody or something that is followed."""

    id: int = Field(description="stays the same as long as it is followed")
    kind: KindModel
    status: Literal["confirmed", "coasting", "tentative"] = Field(
        description="coasting: confirmed, but not in the newest scan; tentative: perhaps nobody"
    )
    position: Point = Field(description="middle of its box now, site frame [m]")
    velocity: Plane = Field(description="east, north [m/s]")
    yaw: float = Field(description="of its box, counter-clockwise from grid east [rad]")
    size: Point = Field(description="length, width, height of its box [m]")
    sigma: float = Field(ge=0.0, description="standard deviation of the place, larger axis [m]")
    unseen: float = Field(ge=0.0, description="since it was last detected [s]")
    ahead: AheadModel


class LostModel(BaseModel):
    """A confirmed track that was given up near a machine: it may still be there."""

    id: int
    position: Point = Field(description="where it was last seen, site frame [m]")
    seen: float = Field(ge=0.0, description="how long ago it was last seen [s]")
    lost: float = Field(ge=0.0, description="how long ago it was given up [s]")


class RiskModel(BaseModel):
    """What one track means for one machine (Rasul 2021, Section 4)."""

    id: int = Field(description="of the track")
    machine: str
    body: str = Field(description="the nearest of the machine, machine:part/number; empty without")
    distance: float | None = Field(description="to that body in 3D [m]; null is unknown")
    ttc: float | None = Field(ge=0.0, description=f"now: {TTC}")
    index: float | None = Field(ge=LEAST_INDEX, description=f"now: {INDEX}")
    ttc_ahead: float | None = Field(ge=0.0, description=f"in a second: {TTC}")
    index_ahead: float | None = Field(ge=LEAST_INDEX, description=f"in a second: {INDEX}")
    level: LevelModel = Field(
        description="EMERGENCY stops the dangerous direction, WARNING slows and sounds"
    )


class PartnerRiskModel(BaseModel):
    """What the swing of one machine is to another machine."""

    machine: str
    other: str
    body: str = Field(description="that is soonest, machine:part/number; empty without")
    other_body: str = Field(description="whom it meets, machine:part/number; empty without")
    ttc: float | None = Field(ge=0.0, description=f"the least now: {TTC}")
    index: float | None = Field(ge=LEAST_INDEX, description=f"the least now: {INDEX}")
    ttc_ahead: float | None = Field(ge=0.0, description=f"the least in a second: {TTC}")
    index_ahead: float | None = Field(ge=LEAST_INDEX, description=f"the least in a second: {INDEX}")
    level: LevelModel


class BoundariesModel(BaseModel):
    """Where the levels begin on the TTC-x plane: an emergency's, then a warning's."""

    ttc: tuple[float, float] = Field(default=(1.0, 3.0), description="at most [s]")
    index: tuple[float, float] = Field(default=(1.0, 2.0), description="at most")


AreaName = Literal["none", "maximum", "predicted", "current"]


class InsideModel(BaseModel):
    """A track in a working area of a machine, whole box and three standard deviations."""

    id: int = Field(description="of the track")
    machine: str
    area: AreaName = Field(description="the narrowest working area that it is in now")
    area_ahead: AreaName = Field(description="that its place in a second, with 95 %, touches")


class PeopleModel(BaseModel):
    """People and objects that LiDARs see. A track near a machine never goes without a word."""

    reason: str = Field(description="why people are not known, else empty")
    age: float | None = Field(description="since the newest scan [s]; null before the first")
    sensors: list[SensorModel]
    tracks: list[TrackModel]
    lost: list[LostModel] = Field(description='"last seen here"')
    risks: list[RiskModel] = Field(description="by track and machine; empty while unknown")
    machines: list[PartnerRiskModel] = Field(
        default_factory=list, description="machines against machines; empty while unknown"
    )
    boundaries: BoundariesModel = Field(default_factory=BoundariesModel)
    inside: list[InsideModel] = Field(
        default_factory=list, description="who is in a working area; empty while unknown"
    )


def index_number(x: float) -> float:
    """A warning index as the document has it: infinity becomes null in JSON, so that what is minus
    infinity, and what is not a number and counts as that, must be a number.
    """
    return LEAST_INDEX if math.isnan(x) else max(x, LEAST_INDEX)


def ttc_number(seconds: float) -> float:
    """A time to collision as the document has it: what is not a number counts as now."""
    return 0.0 if math.isnan(seconds) else seconds
