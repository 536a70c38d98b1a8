"""What detection makes of the newest scan of all LiDARs, counted, as JSON."""

from __future__ import annotations

import math
from typing import Any

from pydantic import BaseModel, Field

from backend.perception.stages import NAMES, StagedScan


class StageCountsModel(BaseModel):
    """Points by the stage at which each ended."""

    outside: int = Field(ge=0, description="of the region of interest around its sensor")
    machine: int = Field(ge=0, description="of a machine's own body")
    ground: int = Field(ge=0, description="on the ground, or below")
    object: int = Field(ge=0, description="in the box of an object")
    left: int = Field(ge=0, description="too high, or too few, small or large for an object")


class StagesDocument(BaseModel):
    """The newest scan while somebody looks at it; made at most twice a second."""

    reason: str = Field(description="why there is none, or none that is new enough; else empty")
    age: float | None = Field(description="of the newest scan [s]; null before the first")
    points: int | None = Field(description="of all LiDARs together; null as long as `reason` says")
    drawn: int | None = Field(description="of them, those that are sent to be drawn")
    counts: StageCountsModel | None
    objects: int | None = Field(description="boxes, before they are followed")
    slope: float | None = Field(description="of the ground against level [rad]; null: none found")


def stages_document(stages: StagedScan | None, age: float, reason: str) -> dict[str, Any]:
    """age: NaN before the first [s]; reason: why there are none."""
    if stages is None:
        empty = dict.fromkeys(("points", "drawn", "counts", "objects", "slope"))
        return {"reason": reason, "age": age, **empty}
    plane = stages.plane
    return {
        "reason": reason,
        "age": age,
        "points": sum(stages.counts),
        "drawn": len(stages.points),
        "counts": dict(zip(NAMES, stages.counts, strict=True)),
        "objects": len(stages.objects.yaw),
        "slope": None if plane is None else math.acos(min(1.0, float(plane.normal[2]))),
    }
