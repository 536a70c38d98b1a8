"""A trajectory's task, as `cockpit plan` reads it, and what it prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, Field, ValidationError, model_validator

from backend.documents.plan_series import PlanFigures
from backend.documents.state import (
    NotNegative,
    Number,
    Positive,
    StateDocument,
    Table,
    Vector,
)
from backend.errors import InputError
from backend.site.messages import sentence


class GoalDocument(Table):
    """Where the end point is to be: theta, r and z, or end_point."""

    theta: Number | None = Field(None, description="azimuth, from grid east [rad]")
    r: Positive | None = Field(None, description="horizontal, from the swing centre [m]")
    z: Number | None = Field(None, description="height in the state's frame [m]")
    end_point: Vector | None = Field(None, description="in the state's frame [m]")
    attitude: Number | None = Field(
        None,
        description="elevation of the line from bucket pivot to tip above the plane of swing; "
        "default: the present one, or the nearest that can be [rad]",
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> GoalDocument:
        given = [v is not None for v in (self.theta, self.r, self.z)]
        if self.end_point is None and not all(given):
            raise ValueError("needs theta, r and z, or end_point")
        if self.end_point is not None and any(given):
            raise ValueError("has both end_point and theta, r or z; one of them is allowed")
        return self


class CylindricalLimits(Table):
    """Of the end point about the swing axis."""

    theta_velocity: Positive | None = Field(None, description="[rad/s]")
    r_velocity: Positive | None = Field(None, description="[m/s]")
    z_velocity: Positive | None = Field(None, description="[m/s]")
    theta_acceleration: Positive | None = Field(None, description="[rad/s^2]")
    r_acceleration: Positive | None = Field(None, description="[m/s^2]")
    z_acceleration: Positive | None = Field(None, description="[m/s^2]")


class LimitsDocument(Table):
    """Lower than the machine's own, which always hold."""

    joint_velocities: dict[str, Positive] = Field(
        default_factory=dict, description="by role [rad/s]"
    )
    joint_accelerations: dict[str, Positive] = Field(
        default_factory=dict, description="by role [rad/s^2]"
    )
    cylindrical: CylindricalLimits = Field(default_factory=CylindricalLimits)


class PlanTaskDocument(Table):
    """From the state, at rest, to the goal, at rest."""

    state: StateDocument
    machine: str = Field(min_length=1, description="which machine of the state moves")
    goal: GoalDocument
    payload: NotNegative = Field(0.0, description="at the end point [kg]")
    clearance: Positive = Field(0.2, ge=0.01, le=5.0, description="to everything [m]")
    lift: NotNegative = Field(
        0.0, le=20.0, description="above the higher of start and goal, when swinging [m]"
    )
    attitude_band: NotNegative = Field(
        0.0, le=3.15, description="how far the bucket's attitude may turn on the way [rad]"
    )
    stability_share: NotNegative = Field(
        0.1, le=0.95, description="of the way from the tracks' middle to an edge that is kept free"
    )
    ground: bool = Field(True, description="the plane under the tracks is an obstacle")
    limits: LimitsDocument = Field(default_factory=LimitsDocument)
    method: Literal["toppra", "casadi", "penalty"] = Field(
        "toppra",
        description="of the timing; penalty: way and timing by Yamashita 2025, (23)-(26), to be "
        "compared with: it needs all of limits.cylindrical",
    )


class PlanChecks(BaseModel):
    """Judged apart from what planned."""

    min_clearance: float | None = Field(
        description="to obstacles, the ground aside; null where none is in reach [m]"
    )
    min_own_clearance: float | None = Field(description="of the machine's own bodies [m]")
    min_ground_clearance: float | None = Field(
        description="of what moves to the ground; null where that is no obstacle [m]"
    )
    min_stability_margin: float | None = Field(
        description="zero-moment point to the tracks' edge; null where masses are unknown [m]"
    )
    worst_rate: float = Field(description="of a joint, as a share of its limit")
    worst_acceleration: float = Field(description="of a joint, as a share of its limit")
    samples: int = Field(description="postures that were judged")


class PlanDocument(BaseModel):
    """A trajectory, or why there is none."""

    ok: bool
    machine: str
    method: str = Field(description="of the timing, or penalty")
    why: str | None = Field(None, description="there is no trajectory, in words")
    kind: Literal["start", "goal", "blocked", "not found", "tips", "timing", "check"] | None = (
        Field(None, description="of the refusal")
    )
    blockers: list[str] = Field(default_factory=list, description="what is in the way")
    proven: bool | None = Field(None, description="that no trajectory exists")
    violations: list[str] = Field(
        default_factory=list,
        description="of a trajectory that is not ok and only there to be compared with, in words",
    )
    duration: float | None = Field(None, description="[s]")
    time: list[float] = Field(default_factory=list, description="[s]")
    roles: list[str] = Field(default_factory=list, description="of the columns of joints")
    joints: list[list[float]] = Field(default_factory=list, description="the URDF's own [rad]")
    joint_velocities: list[list[float]] = Field(default_factory=list, description="[rad/s]")
    joint_accelerations: list[list[float]] = Field(default_factory=list, description="[rad/s^2]")
    end_point: list[list[float]] = Field(
        default_factory=list, description="in the frame of the state's positions [m]"
    )
    clearance: float | None = Field(
        None, description="asked for, and what the state's sigma adds [m]"
    )
    checks: PlanChecks | None = None
    figures: PlanFigures | None = Field(None, description="swing and lift with their limits")
    way: str | None = Field(None, description="how it was found")
    notes: list[str] = Field(default_factory=list, description="what was not judged, or changed")


def parse_plan_task(data: Any, where: str) -> PlanTaskDocument:
    """A validated task; raises InputError naming `where`."""
    if not isinstance(data, dict):
        raise InputError(f"{where}: is not a JSON object; allowed is a task document.")
    try:
        return PlanTaskDocument.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {sentence(error, PlanTaskDocument)}") from error
