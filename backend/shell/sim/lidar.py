"""A simulated spinning LiDAR: what it measures of machines, the site, people and the ground.

By default a VLP-16: 16 beams within 15 degrees up and down, 10 turns a second of 1,800 directions,
100 m, 30 mm of range noise. Nearer things hide farther ones; rays that graze or hit nothing have no
echo, and some are lost at random.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np

from backend.shell.sim.lidar_kernel import cast
from backend.spatial.boxes import Boxes
from backend.spatial.transform import apply
from backend.spatial.types import Array, IntArray


@dataclass(frozen=True)
class Lidar:
    """elevations: (b,) of the beams [rad]; directions: of a turn; farthest [m]; noise: standard
    deviation of a range [m]; lost: share of echoes that do not come back.
    """

    elevations: Array = field(default_factory=lambda: np.deg2rad(np.linspace(-15.0, 15.0, 16)))
    directions: int = 1800
    farthest: float = 100.0
    noise: float = 0.03
    lost: float = 0.02


@dataclass(frozen=True)
class Person:
    """Somebody who stands upright: a torso and a head. place: (2,) [m]; ground: height of the feet
    [m]; radius, height [m].
    """

    place: Array
    ground: float = 0.0
    radius: float = 0.22
    height: float = 1.75

    def cylinders(self) -> Array:
        """(2, 5), see `lidar_kernel.cast`."""
        x, y = self.place
        neck = 0.85 * self.height
        return np.array(
            [
                [x, y, self.ground, self.radius, neck],
                [x, y, self.ground + neck, 0.5 * self.radius, self.height - neck],
            ]
        )


class Scan(NamedTuple):
    """points: (n, 3) as measured [m]; hit: (n,) what each echo is of, see `lidar_kernel.cast`."""

    points: Array
    hit: IntArray


Ground: TypeAlias = tuple[Array, float]
"""Upward unit normal (3,) and offset [m]."""
LEVEL: Ground = (np.array([0.0, 0.0, 1.0]), 0.0)
WHOLE = (0, 1)
"""The first of one part: a whole turn."""


def scan(
    lidar: Lidar,
    T_site_sensor: Array,
    boxes: Boxes,
    people: tuple[Person, ...],
    rng: np.random.Generator,
    ground: Ground = LEVEL,
    part: tuple[int, int] = WHOLE,
) -> Scan:
    """One turn, or a part of one, as if everything stood still during it, in the frame of the
    scene. T_site_sensor: (4, 4); part: which one, of how many.
    """
    seen = measured(lidar, T_site_sensor, boxes, people, rng, ground, part)
    return Scan(apply(T_site_sensor, seen.points), seen.hit)


def measured(
    lidar: Lidar,
    T_site_sensor: Array,
    boxes: Boxes,
    people: tuple[Person, ...],
    rng: np.random.Generator,
    ground: Ground = LEVEL,
    part: tuple[int, int] = WHOLE,
) -> Scan:
    """The same in the frame of the sensor, as it tells it."""
    k, n = part
    directions = np.arange(k * lidar.directions // n, (k + 1) * lidar.directions // n)
    azimuths = directions * (2.0 * math.pi / lidar.directions)
    cylinders = np.concatenate([np.zeros((0, 5)), *(person.cylinders() for person in people)])
    R, origin = np.ascontiguousarray(T_site_sensor[:3, :3]), T_site_sensor[:3, 3].copy()
    far, hit = cast(
        origin,
        R,
        np.array(lidar.elevations),  # writable, as kernels are compiled for either kind
        azimuths,
        (boxes.centers, boxes.rotations, boxes.half_extents),
        cylinders,
        np.append(*ground),
        lidar.farthest,
        (int(directions[0]), lidar.directions),
    )
    back = np.isfinite(far) & (rng.random(far.shape) >= lidar.lost)
    e, a = np.nonzero(back)
    ranges = far[back] + rng.normal(scale=lidar.noise, size=len(e))
    flat = ranges * np.cos(lidar.elevations)[e]
    points = np.empty((len(e), 3))
    points[:, 0] = flat * np.cos(azimuths)[a]
    points[:, 1] = flat * np.sin(azimuths)[a]
    points[:, 2] = ranges * np.sin(lidar.elevations)[e]
    return Scan(points, hit[back])
