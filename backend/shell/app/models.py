"""The API's answers, described field by field with units, for OpenAPI and JSON Schema."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.documents.people import PeopleModel
from backend.documents.plan_state import PlanOffer
from backend.documents.stability import StabilityModel
from backend.documents.surmount_state import SurmountOffer
from backend.documents.working_area import WorkingAreaModel
from backend.shell.app.driving_models import DrivingModel

Vector = list[float]
Unknown = float | None
"""A number, or null where the value does not exist or is unknown."""


class SigmaModel(BaseModel):
    position: Unknown = Field(description="standard deviation of each base coordinate [m]")
    yaw: Unknown = Field(description="standard deviation of the base yaw [rad]")
    joints: Unknown = Field(description="standard deviation of each joint value [rad]")


class MachineModel(BaseModel):
    """One machine's fused state. Site frame: east, north, up [m] about the site's origin."""

    label: str = Field(description="name shown to operators")
    model: str = Field(description="name of the machine's description")
    validity: str = Field(description="VALID, STALE (drawn, not to be trusted) or UNKNOWN")
    reasons: list[str] = Field(description="why it is not VALID, in words")
    position: list[Unknown] = Field(description="of the URDF root, site frame [m]")
    position_projected: list[Unknown] = Field(
        description="the same as easting, northing, height in the site's CRS [m]"
    )
    yaw: Unknown = Field(description="of the tracks, counter-clockwise from grid east [rad]")
    pitch: Unknown = Field(description="positive raises the front [rad]")
    roll: Unknown = Field(description="about the forward axis [rad]")
    joints: dict[str, Unknown] = Field(description="the URDF's own joint values by role [rad]")
    joint_velocities: dict[str, Unknown] = Field(description="by role [rad/s]")
    sigma: SigmaModel
    eta: Unknown = Field(description="inflation: factor, uncertainty and speed times age [m]")
    ages: dict[str, Unknown] = Field(description="worst-case age of each stream [s]")
    rates: dict[str, Unknown] = Field(description="rate of each stream over the last 2 s [Hz]")
    rejected: dict[str, int] = Field(description="samples of each stream refused since start")
    received: dict[str, int] = Field(description="samples of each stream since start")
    age_source: str = Field(description="offset (round-trip estimate) or arrival")
    fix: str = Field(description="quality of the GNSS position")
    max_reach: float = Field(description="swing axis to bucket tip, joint limits ignored [m]")
    working_area: WorkingAreaModel | None = Field(
        None, description="the ground it works over; null in recordings of before"
    )
    swing_center: Vector | None = Field(None, description="site frame [m]")
    end_point: Vector | None = Field(None, description="bucket tip, site frame [m]")
    azimuth: Unknown = Field(None, description="of the arm, from grid east [rad]")
    reach: Unknown = Field(None, description="horizontal, swing axis to bucket tip [m]")
    sun: dict[str, Unknown] | None = Field(
        None, description="boom, stick, bucket in the convention of Sun 2020, Fig. 2 [rad]"
    )
    outlines: dict[str, list[Vector]] | None = Field(
        None, description="plan-view polygon of each part, site frame [m]"
    )


class PairModel(BaseModel):
    """The closest bodies of two machines."""

    a: str
    b: str
    body_a: str = Field(description="part/number on machine a")
    body_b: str = Field(description="part/number on machine b")
    distance: Unknown = Field(description="as built, negative on overlap; null is unknown [m]")
    at_least: Unknown = Field(description="lower bound when too far to be measured [m]")
    points: list[Vector] | None = Field(description="closest points on a and b, site frame [m]")
    reason: str = Field(description="why the distance is unknown, else empty")
    approach: float = Field(description="closing speed [m/s]")
    checked: int = Field(description="pairs of bodies confirmed by the second solver")


class DirectionModel(BaseModel):
    negative: float = Field(description="allowed fraction of full speed, 0 to 1")
    positive: float = Field(description="allowed fraction of full speed, 0 to 1")
    words: list[str] = Field(description="the two directions in an operator's words")


class TravelModel(BaseModel):
    backward: float = Field(description="allowed fraction of full speed, 0 to 1")
    forward: float = Field(description="allowed fraction of full speed, 0 to 1")


class EvidenceModel(BaseModel):
    own: str = Field(description="machine:part/number")
    other: str = Field(description="machine:part/number, a site feature, person:P7 or object:O9")
    distance: Unknown = Field(description="[m]")
    points: list[Vector] | None = Field(description="on own and on other, site frame [m]")
    time_to_contact: Unknown = Field(description="[s]; null when not approaching")


class ConcernModel(BaseModel):
    """One safety concern's verdict on one machine."""

    name: str = Field(description="partner, gauge, self, people, tip-over, stale")
    machine: str
    level: str = Field(description="CLEAR, SLOW, STOP or UNKNOWN")
    reason: str
    time: float = Field(description="local monotonic clock [s]")
    allowed: dict[str, DirectionModel] = Field(description="by joint role")
    travel: TravelModel
    evidence: EvidenceModel | None


