"""Which limit volumes concern a machine: within its reach, in use, not the track it stands on.

The choice that Mäkinen 2021 leaves to the operator (Section 4.1). What is not known counts as in
use: only states that say otherwise leave a feature out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from backend.gauge.volumes import LimitVolume
from backend.spatial.types import Array

NOT_IN_USE = frozenset(
    ("proposed", "planned", "closed", "abandoned", "destroyed", "removed", "out of use")
)
"""States of features that nothing runs on, or that are not there (LandXML's stateType, and words of
site files), in lower case."""


@dataclass(frozen=True)
class Options:
    """on_rails: the machine may stand on a track. switched: by name, True takes a feature within
    reach whatever its state, False leaves it out. in_use: by name, instead of what the state says.
    offset, rise: how far beside and above or below a centreline a machine on its rails may be [m];
    turn: how far its heading may be off the track's, either way round [rad].
    """

    on_rails: bool = False
    switched: Mapping[str, bool] = field(default_factory=dict)
    in_use: Mapping[str, bool] = field(default_factory=dict)
    offset: float = 0.5
    rise: float = 1.0
    turn: float = math.radians(15.0)


@dataclass(frozen=True)
class Choice:
    """One volume. reason: why it is chosen or not, in words; distance: from the machine's base, at
    least, exactly to its boxes where these may be within reach [m].
    """

    name: str
    chosen: bool
    reason: str
    distance: float


DEFAULT_OPTIONS = Options()


def choose(
    volumes: Sequence[LimitVolume],
    position: Array,
    reach: float,
    heading: float | None = None,
    options: Options = DEFAULT_OPTIONS,
) -> tuple[Choice, ...]:
    """One choice a volume, in order.

    position: (3,) of the machine's base; reach: of any of its parts from there [m]; heading: of its
    tracks or rail wheels, counter-clockwise from east [rad], without which it stands on no track.
    """
    return tuple(
        Choice(volume.name, not reason, reason or _chosen(volume, options), distance)
        for volume, distance in zip(volumes, _distances(volumes, position, reach), strict=True)
        for reason in [_refusal(volume, distance, position, reach, heading, options)]
    )


def in_force(
    volumes: Iterable[LimitVolume], options: Options = DEFAULT_OPTIONS
) -> tuple[LimitVolume, ...]:
    """The volumes that hold for some machine: all but those switched off or not in use."""
    return tuple(volume for volume in volumes if not why_idle(volume, options))


def why_idle(volume: LimitVolume, options: Options = DEFAULT_OPTIONS) -> str:
    """Why a volume holds for no machine; empty when it does hold."""
    switched = options.switched.get(volume.name)
    if switched is not None:
        return "" if switched else "is switched off"
    in_use = options.in_use.get(volume.name)
    if in_use is None:
        in_use = volume.state.strip().lower() not in NOT_IN_USE
    if in_use:
        return ""
    state = f"is {volume.state}" if volume.name not in options.in_use else "is taken out of use"
    return f"{state}: not open to traffic" if volume.kind == "track" else state


def stands_on(
    volume: LimitVolume, position: Array, heading: float, options: Options = DEFAULT_OPTIONS
) -> bool:
    """Whether a machine at `position` (3,) with `heading` [rad] stands on the volume's track."""
    if volume.axis is None or len(volume.axis) < 2:
        return False
    start, side = volume.axis[:-1], np.diff(volume.axis, axis=0)
    flat = side[:, :2]
    length2 = np.maximum((flat**2).sum(axis=1), 1e-12)
    t = np.clip(((position[:2] - start[:, :2]) * flat).sum(axis=1) / length2, 0.0, 1.0)
    apart = position - (start + t[:, None] * side)
    near = (np.linalg.norm(apart[:, :2], axis=1) <= options.offset) & (
        np.abs(apart[:, 2]) <= options.rise
    )
    off = heading - np.arctan2(flat[:, 1], flat[:, 0])
    along = np.abs(np.sin(off)) <= math.sin(options.turn)
    return bool((near & along).any())


def _refusal(
    volume: LimitVolume,
    distance: float,
    position: Array,
    reach: float,
    heading: float | None,
    options: Options,
) -> str:
    idle = why_idle(volume, options)
    if idle:
        return idle
    if not distance <= reach:
        return f"is out of reach: {distance:.1f} m away, reach is {reach:.1f} m"
    own = options.on_rails and heading is not None and volume.name not in options.switched
    if own and heading is not None and stands_on(volume, position, heading, options):
        return "is the track that the machine stands on"
    return ""


def _chosen(volume: LimitVolume, options: Options) -> str:
    return "is within reach" + (", switched on" if volume.name in options.switched else "")


def _distances(volumes: Sequence[LimitVolume], position: Array, reach: float) -> list[float]:
    """From the spheres around volumes, and from the boxes of those whose spheres are in reach."""
    if not volumes:
        return []
    centers = np.array([volume.sphere[0] for volume in volumes])
    radii = np.array([volume.sphere[1] for volume in volumes])
    bound = np.maximum(np.linalg.norm(centers - position, axis=1) - radii, 0.0)
    for k in np.flatnonzero(bound <= reach).tolist():
        boxes = volumes[k].boxes
        if len(boxes):
            local = np.abs(np.einsum("nji,nj->ni", boxes.rotations, position - boxes.centers))
            outside = np.maximum(local - boxes.half_extents, 0.0)
            bound[k] = float(np.linalg.norm(outside, axis=1).min())
    return [float(distance) for distance in bound]
