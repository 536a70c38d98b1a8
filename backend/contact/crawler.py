"""The crawler's outline seen from the side: a belt around two end wheels.

In the root frame it is all that lies within `radius` of the segment from the rear wheel's centre to
the front wheel's; its flat underside is the root's z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine

_BESIDE = 0.25
"""Of the gauge: a body whose middle is this near to a track's is (part of) the track."""


@dataclass(frozen=True)
class Crawler:
    """middle: x of the crawler's middle in the root frame, positive before the swing axis [m];
    half_base: half of the distance between the end wheels' centres [m]; radius: of the end wheels
    with the belt [m]; gauge: centre to centre, shoe: width [m]; bodies: the machine's that stand
    for the belts, by index.
    """

    middle: float
    half_base: float
    radius: float
    gauge: float
    shoe: float
    bodies: tuple[int, ...]

    @property
    def half_width(self) -> float:
        """From the middle to the outer edge of a shoe [m]."""
        return 0.5 * (self.gauge + self.shoe)


def crawler_of(machine: Machine) -> Crawler:
    """From the bodies that stand for the tracks; the ends are taken as round, half as high as the
    tracks in radius. Raises InputError for a machine that does not stand on two tracks.
    """
    tracks = machine.tracks
    found = []
    for k, part in enumerate(machine.body_parts):
        corners = machine.body_corners[k]
        beside = abs(abs(float(corners[:, 1].mean())) - 0.5 * tracks.gauge)
        long = float(np.ptp(corners[:, 0])) > 0.5 * tracks.length
        near = long and beside < _BESIDE * tracks.gauge
        if part == "tracks" and machine.body_links[k] == 0 and near:
            found.append(k)
    sides = {float(np.sign(machine.body_corners[k][:, 1].mean())) for k in found}
    if sides != {-1.0, 1.0}:
        raise InputError(
            f"{machine.name} has no body of its own for each of two tracks, as long as "
            f"tracks.length = {tracks.length:g} m says: how it stands on an edge is not known."
        )
    corners = machine.body_corners[found].reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    radius = 0.5 * float(high[2] - low[2])
    half_base = 0.5 * float(high[0] - low[0]) - radius
    if abs(low[2]) > 0.1 * radius or half_base <= 0.0:
        raise InputError(
            f"{machine.name}: its tracks are no belts on the ground: their bodies reach from "
            f"{low[2]:g} to {high[2]:g} m of height over {high[0] - low[0]:g} m of length."
        )
    return Crawler(
        middle=0.5 * float(low[0] + high[0]),
        half_base=half_base,
        radius=radius,
        gauge=tracks.gauge,
        shoe=tracks.shoe,
        bodies=tuple(found),
    )
