"""What a tracker is given, keeps and tells.

The state of a track has 11 numbers (Rasul 2021, Section 3.4, in corrected Cartesian form):
px py vx vy pz vz [m, m/s], yaw of its box [rad], turn rate of its velocity [rad/s], length, width,
height [m]; all in the site frame, so that the machine's own motion is no motion of the track.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array, IntArray

PX, PY, VX, VY, PZ, VZ, YAW, TURN, LENGTH, WIDTH, HEIGHT = range(11)
STATE = 11
MEASURED = (PX, PY, PZ, YAW, LENGTH, WIDTH, HEIGHT)
"""What a detection may say, in the order of its columns."""


class Status(IntEnum):
    """TENTATIVE: not seen often enough to be sure of. CONFIRMED. COASTING: confirmed, but not seen
    in the newest scan: predicted, with growing covariance.
    """

    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2


@dataclass(frozen=True)
class Detections:
    """Boxes of one scan. time [s]; values: (k, d) of the columns `measured`, indices into the
    state, px and py first [m, rad]; noise: (d,) standard deviations [m, rad].
    """

    time: float
    values: Array
    measured: tuple[int, ...] = MEASURED
    noise: Array = field(default_factory=lambda: np.array([0.08, 0.08, 0.1, 0.5, 0.2, 0.2, 0.2]))

    def __post_init__(self) -> None:
        if self.measured[:2] != (PX, PY) or not set(self.measured) <= set(MEASURED):
            raise InputError(
                "detections: x and y come first; allowed beside them are z, yaw, length, width, "
                f"height, each once, not the state's numbers {self.measured}."
            )
        d = len(self.measured)
        if self.values.ndim != 2 or self.values.shape[1] != d or len(self.noise) != d:
            raise InputError(
                f"detections: {d} columns are measured, but the values have the shape "
                f"{self.values.shape} and there are {len(self.noise)} standard deviations."
            )
        if not (np.isfinite(self.values).all() and math.isfinite(self.time)):
            raise InputError("detections: every value and the time must be a finite number.")
        if not (np.isfinite(self.noise).all() and (self.noise > 0.0).all()):
            raise InputError("detections: every standard deviation must be above zero.")


@dataclass(frozen=True)
class Settings:
    """detected: probability that somebody in sight is detected; clutter: false detections per scan
    and square metre; gate: probability that the true detection lies within it; confirm: of the
    first `confirm_of` scans in which a track must be seen; coast: how long a confirmed track is
    kept unseen [s]; coast_tentative: the same for a tentative one [s]; born_speed: standard
    deviation of the speed of what is seen for the first time [m/s]; spread: largest standard
    deviation of a place that still says anything [m].
    """

    detected: float = 0.95
    clutter: float = 1e-3
    gate: float = 0.9999
    confirm: int = 3
    confirm_of: int = 5
    coast: float = 3.0
    coast_tentative: float = 0.25
    born_speed: float = 1.5
    spread: float = 3.0

    def __post_init__(self) -> None:
        for name in ("detected", "gate"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise InputError(f"tracking: {name} must be between 0 and 1, exclusively.")
        if self.clutter <= 0.0:
            raise InputError("tracking: clutter must be above zero.")
        if not 1 <= self.confirm <= self.confirm_of:
            raise InputError("tracking: 1 <= confirm <= confirm_of is needed.")


@dataclass(frozen=True)
class Tracks:
    """n tracks by r motion models. mean: (n, r, 11); cov: (n, r, 11, 11); mode: (n, r)
    probabilities of the models; id: (n,); status: (n,) see `Status`; scans: (n,) since the first
    sight; seen: (n,) of them in which it was detected; last_seen: (n,) [s].
    """

    time: float
    mean: Array
    cov: Array
    mode: Array
    id: IntArray
    status: IntArray
    scans: IntArray
    seen: IntArray
    last_seen: Array

    def __len__(self) -> int:
        return len(self.id)


@dataclass(frozen=True)
class Lost:
    """A confirmed track that was given up: who, where and when it was last seen. place: (3,)."""

    id: int
    place: Array
    last_seen: float
    ended: float
