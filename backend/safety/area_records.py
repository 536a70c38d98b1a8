"""Working areas as records, without what computes them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from backend.spatial.types import Array

FULL = 2.0 * math.pi


@dataclass(frozen=True)
class Area:
    """A disc and a sector about the swing centre, in the site's horizontal plane. body: radius of
    the disc, in which tracks and upper body are however they turn; reach: radius of the sector,
    beyond the disc the arm is nowhere else [m]; start, end: its azimuths, counter-clockwise from
    grid east, start <= end <= start + 2 pi [rad].
    """

    body: float
    reach: float
    start: float
    end: float

    @property
    def whole(self) -> bool:
        """Whether the sector is a full circle."""
        return self.end - self.start >= FULL


@dataclass(frozen=True)
class WorkingArea:
    """Of one machine. reason: why it is not known, else empty; center: (2,) the swing centre, site
    frame [m]; tail: radius in which the upper body swings [m]; predicted covers everything from now
    on to the end of the prediction; maximum: any posture, standing where it stands.
    """

    reason: str
    tail: float
    center: Array | None = None
    current: Area | None = None
    predicted: Area | None = None
    maximum: Area | None = None


class Within(IntEnum):
    """The narrowest area that something is in."""

    NONE = 0
    MAXIMUM = 1
    PREDICTED = 2
    CURRENT = 3
