"""How firmly a machine stands, as a record; beside what computes it, to be read without it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from backend.spatial.types import Array
from backend.stability.polygon import Polygon


@dataclass(frozen=True)
class Stability:
    """reason: why nothing is known, else empty, and then the rest holds. payload: counted with
    [kg]; support: where it stands; zmp: (2,) root frame [m]; margin: to the nearest edge, negative
    outside [m]; sigma: of it, from the rates' and accelerations' noise [m]; share: of the way from
    the middle to an edge that is left, 1 in the middle, 0 on an edge; edge: that it would tip over,
    in words; critical_lift, critical_swing: of Yamashita's two masses, the lesser of both axes, on
    level ground [m/s^2, rad/s]; holds: by direction, from `capacity.holding_reach` [m], empty where
    that was not asked.
    """

    reason: str
    payload: float = math.nan
    support: Polygon | None = None
    zmp: Array = field(default_factory=lambda: np.full(2, np.nan))
    margin: float = math.nan
    sigma: float = math.nan
    share: float = math.nan
    edge: str = ""
    critical_lift: float = math.nan
    critical_swing: float = math.nan
    holds: Array = field(default_factory=lambda: np.zeros(0))
