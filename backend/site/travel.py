"""The tracks of a site as ways that a machine on rails goes: the track's frame at every station."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from backend.errors import InputError
from backend.gauge.centreline import Centreline, InFrame
from backend.gauge.features import Track
from backend.gauge.frames import Pivot, track_frames
from backend.site.gauge import site_features, site_rules
from backend.site.gauge_sources import source_features
from backend.site.site import Site
from backend.spatial.transform import make
from backend.spatial.types import Array, BoolArray

_APART = 1.0  # [m] of the stations among which the nearest one is looked for


@dataclass(frozen=True)
class Way:
    """One track. name: of its limit volume, too; line: the centreline in the site frame, heights
    NaN where nobody tells them; pivot, spacing: see `track_frames`; radius: limits are made within
    that of the site's origin, in plan [m].
    """

    name: str
    line: Centreline
    pivot: Pivot = "as_told"
    spacing: float = 1.5
    radius: float = math.inf

    @property
    def length(self) -> float:
        """[m] from the first to the last station."""
        return self.line.length

    def frames(self, s: Array) -> Array:
        """T_site_track (k, 4, 4) at the stations s (k,) [m]: x along the track, y to its left, z up
        from the plane of the rails; NaN where place or height is not known.
        """
        at = track_frames(self.line, np.asarray(s, dtype=float), self.pivot, self.spacing)
        T = make(np.stack([at.tangent, at.lateral, at.up], axis=-1), at.origin)
        T[~np.isfinite(T).all(axis=(1, 2))] = np.nan
        return T

    def known(self, reach: float) -> Callable[[Array], BoolArray]:
        """Whether the limits of all that a machine at (k, 3) reaches are made: (k,)."""
        return lambda at: np.asarray(np.hypot(at[:, 0], at[:, 1]) <= self.radius - reach)

    def nearest(self, position: Array) -> tuple[float, float]:
        """(station, distance beside it in plan) [m] of the place nearest to position (3,); NaN
        where no place is known.
        """
        count = max(2, math.ceil(self.length / _APART) + 1)
        s = np.linspace(0.0, self.length, count)
        apart = np.linalg.norm(self.line.at(s).xyz[:, :2] - position[:2], axis=1)
        if not np.isfinite(apart).any():
            return math.nan, math.nan
        best = float(s[np.nanargmin(apart)])
        for _ in range(8):
            at = self.line.at(np.array([best]))
            ahead = np.array([np.cos(at.heading[0]), np.sin(at.heading[0])])
            moved = best + float((position[:2] - at.xyz[0, :2]) @ ahead)
            if not math.isfinite(moved):
                break
            best = min(max(moved, 0.0), self.length)
        xy = self.line.at(np.array([best])).xyz[0, :2]
        return best, float(np.linalg.norm(xy - position[:2]))


def site_ways(site: Site) -> tuple[Way, ...]:
    """All tracks of a site's tables and files. Raises InputError for files that cannot be read."""
    rules = site_rules(site)
    ways = []
    for feature in (*site_features(site), *source_features(site)):
        if isinstance(feature, Track):
            rule, line = feature.rule or rules.track, feature.line
            told = line.as_told() if isinstance(line, InFrame) and line.assumed else line
            # An envelope may be left upright; a machine on the rails tilts with them.
            pivot = rule.pivot or "as_told"
            spacing = line.gauge + rule.rail_head
            ways.append(Way(feature.name, told, pivot, spacing, rules.radius))
    return tuple(ways)


def way_called(ways: tuple[Way, ...], name: str) -> Way:
    """The track with that name. Raises InputError listing all."""
    for way in ways:
        if way.name == name:
            return way
    known = ", ".join(way.name for way in ways) or "none, as the site has no track"
    raise InputError(f'no track is called "{name}"; allowed are {known}.')