class AlarmModel(BaseModel):
    level: str = Field(description="SLOW, STOP or UNKNOWN")
    name: str = Field(description="the concern")
    machine: str
    line: str = Field(description="LEVEL · machine part ↔ cause · value")
    detail: str = Field(description="effect and free levers")
    since: float = Field(description="local monotonic clock [s]")
    active: bool = Field(description="past its on-delay")


class NoticeModel(BaseModel):
    """What an operator should know about the cockpit itself; not a safety level."""

    key: str = Field(description="what it is about, such as recording")
    line: str = Field(description="in words")
    since: float = Field(description="local monotonic clock [s]")


class FreedomModel(BaseModel):
    """One joint, one way. Bodies count as grown by eta."""

    free: float = Field(description="to first contact or the joint's limit [rad]")
    own: str | None = Field(description="own body that touches; null at a limit")
    hits: str | None = Field(description="machine:body or site:name; null at a limit")
    time_now: Unknown = Field(description="at the present rate; null when not moving that way [s]")
    time_full: float = Field(description="at full rate [s]")
    stop_now: float = Field(description="stopping distance from now, latency included [rad]")
    stop_full: float = Field(description="the same from full rate [rad]")
    can_stop: bool = Field(description="a stop from full rate ends before the contact")


class MotionModel(BaseModel):
    free: float = Field(description="until first contact or a limit as all joints move now [s]")
    own: str | None
    hits: str | None


class MarginsModel(BaseModel):
    """What a machine can do from here."""

    eta: Unknown = Field(description="growth of the bodies; null when unknown [m]")
    reason: str = Field(description="why it is not known, else empty")
    joints: dict[str, dict[str, FreedomModel]] = Field(
        description="by role: negative and positive; empty when unknown"
    )
    motion: MotionModel | None = Field(description="null at rest, or unknown")


class ImageStampModel(BaseModel):
    state_time: float = Field(description="time of the state it shows, local monotonic clock [s]")
    ready_time: float = Field(description="when it was finished [s]")
    seconds: float = Field(description="time to compute [s]")


class HealthCountersModel(BaseModel):
    malformed: dict[str, int] = Field(description="messages that could not be decoded, by key")
    foreign: dict[str, int] = Field(description="messages of machines not of this site, by key")
    lost: int = Field(description="messages dropped because the queue was full")


class GaugeStampModel(BaseModel):
    choice: str = Field(description="changes with what operators draw and switch")
    own_tracks: dict[str, list[str]] = Field(
        description="by own machine the tracks it stands on, which do not hold for it"
    )


class SurmountingModel(BaseModel):
    """What a manoeuvre that is followed counts on. Site frame [m], angles [rad]."""

    plan: str
    time: float = Field(description="when it was told, local monotonic clock [s]")
    obstacles: list[str] = Field(description="of the site, that are climbed")
    phase: str
    touching: list[str] = Field(description="parts of the machine that touch them by plan")
    position: list[float] = Field(description="of the base, where it should be seen")
    attitude: list[float] = Field(description="its yaw, pitch and roll there")
    tolerance: list[float] = Field(description="of both")
    support: list[list[float]] = Field(description="points that bear the machine")
    margin: float = Field(description="of the centre of mass to the edge of these, by plan")
    clearance: float = Field(description="of all other parts to what is climbed, the least by plan")


