"""Working areas as a snapshot's document has them, by machine, under the key `working_area`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel, Field

from backend.safety.area_records import Area, WorkingArea


class AreaModel(BaseModel):
    """A disc and a sector about the swing centre, in the site's horizontal plane."""

    body: float = Field(
        ge=0.0,
        description="radius of the disc, where tracks and upper body are, however turned [m]",
    )
    reach: float = Field(
        ge=0.0, description="radius of the sector, where the arm is with its whole bodies [m]"
    )
    start: float = Field(
        description="azimuth where the sector begins, counter-clockwise from grid east [rad]"
    )
    end: float = Field(description="azimuth where it ends, start to start + 2 pi [rad]")


class WorkingAreaModel(BaseModel):
    """The ground that a machine works over (Rasul 2021, Section 3.5)."""

    reason: str = Field(description="why it is not known, else empty")
    tail: float = Field(ge=0.0, description="radius in which the upper body swings [m]")
    center: tuple[float, float] | None = Field(
        description="of all areas, the swing centre: east, north in the site frame [m]"
    )
    current: AreaModel | None = Field(description="now; null while not known")
    predicted: AreaModel | None = Field(
        description="from now to 1 s ahead, at the present joint rates, 3 sigma either way"
    )
    maximum: AreaModel | None = Field(description="in any posture, standing where it stands")


def working_area_document(area: WorkingArea | None) -> dict[str, Any] | None:
    """None where nobody worked it out."""
    if area is None:
        return None
    return {
        "reason": area.reason,
        "tail": area.tail,
        "center": None if area.center is None else area.center.tolist(),
        "current": _area(area.current),
        "predicted": _area(area.predicted),
        "maximum": _area(area.maximum),
    }


def read_working_area(document: Mapping[str, Any] | None) -> WorkingArea | None:
    """The same back. Raises KeyError, TypeError or ValueError for what is missing or wrong."""
    if document is None:
        return None
    center = document["center"]
    areas = [
        None
        if one is None
        else Area(*(float(one[key]) for key in ("body", "reach", "start", "end")))
        for one in (document[kind] for kind in ("current", "predicted", "maximum"))
    ]
    return WorkingArea(
        str(document["reason"]),
        float(document["tail"]),
        None if center is None else np.array([float(v) for v in center]),
        *areas,
    )


def _area(area: Area | None) -> dict[str, float] | None:
    if area is None or not math.isfinite(area.reach):
        return None
    return {"body": area.body, "reach": area.reach, "start": area.start, "end": area.end}
