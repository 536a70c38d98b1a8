"""The documents of a recorded session: what it is, its time series, and its two judgements."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

Unknown = float | None
Source = Literal["recorded", "evaluated"]


class PartModel(BaseModel):
    name: str = Field(description="file name")
    begin: float = Field(description="since the session's beginning [s]")
    end: float = Field(description="since the session's beginning [s]")


class TopicModel(BaseModel):
    type: str = Field(description="message type, empty when the file does not say")
    count: int = Field(description="messages")


class EventModel(BaseModel):
    kind: str = Field(description="alarm, note, near miss, pin, action or gap")
    level: str | None = Field(description="of an alarm: SLOW, STOP or UNKNOWN")
    machine: str | None
    text: str
    start: float = Field(description="since the session's beginning [s]")
    end: float | None = Field(description="null for what has no length [s]")


class IndexModel(BaseModel):
    state: str = Field(description="building, ready or failed")
    progress: float = Field(description="0 to 1")


class SessionDocument(BaseModel):
    """A recorded session. Times are seconds since its beginning unless they say otherwise."""

    title: str
    begin: float = Field(description="since 1970 [s]")
    duration: float = Field(description="[s]")
    machines: list[str] = Field(description="of the site that it is seen on")
    origin: str = Field(description="live, demo, or what it was converted from")
    note: str = Field(description="what a viewer must know, else empty")
    parts: list[PartModel]
    topics: dict[str, TopicModel]
    problems: list[str] = Field(description="what could not be read or shown, in words")
    sources: list[Source] = Field(
        description="recorded: as it was concluded then; evaluated: judged by this program"
    )
    index: IndexModel
    events: list[EventModel] = Field(description="by start; complete once the index is ready")


class SeriesDocument(BaseModel):
    """Values over time, each list as long as `time`. Smallest clearances and worst levels of an
    interval survive when it is drawn with fewer points than there are.
    """

    time: list[float] = Field(description="since the session's beginning [s]")
    clearance: dict[str, list[Unknown]] = Field(
        description="by pair, a|b: distance of the closest bodies, or a lower bound of it where "
        "they are far apart; null is unknown [m]"
    )
    ages: dict[str, dict[str, list[Unknown]]] = Field(
        description="by machine and stream: the oldest in each interval [s]"
    )
    joints: dict[str, dict[str, list[Unknown]]] = Field(description="by machine and role [rad]")
    levels: dict[str, list[str | None]] = Field(
        description="by machine: CLEAR, SLOW, STOP or UNKNOWN; null where nothing was concluded"
    )


class PairDifference(BaseModel):
    max_abs: Unknown = Field(description="largest difference of the distances; null: none [m]")
    at: Unknown = Field(description="when [s]")
    rms: Unknown = Field(description="[m]")
    compared: int = Field(description="moments in which both are known")
    known_once: int = Field(description="moments in which only one of both is known")


class DistanceDifference(BaseModel):
    pairs: dict[str, PairDifference] = Field(description="by pair, a|b")


class LevelDifference(BaseModel):
    machine: str
    start: float = Field(description="[s]")
    end: float = Field(description="[s]")
    recorded: str
    evaluated: str


class LevelsModel(BaseModel):
    agree: float = Field(description="share of moments and machines with the same level, 0 to 1")
    differences: list[LevelDifference]


class FirstWarning(BaseModel):
    machine: str
    name: str = Field(description="the concern")
    level: str = Field(description="SLOW, STOP or UNKNOWN")
    recorded: Unknown = Field(description="first time at this level; null: never [s]")
    evaluated: Unknown = Field(description="first time at this level; null: never [s]")


class DiffResult(BaseModel):
    """As it was against as this program judges it, at the moments of the recorded snapshots."""

    compared: int = Field(description="moments")
    distance: DistanceDifference
    levels: LevelsModel
    first_warnings: list[FirstWarning]


class DiffDocument(BaseModel):
    state: Literal["none", "running", "done", "failed"]
    progress: float = Field(description="0 to 1")
    error: str = Field("", description="why it failed")
    result: DiffResult | None