class SnapshotModel(BaseModel):
    """One cycle's conclusions."""

    time: float = Field(description="of the cycle, local monotonic clock [s]")
    state_time: Unknown = Field(description="common time of all fused poses, same clock [s]")
    cycle: int
    mode: str = Field(description="LIVE, DEMO or PLAYBACK")
    machines: dict[str, MachineModel]
    pairs: list[PairModel]
    margins: dict[str, MarginsModel] = Field(description="by own machine")
    concerns: list[ConcernModel]
    alarms: list[AlarmModel] = Field(description="the severest first")
    notices: list[NoticeModel] = Field(
        default_factory=list, description="beside the alarms, about the cockpit itself"
    )
    gauge: GaugeStampModel | None = Field(
        None, description="what holds of the working gauge, see /api/gauge"
    )
    people: PeopleModel | None = Field(None, description="null where the site has no LiDAR")
    stability: dict[str, StabilityModel] = Field(
        default_factory=dict, description="by machine; empty where tipping over is not judged"
    )
    surmounting: dict[str, SurmountingModel] = Field(
        default_factory=dict, description="by machine, while it is climbing by plan"
    )
    images: dict[str, ImageStampModel] = Field(description="newest image by kind and pair")
    health: HealthCountersModel
    backend: BackendModel | None = Field(None, description="of the process that answers")
    resolution: dict[str, ResolutionModel] = Field(
        default_factory=dict, description="Sun 2020, Section 5.1, live"
    )
    recording: RecordingStateModel | None = Field(None, description="of this backend")
    driving: DrivingModel | None = Field(None, description="not in playback")
    plans: dict[str, PlanOffer] = Field(
        default_factory=dict, description="by own machine its newest trajectory; not in playback"
    )
    surmounts: dict[str, SurmountOffer] = Field(
        default_factory=dict, description="by own machine its newest manoeuvre; not in playback"
    )
    demo: DemoModel | None = Field(None, description="only in the demo")
    playback: PlaybackModel | None = Field(None, description="only in playback")


class RecordingStateModel(BaseModel):
    state: str = Field(description="on, off or trouble")
    text: str = Field(description="since when it is on, why it is off, or what is wrong")


class PlaybackModel(BaseModel):
    """Where the cursor of a recorded session is. Times are seconds since its beginning."""

    time: float = Field(description="of the cursor [s]")
    duration: float = Field(description="of the session [s]")
    wall: float = Field(description="of the cursor, since 1970 [s]")
    playing: bool
    speed: float = Field(description="times real time")
    source: str = Field(description="recorded: as it was; evaluated: as judged by this program")
    sources: list[str] = Field(description="that the session has")
    loop: list[float] | None = Field(description="begin and end of what is repeated [s]")
    catching_up: bool = Field(description="slower than asked for, to let nothing out")
    title: str
    note: str = Field(description="what a viewer must know, else empty")


class ResolutionModel(BaseModel):
    """How densely one machine's motion is sampled at the present cycle time and speeds."""

    points_per_m: Unknown = Field(description="along the path of travel; null at standstill [1/m]")
    points_per_rad: dict[str, Unknown] = Field(description="per joint; null at standstill [1/rad]")


class TimingModel(BaseModel):
    p50: float = Field(description="[ms]")
    p95: float = Field(description="[ms]")
    p99: float = Field(description="[ms]")
    rate: float = Field(description="achieved rate [Hz]")


class WhatIfRequest(BaseModel):
    """A posture to be judged. A joint that is not named stays where it is."""

    model_config = ConfigDict(extra="forbid")

    machine: str = Field(description="a machine that this backend answers for")
    joints: dict[str, Annotated[float, Field(ge=-100.0, le=100.0, allow_inf_nan=False)]] = Field(
        description="the URDF's own joint values by role [rad]"
    )


class TouchModel(BaseModel):
    own: str = Field(description="body of the machine, part/number")
    other: str = Field(description="machine:part/number or site:name")
    layer: str = Field(description="partner, site or self")


