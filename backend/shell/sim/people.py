"""Simulated people: they walk, turn, stop and go on, along paths drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.spatial.angles import wrap
from backend.spatial.types import Array

STEP = 0.02  # [s] between two places of a path


@dataclass(frozen=True)
class Walk:
    """places: (k, 2), a STEP apart [m]; the person stands at the last one afterwards."""

    places: Array

    def at(self, t: float) -> Array:
        """(2,) where the person is at t [s]."""
        k = min(max(t / STEP, 0.0), len(self.places) - 1.0)
        low = int(k)
        high = min(low + 1, len(self.places) - 1)
        return np.asarray(self.places[low] + (k - low) * (self.places[high] - self.places[low]))


def walk(
    rng: np.random.Generator,
    seconds: float,
    around: tuple[float, float] = (3.0, 12.0),
    speeds: tuple[float, float] = (0.8, 1.5),
    turns: tuple[float, float] = (np.pi / 2, np.pi),
    legs: tuple[float, float] = (5.0, 9.0),
    turning: float = 2.5,
    stops: float = 0.15,
) -> Walk:
    """Somebody who walks within a ring about the origin.

    around: radii of the ring [m]; speeds [m/s]; turns: angle of a change of direction, either way
    [rad]; legs: time between two [s]; turning: fastest turn of the walking direction [rad/s];
    stops: how often somebody stands for two seconds instead of turning.
    """
    low, high = around
    at, far = rng.uniform(-np.pi, np.pi), rng.uniform(low + 1.0, high - 1.0)
    place = far * np.array([np.cos(at), np.sin(at)])
    heading, speed = rng.uniform(-np.pi, np.pi), rng.uniform(*speeds)
    goal, wanted = heading, speed
    until = rng.uniform(0.3, 1.0) * rng.uniform(*legs)
    places = [place]
    for k in range(round(seconds / STEP)):
        t = k * STEP
        radius = float(np.hypot(*place))
        out = place @ [np.cos(heading), np.sin(heading)] > 0.0
        leaving = (radius > high and out) or (radius < low and not out)
        if t >= until or (leaving and abs(wrap(goal - heading)) < 0.1):
            if rng.random() < stops and not leaving:
                wanted, until = 0.0, t + 2.0
            else:
                goal = heading + rng.choice([-1.0, 1.0]) * rng.uniform(*turns)
                wanted, until = rng.uniform(*speeds), t + rng.uniform(*legs)
        off = float(wrap(goal - heading))
        heading += float(np.clip(off, -turning * STEP, turning * STEP))
        speed += float(np.clip(wanted - speed, -1.5 * STEP, 1.5 * STEP))
        place = place + speed * STEP * np.array([np.cos(heading), np.sin(heading)])
        places.append(place)
    return Walk(np.array(places))
