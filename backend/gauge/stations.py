"""Stations: what the distance along an alignment is called.

The internal station is `start` plus the distance from the alignment's start. From an equation's
internal station on, the station is counted anew from its `ahead`. Inframodel uses equations for
kilometre posts and lets the count run on (ahead = internal); there an address is the post's name
and the distance behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array


@dataclass(frozen=True)
class Equation:
    """internal: where it holds; back and ahead: the station just before and behind it, NaN when not
    stated [m]; name: of the kilometre post, or empty."""

    internal: float
    back: float
    ahead: float
    name: str = ""


@dataclass(frozen=True)
class Stations:
    """start: internal station of the alignment's start [m]; equations in order of `internal`."""

    start: float = 0.0
    equations: tuple[Equation, ...] = ()

    def station(self, s: Array) -> Array:
        """Stations (k,) [m] of distances s (k,) [m]."""
        internal = np.asarray(s, dtype=float) + self.start
        result = internal.copy()
        for equation in self.equations:
            if math.isfinite(equation.ahead):
                behind = internal >= equation.internal
                result[behind] = equation.ahead + internal[behind] - equation.internal
        return result

    def distances(self, station: float, length: float) -> tuple[float, ...]:
        """Every distance s in [0, length] [m] whose station is `station` [m], rising; several where
        the count was set back, none where it was set forward."""
        known = [e for e in self.equations if math.isfinite(e.ahead)]
        begins = [-math.inf, *(e.internal for e in known)]
        ends = [*(e.internal for e in known), math.inf]
        shifts = [0.0, *(e.internal - e.ahead for e in known)]
        found = []
        for begin, end, shift in zip(begins, ends, shifts, strict=True):
            internal = station + shift
            if begin <= internal < end and 0.0 <= internal - self.start <= length:
                found.append(internal - self.start)
        return tuple(found)

    def address(self, s: float) -> tuple[str, float]:
        """Kilometre post and distance behind it [m] of the distance s [m]; without a post before
        it, an empty name and the station."""
        internal = s + self.start
        before = [e for e in self.equations if e.name and e.internal <= internal]
        if not before:
            return "", float(self.station(np.array([s]))[0])
        return before[-1].name, internal - before[-1].internal
