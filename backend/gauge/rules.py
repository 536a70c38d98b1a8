"""From features to limit volumes: every rule's defaults, and which rule a feature falls under."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from backend.errors import InputError
from backend.gauge.features import (
    Area,
    Buried,
    Ceiling,
    Feature,
    KeepIn,
    Overhead,
    OverheadRule,
    Pole,
    Track,
    TrackRule,
)
from backend.gauge.tracks import track_volume
from backend.gauge.upright import area_volume, ceiling_volume, keep_in_volume, pole_volume
from backend.gauge.volumes import LimitVolume
from backend.gauge.wires import buried_volume, overhead_volume


@dataclass(frozen=True)
class Rules:
    """What holds for features that have no rule of their own. Lengths in metres.

    tolerance: volumes exceed what their rule says by no more; excess: the same for boxes that stand
    for volumes that are none, as far as `boxes` for each convex part are enough; pole, building,
    road, keep_out, buried: clearances; depth: how far ceilings and keep-in areas reach up, down
    and out; center, radius: the part of the site that matters, from which tracks and wires are kept
    and which a ceiling without a polygon covers.
    """

    track: TrackRule = field(default_factory=TrackRule)
    overhead: OverheadRule = field(default_factory=OverheadRule)
    pole: float = 0.0
    building: float = 0.0
    road: float = 0.0
    keep_out: float = 0.0
    buried: float = 0.5
    tolerance: float = 0.010
    excess: float = 0.25
    boxes: int = 12
    depth: float = 30.0
    center: tuple[float, float] = (0.0, 0.0)
    radius: float = 500.0

    def __post_init__(self) -> None:
        if not self.tolerance >= 1e-4:
            raise InputError(
                f"the gauge's tolerance is {self.tolerance}; allowed is at least 0.0001 m."
            )


DEFAULT_RULES = Rules()


def volumes_of(
    features: Iterable[Feature], rules: Rules = DEFAULT_RULES
) -> tuple[LimitVolume, ...]:
    """One volume a feature, in order; none of a track or line outside the part that matters.

    Raises InputError, naming the feature, for one that cannot be followed, and for names that occur
    twice.
    """
    volumes, names = [], set()
    for feature in features:
        if feature.name in names:
            raise InputError(
                f'Two features of the gauge are called "{feature.name}"; allowed is one a name.'
            )
        names.add(feature.name)
        volume = _volume(feature, rules)
        if len(volume.boxes):
            volumes.append(volume)
    return tuple(volumes)


def _volume(feature: Feature, rules: Rules) -> LimitVolume:
    center = np.array(rules.center)
    cover = rules.excess, rules.boxes
    match feature:
        case Track():
            rule = feature.rule or rules.track
            return track_volume(feature, rule, rules.tolerance, center, rules.radius)
        case Overhead():
            wire = feature.rule or rules.overhead
            return overhead_volume(feature, wire, rules.tolerance, center, rules.radius)
        case Pole():
            return pole_volume(feature, _or(feature.clearance, rules.pole), rules.tolerance)
        case Area():
            clearance = _or(feature.clearance, float(getattr(rules, feature.kind)))
            return area_volume(feature, clearance, *cover)
        case KeepIn():
            return keep_in_volume(feature, rules.depth, *cover)
        case Ceiling():
            return ceiling_volume(feature, rules.depth, center, rules.radius, *cover)
        case Buried():
            clearance = _or(feature.clearance, rules.buried)
            return buried_volume(feature, clearance, center, rules.radius)


def _or(value: float | None, default: float) -> float:
    return default if value is None else value
