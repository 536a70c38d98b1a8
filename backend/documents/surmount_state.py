"""/api/surmount, and the key `surmounts` of a snapshot: manoeuvres asked for and on offer."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field, model_validator

from backend.documents.plan_state import State
from backend.documents.state import NotNegative, Number, Positive, Table
from backend.documents.surmount_document import SurmountChecks, SurmountObstacle, SurmountParameters

Effort = Literal["quick", "thorough"]
MOST_HEIGHT = 5.0


class StepRequest(Table):
    """A step that is not on the site's list, straight ahead."""

    height: Number = Field(
        ge=-MOST_HEIGHT, le=MOST_HEIGHT, description="over the machine's ground; negative: down [m]"
    )
    distance: Positive = Field(le=100.0, description="from the middle of the tracks [m]")
    depth: Positive | None = Field(None, description="[m]; null without end")
    angle: Number = Field(
        0.0, ge=-0.8, le=0.8, description="of the machine to the way across the edge [rad]"
    )

    @model_validator(mode="after")
    def _is_a_step(self) -> StepRequest:
        if abs(self.height) < 0.01:
            raise ValueError("height is less than 0.01 m: that is no step")
        return self


class SurmountRequest(Table):
    """From where a machine is now, at rest, over a step ahead of it."""

    machine: str = Field(max_length=64, description="that this backend answers for")
    obstacle: str | None = Field(None, max_length=200, description="name of one of the site's")
    step: StepRequest | None = None
    payload: NotNegative = Field(0.0, description="in the bucket [kg]")
    effort: Effort = Field("quick", description="of the search for the least energy")

    @model_validator(mode="after")
    def _one_of_both(self) -> SurmountRequest:
        if (self.obstacle is None) == (self.step is None):
            raise ValueError("needs either obstacle or step")
        return self


class SurmountChoice(Table):
    """Another candidate than the one with the least energy."""

    candidate: int = Field(ge=0, description="index into the document's candidates")


class SurmountProgress(BaseModel):
    done: int
    of: int
    words: str


class SurmountOffer(BaseModel):
    """A machine's newest manoeuvre. All of it is at /api/surmount/MACHINE/PLAN."""

    plan: str = Field(description="its name, by which it is accepted")
    state: State = Field(
        description="planning; none: no way; offered; unknown: whether it still holds cannot be "
        "said; void: it holds no more; done: followed to its end"
    )
    why: str = Field(description="of none, unknown and void, in words, else empty")
    kind: str = Field(description="of none: reach, torque, stability, collision, simulation, ...")
    who: str = Field(description="asked for it")
    asked: SurmountRequest
    obstacle: SurmountObstacle
    candidate: int | None = Field(description="which one it is; null before there is one")
    parameters: SurmountParameters | None
    progress: SurmountProgress | None = Field(description="while planning")
    duration: float | None = Field(description="[s]; null while there is none")
    energy: float | None = Field(description="(19) [J]")
    checks: SurmountChecks | None
    notes: list[str] = Field(description="what was not judged, or changed")
    keep: float = Field(description="nearer than this to anything else it is void [m]")
    seconds: float | None = Field(description="that the search took [s]")
    age: float | None = Field(description="since it was held against the scene last [s]")
    made: bool = Field(description="its document can be fetched")


class SurmountStateDocument(BaseModel):
    """All machines' manoeuvres."""

    surmounts: dict[str, SurmountOffer] = Field(
        description="by machine; missing where none was asked for"
    )


class SideView(BaseModel):
    """The machine from the side, from moment to moment. Points are along the way across the edge,
    from where P_b was first, and up from the ground there [m].
    """

    time: list[float] = Field(description="[s]")
    parts: list[str]
    outlines: list[list[list[list[float]]]] = Field(
        description="by moment and part, a convex outline"
    )
    pivots: list[list[list[float]]] = Field(
        description="by moment: the pivots of boom, stick and bucket and the end point"
    )


class FollowedSurmount(BaseModel):
    """What the sensors saw while a manoeuvre was followed."""

    at: list[float] = Field(description="the path's time [s]")
    time: list[float] = Field(description="since the beginning [s]")
    joints: list[list[float]] = Field(description="[rad]")
    base: list[list[float]] = Field(description="along, up [m] and pitch [rad], as in SideView")
