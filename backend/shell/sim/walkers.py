"""Who walks and what drives on a simulated site: a function of the schedule's time alone.

So every process sees them in the same place. They take no notice of machines.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from backend.shell.sim.lidar import Person
from backend.shell.sim.people import Walk, walk
from backend.site import moving
from backend.site.site import Site
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.rotation import rz
from backend.spatial.types import Array

WALKED = 120.0  # of a random walk before it is walked back [s]


class Way(NamedTuple):
    """There and back again. times: (k,) rising from 0 [s]; places: (k, 2) at them [m]; yaws:
    (k - 1,) between them, as on the way there [rad].
    """

    times: Array
    places: Array
    yaws: Array


@lru_cache(maxsize=256)
def way(path: tuple[tuple[float, float], ...], speed: float, pause: float) -> Way:
    """Along the path (two points or more) [m] and back at `speed` [m/s], with a pause [s] at each
    end and corner.
    """
    stops = [*path, *path[-2:0:-1], path[0]]
    times, places, yaws = [0.0], [stops[0]], []
    for k, (here, there) in enumerate(pairwise(stops)):
        step = np.subtract(there, here)
        ahead = step if k < len(path) - 1 else -step
        yaw = float(np.arctan2(ahead[1], ahead[0]))
        if pause > 0.0:
            times.append(times[-1] + pause)
            places.append(here)
            yaws.append(yaw)
        times.append(times[-1] + float(np.hypot(*step)) / speed)
        places.append(there)
        yaws.append(yaw)
    return Way(np.array(times), np.array(places), np.array(yaws))


def along(one: Way, t: float) -> tuple[Array, float]:
    """((2,) place [m], yaw as on the way there [rad]) at t [s]."""
    within = t % float(one.times[-1])
    k = int(np.searchsorted(one.times, within, side="right")) - 1
    k = min(max(k, 0), len(one.yaws) - 1)
    share = (within - one.times[k]) / (one.times[k + 1] - one.times[k])
    step = one.places[k + 1] - one.places[k]
    return one.places[k] + share * step, float(one.yaws[k])


def people_at(site: Site, t: float) -> tuple[Person, ...]:
    """The site's people in the order of its file, t [s] on the schedule; site frame, on z = 0."""
    return tuple(
        Person(_in_site(site, _place(person, t)), height=person.height) for person in site.people
    )


def vehicles_at(site: Site, t: float) -> Boxes:
    """The site's vehicles in the order of its file, t [s] on the schedule; site frame."""
    if not site.vehicles:
        return NO_BOXES
    placed = [along(way(v.path, v.speed, v.pause), t) for v in site.vehicles]
    halves = 0.5 * np.array([v.size for v in site.vehicles])
    centers = np.array([_in_site(site, place) for place, _ in placed])
    return Boxes(
        np.column_stack([centers, halves[:, 2]]), rz(np.array([yaw for _, yaw in placed])), halves
    )


def boxes_around(people: tuple[Person, ...]) -> Boxes:
    """One upright box around each."""
    n = len(people)
    halves = np.array([[p.radius, p.radius, 0.5 * p.height] for p in people]).reshape(n, 3)
    middles = [[*p.place, p.ground + 0.5 * p.height] for p in people]
    return Boxes(np.array(middles).reshape(n, 3), np.tile(np.eye(3), (n, 1, 1)), halves)


def _place(person: moving.Person, t: float) -> Array:
    """(2,) projected CRS [m]."""
    if person.path is None:
        there_and_back = t % (2.0 * WALKED)
        walked = _random_walk(person.seed or 0, person.within)
        return np.array(person.around) + walked.at(
            min(there_and_back, 2.0 * WALKED - there_and_back)
        )
    if len(person.path) == 1:
        return np.array(person.path[0])
    return along(way(person.path, person.speed, person.pause), t)[0]


@lru_cache(maxsize=64)
def _random_walk(seed: int, within: tuple[float, float]) -> Walk:
    """About the origin."""
    return walk(np.random.default_rng(seed), WALKED, within)


def _in_site(site: Site, place: Array) -> Array:
    """(2,) site frame [m] of a place (2,) in the projected CRS."""
    return site.frame.from_projected(np.append(place, site.frame.origin[2]))[:2]
