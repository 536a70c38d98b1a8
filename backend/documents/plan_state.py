"""/api/plan, and the key `plans` of a snapshot: trajectories that are asked for and on offer."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field, model_validator

from backend.documents.plan_document import LimitsDocument, PlanChecks
from backend.documents.state import NotNegative, Number, Positive, Table, Vector

State = Literal["planning", "none", "offered", "unknown", "void", "done"]


class PlanGoal(Table):
    """Where the end point is to be, or the joints."""

    end_point: Vector | None = Field(None, description="in the site frame [m]")
    joints: dict[str, Number] | None = Field(
        None, description="by role, the others stay as they are [rad]"
    )
    attitude: Number | None = Field(
        None,
        description="elevation of the line from bucket pivot to tip above the plane of swing; "
        "default: the present one, or the nearest that can be [rad]",
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> PlanGoal:
        if (self.end_point is None) == (self.joints is None):
            raise ValueError("needs either end_point or joints")
        if self.joints is not None and (not self.joints or self.attitude is not None):
            raise ValueError("joints need at least one joint, and leave no attitude to choose")
        return self


class PlanRequest(Table):
    """From where a machine is now, at rest, to the goal, at rest."""

    machine: str = Field(max_length=64, description="that this backend answers for")
    goal: PlanGoal
    payload: NotNegative = Field(0.0, description="at the end point [kg]")
    clearance: Positive = Field(
        0.2, ge=0.05, le=4.0, description="to everything, beyond what the limiter keeps [m]"
    )
    lift: NotNegative = Field(
        0.0, le=20.0, description="above the higher of start and goal, when swinging [m]"
    )
    attitude_band: NotNegative = Field(
        0.0, le=3.15, description="how far the bucket's attitude may turn on the way [rad]"
    )
    ground: bool = Field(True, description="the plane under the tracks is an obstacle")
    limits: LimitsDocument = Field(default_factory=LimitsDocument)


class PlanOffer(BaseModel):
    """A machine's newest plan. The trajectory itself is at /api/plan/MACHINE/PLAN."""

    plan: str = Field(description="its name, by which it is accepted")
    state: State = Field(
        description="planning; none: no trajectory; offered; unknown: whether it still holds cannot"
        " be said; void: it holds no more; done: followed to its end"
    )
    why: str = Field(description="of none, unknown and void, in words, else empty")
    kind: str = Field(description="of none: start, goal, blocked, not found, tips, timing or check")
    blockers: list[str] = Field(description="what is in the way")
    proven: bool = Field(description="none: that no trajectory exists")
    who: str = Field(description="asked for it")
    asked: PlanRequest
    goal: list[float] = Field(description="end point asked for, site frame [m]")
    duration: float | None = Field(description="[s]; null while there is none")
    clearance: float | None = Field(description="that was asked for, with what the limiter keeps")
    keep: float | None = Field(description="nearer than this on its way it is void [m]")
    checks: PlanChecks | None
    notes: list[str] = Field(description="what was not judged, or changed")
    seconds: float | None = Field(description="that planning took [s]")
    age: float | None = Field(description="since it was held against the scene last [s]")


class PlanStateDocument(BaseModel):
    """All machines' plans."""

    plans: dict[str, PlanOffer] = Field(description="by machine; missing where none was asked for")
