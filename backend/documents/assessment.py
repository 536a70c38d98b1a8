"""What `cockpit assess` prints, described for those who script against it."""

from __future__ import annotations

from pydantic import BaseModel, Field

from backend.documents.driving import DrivingZoneDocument
from backend.documents.stability import AssessedStability

Point = tuple[float, float, float]
Plane = tuple[float, float]
Matrix = tuple[Point, Point, Point]


class BodyDocument(BaseModel):
    """One oriented box, as built, in the frame of the state's positions."""

    name: str = Field(description="part/number")
    link: str = Field(description="tracks, upper, boom, stick, bucket, tilt or rotate")
    center: Point = Field(description="[m]")
    rotation: Matrix = Field(description="columns are the box axes")
    half_extents: Point = Field(description="[m]")


class AssessedMachine(BaseModel):
    model: str
    bodies: list[BodyDocument]
    end_point: Point = Field(description="bucket tip [m]")
    swing_center: Point = Field(description="origin of the swing joint [m]")
    azimuth: float = Field(description="of the arm, counter-clockwise from grid east [rad]")
    reach: float = Field(description="horizontal, swing axis to bucket tip [m]")
    max_reach: float = Field(description="joint limits ignored, as in Sun 2020 [m]")
    self_pairs: list[tuple[str, str]] = Field(description="bodies that count as self-collision")
    assumptions: list[str] = Field(description="what the description left open, as assumed")


class ClosestDocument(BaseModel):
    a: str = Field(description="machine:part/number")
    b: str = Field(description="machine:part/number or obstacle:name")
    distance: float = Field(description="as built; on overlap only the negative sign counts [m]")
    points: tuple[Point, Point] = Field(description="closest points on a and on b [m]")


class SunCurrent(BaseModel):
    """The machine that avoids, in the terms of Sun 2020."""

    theta: float = Field(description="arm azimuth from grid east, 0 to 2 pi [rad]")
    d: float = Field(description="Eq. (3), projected length [m]")
    boom: float = Field(description="[rad]")
    stick: float = Field(description="[rad]")
    bucket: float = Field(description="[rad]")
    collides: bool = Field(description="in the obstacle image of S^2")
    in_zone: bool = Field(description="swing centre inside the warning zone")
    zone_distance: float = Field(description="to the warning zone's edge, positive outside [m]")
    in_joint_set: bool = Field(description="near a sample of CO_theta^3; a projection, no contact")


class SunDocument(BaseModel):
    """Sun 2020, Eqs. (1)-(28): obstacles that the partner is to the machine that avoids it."""

    eta: float = Field(description="[m]")
    m: int
    n: int
    warning_zone: list[Plane] = Field(description="outline of CO_xy, Eq. (10) [m]")
    theta: list[float] = Field(description="CO_theta, Eq. (12), of the centre line [rad]")
    d: list[float] = Field(description="CO_d, Eq. (13), from the swing centre [m]")
    beta: list[float] = Field(description="Eq. (22) [rad]")
    boom: list[list[float | None]] = Field(description="Eq. (24) [rad]; null: no solution")
    stick: list[list[float | None]] = Field(description="Eq. (25), elbow up [rad]")
    bucket: list[list[float | None]] = Field(description="Eq. (26) [rad]")
    current: SunCurrent


class CertifiedMargin(BaseModel):
    """The same with bodies grown by eta: 3 sigma of the document."""

    eta: float = Field(description="[m]")
    negative: float = Field(description="[rad]")
    positive: float = Field(description="[rad]")
    negative_hits: str | None
    positive_hits: str | None


class MarginDocument(BaseModel):
    """One joint, bodies as built."""

    negative: float = Field(description="how far it can move before first contact or limit [rad]")
    positive: float = Field(description="[rad]")
    negative_hits: str | None = Field(description="machine:body or site:name; null at a limit")
    positive_hits: str | None
    certified: CertifiedMargin


class AssessmentDocument(BaseModel):
    """One judged state document; in keys "left<-right" is "left must avoid right"."""

    time: float = Field(description="[s]")
    frame: str = Field(description="of all coordinates: projected or site")
    machines: dict[str, AssessedMachine]
    closest: list[ClosestDocument] = Field(description="one entry per pair of machines, or body")
    obstacles: list[ClosestDocument] = Field(description="one entry per obstacle and machine")
    sun: dict[str, SunDocument]
    margins: dict[str, dict[str, MarginDocument]] = Field(description="by machine and joint role")
    stability: dict[str, AssessedStability] = Field(description="by machine")
    driving_zone: dict[str, DrivingZoneDocument]
