"""The driving part of a snapshot document, described field by field with units."""

from __future__ import annotations

from pydantic import BaseModel, Field

PAIR = "negative and positive direction"


class DrivenMachineModel(BaseModel):
    """Who is in control of one machine, as its own agent reports."""

    agent: bool = Field(description="whether its agent reports")
    mode: str | None = Field(description="remote, stopped, hold, program or rejoining")
    holder: str = Field(description="of the lease, empty for nobody")
    offered_to: str = Field(description="whom this cockpit's holder is handing it to")
    round_trip: float | None = Field(description="longest of the last 2 s, there and back [s]")
    level: str = Field(description="of the round trip: ok, slow, bad, locked or unknown")
    locked: str = Field(description="why nothing may move, in words, else empty")


class SticksModel(BaseModel):
    """Deflections in -1..1: x to the right, y forwards."""

    left_x: float
    left_y: float
    right_x: float
    right_y: float
    track_left: float
    track_right: float


class ConsoleModel(BaseModel):
    state: str = Field(description="Reserved, Idle, Enabled, Active, Pause, Override or Stop")
    why: str = Field(description="of a pause or stop, in words")
    since: float | None = Field(description="local monotonic clock [s]")
    held: bool = Field(description="whether this seat holds the machine's lease")
    refused: str = Field(description="what the last request was refused with, else empty")


class CauseModel(BaseModel):
    concern: str = Field(description="partner, end, neutral, link, ...; empty where free")
    reason: str


class MethodModel(BaseModel):
    """What shaped the sticks' wish before the limiter (Mäkinen 2021, Section 3.3)."""

    name: str = Field(description="braking (the limiter alone), scaling, potential or constrained")
    upper: float = Field(description="p_u, from where on a limit is felt [m]")
    lower: float = Field(description="p_l, what is kept from it [m]")
    scale: float = Field(description="smallest share that a deflected joint has left, 0..1")
    why: list[str] = Field(description="what held back, the closest first; or why it is left out")
    warnings: list[str] = Field(description="joints that cannot stop between p_u and p_l")


class DecisionModel(BaseModel):
    """What the limiter made of the sticks. Motions: joints by role, track_left, track_right."""

    locked: str = Field(description="why nothing moves at all, else empty")
    fraction: dict[str, list[float]] = Field(description=f"of full speed, {PAIR}, 0..1")
    causes: dict[str, list[CauseModel]] = Field(description=f"why less than full, {PAIR}")
    cut: dict[str, str] = Field(description="why the command is less than that")
    command: dict[str, float] = Field(description="sent [rad/s]; tracks [m/s]")
    method: MethodModel


class FollowModel(BaseModel):
    """A trajectory that is followed while the dead-man is held."""

    plan: str = Field(description="its name")
    at: float = Field(description="the path's own time [s]")
    duration: float = Field(description="of the path [s]")
    pace: float = Field(description="how fast the path's time runs, 0..1")
    error: dict[str, float] = Field(description="joints told minus seen, by role [rad]")
    ended: str = Field(description="why it is over, empty while it is not")
    arrived: bool


class SeatModel(BaseModel):
    """One page in front of which somebody sits."""

    who: str
    role: str = Field(description="viewer, operator or supervisor")
    driven: str = Field(description="the machine that the sticks belong to")
    pattern: str = Field(description="ISO or SAE")
    fine: bool
    method: str = Field(description="braking, scaling, potential or constrained")
    override: str = Field(description="reason of an override, while it may be held")
    source: str = Field(description="gamepad, keyboard, screen or empty")
    sticks: SticksModel
    consoles: dict[str, ConsoleModel] = Field(description="by machine")
    decision: dict[str, DecisionModel] = Field(description="by machine that is held")
    follow: dict[str, FollowModel] = Field(
        default_factory=dict, description="by machine that a trajectory is followed with"
    )
    follow_refused: dict[str, str] = Field(
        default_factory=dict, description="why a trajectory of that machine is not followed"
    )


class DrivingModel(BaseModel):
    machines: dict[str, DrivenMachineModel]
    seats: dict[str, SeatModel] = Field(description="by the name that a page is told")
