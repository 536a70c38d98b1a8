"""Cant: how much one rail lies above the other.

Sign: positive when the left rail, seen along rising stations, is the higher one, as it is in a
curve to the right ("cw" in the file): the roll about the direction of travel, which the project
counts positive when the left side rises. So a curve to the left has a negative cant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.gauge.transitions import Law
from backend.spatial.types import Array

ROTATION_POINTS = ("", "center", "insideRail", "outsideRail", "leftRail", "rightRail")


@dataclass(frozen=True)
class Cant:
    """name; gauge: NaN when not stated [m]; rotation_point: the file's word for the rail that stays
    at the profile's height; s: (n,) rising distances from the alignment's start [m]; values: (n,)
    signed [m]; laws: how it grows behind each station, None for linearly."""

    name: str
    gauge: float
    rotation_point: str
    s: Array
    values: Array
    laws: tuple[Law | None, ...] = ()

    def at(self, s: Array) -> Array:
        """Cant (k,) [m] at s (k,): interpolated between stations, held before and behind them."""
        if len(self.s) == 0:
            return np.zeros(len(s))
        value = np.interp(s, self.s, self.values)
        for i, law in enumerate(self.laws[: len(self.s) - 1]):
            if law is None:
                continue
            inside = (s > self.s[i]) & (s < self.s[i + 1])
            u = (s[inside] - self.s[i]) / (self.s[i + 1] - self.s[i])
            rise = self.values[i + 1] - self.values[i]
            value[inside] = self.values[i] + rise * law.bend(u)
        return np.asarray(value)

    def lift(self, cant: Array, curvature: Array) -> Array:
        """(k,) how far cant (k,) [m] raises the middle between the rails above the profile [m].

        The inside rail is that on which side the track bends by curvature (k,); on a straight the
        lower one, as it is in the curve that a ramp leads to.
        """
        if self.rotation_point in ("leftRail", "rightRail"):
            return cant / 2 if self.rotation_point == "rightRail" else -cant / 2
        inside = np.where(curvature == 0.0, np.abs(cant), -np.sign(curvature) * cant) / 2
        sign = {"insideRail": 1.0, "outsideRail": -1.0}.get(self.rotation_point, 0.0)
        return np.asarray(np.nan_to_num(sign * inside))
