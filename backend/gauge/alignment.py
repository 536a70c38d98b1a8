"""An alignment: plan, profile, cant and stations of one track, road or line."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from backend.gauge.cant import Cant
from backend.gauge.elements import Element
from backend.gauge.profile import Profile
from backend.gauge.stations import Stations
from backend.spatial.types import Array

_END = 1e-3  # beyond an element by less, its end is meant: files round to millimetres [m]


@dataclass(frozen=True)
class Centreline:
    """An alignment at k places. xyz: (k, 3) the middle between the rails at the profile's height,
    as without cant [m]; heading: (k,) counter-clockwise from east [rad]; gradient: (k,) rise over
    distance in plan; cant: (k,) [m], positive when the left rail is the higher one; curvature:
    (k,) [1/m], left positive; lift: (k,) how far cant raises the middle above xyz, by the rail that
    it turns the track about [m].

    NaN where nothing is known: xyz where an element was not read, its height and the gradient
    where there is no profile.
    """

    xyz: Array
    heading: Array
    gradient: Array
    cant: Array
    curvature: Array
    lift: Array


@dataclass(frozen=True)
class Alignment:
    """One alignment. name, description, state, elements: as in the file; starts: (n,) distance of
    each element's start [m], the sum of the lengths before it except behind an element that was not
    read; gauge: between the rails' running edges [m], `gauge_stated` when the file says it.

    coding: the file's codes by label; stated_length: NaN when the file does not say;
    profiles: all, the first is the one that counts.
    """

    name: str
    elements: tuple[Element, ...]
    starts: Array
    description: str = ""
    state: str = ""
    stations: Stations = field(default_factory=Stations)
    profiles: tuple[Profile, ...] = ()
    cant: Cant | None = None
    gauge: float = 1.524
    gauge_stated: bool = False
    stated_length: float = math.nan
    coding: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @cached_property
    def length(self) -> float:
        """Distance of the last element's end from the start, in plan [m]."""
        return float(self.starts[-1] + self.elements[-1].length)

    @property
    def profile(self) -> Profile | None:
        return self.profiles[0] if self.profiles else None

    def at(self, s: Array) -> Centreline:
        """The alignment at distances s (k,) [m] from its start, in plan."""
        s = np.asarray(s, dtype=float)
        xy, heading, curvature = self.plan(s)
        height, gradient = self.height(s)
        cant, lift = np.zeros(len(s)), np.zeros(len(s))
        if self.cant is not None:
            cant = self.cant.at(s)
            lift = self.cant.lift(cant, curvature)
        xyz = np.concatenate([xy, height[:, None]], axis=1)
        return Centreline(xyz, heading, gradient, cant, curvature, lift)

    def plan(self, s: Array) -> tuple[Array, Array, Array]:
        """Positions (k, 2), headings and curvatures (k,) at s (k,); NaN off the elements."""
        xy = np.full((len(s), 2), np.nan)
        heading, curvature = np.full(len(s), np.nan), np.full(len(s), np.nan)
        index = np.clip(np.searchsorted(self.starts, s, side="right") - 1, 0, None)
        for i in np.unique(index):
            element = self.elements[i]
            t = s - self.starts[i]
            on = (index == i) & (t >= -_END) & (t <= element.length + _END)
            if on.any():
                inside = np.clip(t[on], 0.0, element.length)
                xy[on], heading[on], curvature[on] = element.at(inside)
        return xy, heading, curvature

    def height(self, s: Array) -> tuple[Array, Array]:
        """The profile's height [m] and gradient at s (k,); NaN where there is none."""
        if self.profile is None:
            return np.full(len(s), np.nan), np.full(len(s), np.nan)
        return self.profile.at(s)
