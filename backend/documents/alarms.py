"""What /api/alarms answers, and every line of a site's alarms.jsonl."""

from __future__ import annotations

import math
from typing import Any

from pydantic import BaseModel, Field

from backend.safety import words
from backend.safety.history import Episode


class EpisodeDocument(BaseModel):
    """One alarm from its beginning to its end. Times are seconds since 1970."""

    begin: float
    end: float | None = Field(description="null while it lasts")
    ended: str = Field(description="how it ended, in words; empty while it lasts")
    level: str = Field(description="the severest that it reached: SLOW, STOP or UNKNOWN")
    incursion: bool = Field(description="whether a zone to stay out of was entered")
    name: str = Field(description="of the concern: partner, age, ...")
    machine: str
    line: str = Field(description="as shown to operators when it was at its worst")
    reason: str
    own: str | None = Field(description="machine:part/k of this machine; null when unknown")
    other: str | None = Field(description="what it came close to")
    distance: float | None = Field(description="the smallest at that level [m]")
    time_to_contact: float | None = Field(description="then [s]; null when not approaching")
    points: list[list[float]] | None = Field(description="on own and on other, site frame [m]")
    at: float = Field(description="when it was at its worst")
    silenced_by: str = Field(description="who acknowledged it; empty for nobody")
    silenced_at: float | None


class AlarmsDocument(BaseModel):
    """What lasts, then what ended, the newest first."""

    alarms: list[EpisodeDocument]


def episode_document(episode: Episode, labels: dict[str, str], offset: float) -> dict[str, Any]:
    """offset: from the pipeline's clock to seconds since 1970 [s]."""
    worst, evidence = episode.worst, episode.worst.evidence
    known = evidence is not None and not math.isnan(evidence.distance)
    return {
        "begin": episode.begin + offset,
        "end": None if episode.end is None else episode.end + offset,
        "ended": episode.ended,
        "level": worst.level.name,
        "incursion": episode.incursion,
        "name": worst.name,
        "machine": worst.machine,
        "line": words.line(worst, labels),
        "reason": worst.reason,
        "own": evidence.own if evidence and known else None,
        "other": evidence.other if evidence and known else None,
        "distance": evidence.distance if evidence and known else None,
        "time_to_contact": evidence.time_to_contact
        if evidence and math.isfinite(evidence.time_to_contact)
        else None,
        "points": evidence.points.tolist()
        if evidence is not None and evidence.points is not None
        else None,
        "at": worst.time + offset,
        "silenced_by": episode.silenced_by,
        "silenced_at": None if episode.silenced_at is None else episode.silenced_at + offset,
    }
