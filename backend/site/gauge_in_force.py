"""From what operators chose and where machines stand to the bodies in force.

The same objects for the same choice, so that whatever was computed of them is found again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from backend.site.gauge_choice import Drawn, GaugeChoice
from backend.site.named_bodies import SiteBodies
from backend.spatial.boxes import concatenated
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array

if TYPE_CHECKING:
    from backend.gauge.volumes import LimitVolume

OFFSET, RISE, TURN = 0.75, 1.5, math.radians(20.0)
"""A machine is on a track by `choose.Options` (0.5 m beside it, 1 m above or below, 15° off) and
leaves it only beyond these [m, m, rad]: a position's noise does not put it on and off the track."""
OFF = "is switched off"


def in_force(bodies: SiteBodies, choice: GaugeChoice) -> SiteBodies:
    """The site with what is drawn and switched; itself when nothing is.

    Names that are drawn or switched and not known are no harm: they hold for nothing.
    Raises InputError for an area that is none.
    """
    if not choice.drawn and not choice.switched:
        return bodies
    return _in_force(ByIdentity(bodies), choice)


def left_out(bodies: SiteBodies, names: tuple[str, ...]) -> SiteBodies:
    """The bodies that hold for a machine on the tracks `names`; themselves when it is on none."""
    return _left_out(ByIdentity(bodies), names) if names else bodies


def own_tracks(
    bodies: SiteBodies, position: Array, heading: float, before: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """The tracks in force that a machine stands on, and which Mäkinen 2021 (Section 2.1.2) leaves
    out for it; not those that somebody switched on.

    position: (3,) of its base; heading: of its tracks or rail wheels, counter-clockwise from east
    [rad]; before: the tracks it stood on in the cycle before, which it is slower to leave.
    """
    tracks = _tracks(ByIdentity(bodies))
    if not tracks:
        return ()
    from backend.gauge.choose import DEFAULT_OPTIONS, stands_on

    leaving = replace(DEFAULT_OPTIONS, offset=OFFSET, rise=RISE, turn=TURN)
    found = []
    x, y = float(position[0]), float(position[1])
    for volume, (west, south, east, north) in tracks:
        if west <= x <= east and south <= y <= north:
            options = leaving if volume.name in before else DEFAULT_OPTIONS
            if stands_on(volume, position, heading, options):
                found.append(volume.name)
    return tuple(found)


@lru_cache(maxsize=16)
def _tracks(
    bodies: ByIdentity[SiteBodies],
) -> tuple[tuple[LimitVolume, tuple[float, float, float, float]], ...]:
    """Those that may be left out, each with where a machine's base is on it at most: from west to
    east, from south to north [m].
    """
    site = bodies.value
    found = []
    for volume in site.volumes:
        skipped = volume.name in site.idle or volume.name in site.always
        if volume.kind == "track" and volume.axis is not None and not skipped:
            (west, south), (east, north) = volume.axis[:, :2].min(0), volume.axis[:, :2].max(0)
            around = west - OFFSET, south - OFFSET, east + OFFSET, north + OFFSET
            found.append((volume, around))
    return tuple(found)


@lru_cache(maxsize=32)
def _left_out(bodies: ByIdentity[SiteBodies], names: tuple[str, ...]) -> SiteBodies:
    return bodies.value.without(names)


@lru_cache(maxsize=8)
def _in_force(bodies: ByIdentity[SiteBodies], choice: GaugeChoice) -> SiteBodies:
    site = bodies.value
    known = {volume.name for volume in site.volumes}
    drawn = tuple(_volume(area) for area in choice.drawn if area.name not in known)
    volumes = site.volumes + drawn
    switched = dict(choice.switched)
    idle = _idle(volumes, site.idle, switched)
    held = [volume for volume in volumes if volume.name not in idle]
    standing = site.standing
    return SiteBodies(
        concatenated([standing.boxes, *(volume.boxes for volume in held)]),
        (*standing.names, *(name for volume in held for name in volume.box_names)),
        volumes,
        idle,
        frozenset(v.name for v in volumes if switched.get(v.name, v.name in site.always) is True),
    )


def _idle(
    volumes: tuple[LimitVolume, ...], before: Mapping[str, str], switched: Mapping[str, bool]
) -> dict[str, str]:
    """By name of a volume, why it holds for nobody."""
    whys = {
        v.name: ("" if switched[v.name] else OFF) if v.name in switched else before.get(v.name, "")
        for v in volumes
    }
    return {name: why for name, why in whys.items() if why}


@lru_cache(maxsize=256)
def _volume(area: Drawn) -> LimitVolume:
    from backend.gauge.features import Area, KeepIn
    from backend.gauge.rules import DEFAULT_RULES, volumes_of

    polygon, rules = np.array(area.polygon), replace(DEFAULT_RULES, keep_out=0.0)
    if area.kind == "keep_in":
        (volume,) = volumes_of([KeepIn(area.name, polygon, area.bottom, area.top)], rules)
    else:
        assert area.bottom is not None
        assert area.top is not None
        feature = Area(area.name, "keep_out", polygon, area.bottom, area.top)
        (volume,) = volumes_of([feature], rules)
    return replace(volume, state="drawn")
