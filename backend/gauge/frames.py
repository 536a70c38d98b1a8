"""The frame of a track at a station: where its cross-section stands, with cant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from backend.gauge.centreline import Centreline
from backend.spatial.types import Array

Pivot: TypeAlias = Literal["as_told", "low_rail", "centre"]
"""What cant turns a cross-section about: the lower rail's top (the upper rail is lifted by all of
the cant), the midpoint between the rails (by half of it), or what the centreline tells by its
stations' `lift` (k,) [m], how far cant raises the midpoint; the lower rail where it has none."""


@dataclass(frozen=True)
class TrackFrames:
    """k frames: origin (k, 3) [m], unit vectors along the track, to its left and up from the plane
    of the rails (k, 3), curvature (k,) [1/m].
    """

    origin: Array
    tangent: Array
    lateral: Array
    up: Array
    curvature: Array

    def place(self, yz: Array) -> Array:
        """(k, m, 3) of points (k, m, 2) of the cross-sections."""
        return np.asarray(
            self.origin[:, None]
            + yz[..., :1] * self.lateral[:, None]
            + yz[..., 1:] * self.up[:, None]
        )


def track_frames(line: Centreline, s: Array, pivot: Pivot | None, spacing: float) -> TrackFrames:
    """Frames at the stations s (k,) [m].

    pivot: None leaves the cross-sections upright whatever the cant; spacing: between the middles of
    the rail heads [m], so that the cross-section tilts by asin(cant / spacing).
    """
    at = line.at(s)
    level = 1.0 / np.sqrt(1.0 + at.gradient**2)
    east, north = np.cos(at.heading), np.sin(at.heading)
    tangent = np.stack([east * level, north * level, at.gradient * level], axis=1)
    left = np.stack([-north, east, np.zeros_like(east)], axis=1)
    up = np.cross(tangent, left)
    if pivot is None:
        return TrackFrames(at.xyz, tangent, left, up, at.curvature)
    sine = np.clip(at.cant / spacing, -1.0, 1.0)[:, None]
    cosine = np.sqrt(1.0 - sine**2)
    tilted = cosine * left + sine * up
    # The left rail is the higher one for positive cant: the right one stays.
    y = -np.sign(sine) * spacing / 2.0
    lift = getattr(at, "lift", None)
    if pivot == "as_told" and lift is not None:
        y = -np.divide(lift[:, None], sine, out=np.zeros_like(sine), where=np.abs(sine) > 1e-9)
    if pivot == "centre":
        y = np.zeros_like(sine)
    origin = at.xyz + y * (left - tilted)
    return TrackFrames(origin, tangent, tilted, cosine * up - sine * left, at.curvature)