class WhatIfModel(BaseModel):
    """python-fcl's verdict on a posture, bodies as built."""

    machine: str
    joints: dict[str, float] = Field(description="as judged, by role [rad]")
    state_time: Unknown = Field(description="of the surroundings, local monotonic clock [s]")
    verdict: str = Field(description="FREE, COLLIDING or UNKNOWN")
    reason: str = Field(description="why it is UNKNOWN, else empty")
    distance: Unknown = Field(description="to what is closest, 0 on contact [m]")
    closest: TouchModel | None
    hits: list[TouchModel]
    checked_by: str = Field(description="python-fcl")


class BackendModel(BaseModel):
    step: TimingModel = Field(description="the fast loop: fusion, distances, concerns")
    images: TimingModel = Field(description="the image loop: Sun's sets and the exact images")
    zones: TimingModel = Field(description="the loop of driving zones and free regions")
    around: TimingModel | None = Field(
        default=None, description="the loop of driving zones of people and the site"
    )
    along: TimingModel | None = Field(
        default=None, description="the loop of strips along tracks, on a site with tracks"
    )
    failure: str = Field(description="empty while all loops run")


class DemoModel(BaseModel):
    elapsed: Unknown = Field(description="since the demo's script began [s]")


class HealthModel(BaseModel):
    """Is the backend well?"""

    ok: bool = Field(description="both loops run and every machine is VALID")
    status: list[str] = Field(description="what is wrong, in words")
    mode: str
    cycle: int
    snapshot_age: Unknown = Field(description="[s]")
    machines: dict[str, str] = Field(description="validity by machine")
    backend: BackendModel
    counters: HealthCountersModel


class JointModel(BaseModel):
    role: str = Field(description="swing, boom, stick, bucket, tilt or rotate")
    name: str = Field(description="the URDF's")
    lower: Unknown = Field(description="null when continuous [rad]")
    upper: Unknown = Field(description="null when continuous [rad]")
    continuous: bool
    max_velocity: float = Field(description="[rad/s]")
    max_acceleration: float = Field(description="[rad/s^2]")


class SunMapModel(BaseModel):
    signs: list[float] = Field(description="of boom, stick, bucket")
    offsets: list[float] = Field(description="of boom, stick, bucket [rad]")


class TracksModel(BaseModel):
    length: float = Field(description="[m]")
    gauge: float = Field(description="centre to centre [m]")
    shoe: float = Field(description="width [m]")


class CameraModel(BaseModel):
    """A camera; its pictures come over the websocket /api/camera/{machine}/{index}."""

    kind: Literal["mjpeg", "whep", "link"]
    label: str
    url: str | None = Field(description="WHEP only: where the page opens its WebRTC stream")


class MachineDescriptionModel(BaseModel):
    """What does not change about a machine."""

    label: str
    model: str
    title: str
    joints: list[JointModel]
    max_reach: float = Field(description="[m]")
    lengths: list[float] = Field(description="l1 to l4 of Sun 2020 [m]")
    sun: SunMapModel
    tracks: TracksModel
    bodies: int = Field(description="number of oriented boxes")
    masses_trusted: bool
    assumptions: list[str] = Field(description="what the description left open, as assumed")
    cameras: list[CameraModel] = Field(description="empty in playback: pictures are not recorded")


class FrameModel(BaseModel):
    epsg: int = Field(description="the site's projected CRS")
    origin: Vector = Field(description="easting, northing, height of the site frame [m]")


class SafetyModel(BaseModel):
    slow_below: float = Field(description="p_u of Mäkinen 2021 [m]")
    stop_below: float = Field(description="p_l of Mäkinen 2021 [m]")
    eta: float = Field(description="configured inflation [m]")


class SunParametersModel(BaseModel):
    m: int
    n: int
    eta: float = Field(description="[m]")


class ObstacleModel(BaseModel):
    name: str
    center: Vector = Field(description="site frame [m]")
    rotation: list[Vector] = Field(description="columns are the box axes")
    half_extents: Vector = Field(description="[m]")


class SiteModel(BaseModel):
    """The site of this run."""

    name: str
    title: str
    mode: str
    frame: FrameModel
    own: list[str] = Field(description="machines that this backend answers for")
    safety: SafetyModel
    sun: SunParametersModel
    machines: dict[str, MachineDescriptionModel]
    obstacles: list[ObstacleModel]


SnapshotModel.model_rebuild()
