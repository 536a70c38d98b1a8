"""Where own's base must not go because of people, and because of what stands on the site.

A zone of the site is kept while the machine keeps its height, attitude and joints (a swing changes
only what it is as it stands, boom, stick and bucket not what holds in any posture): driving on flat
ground makes none anew, as a zone does not depend on where the base is, only on what is near it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving import (
    ANY_POSTURE,
    ANY_SWING,
    AS_IS,
    TURNING,
    one_zone,
    way_out,
    whole_reach,
)
from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.people import everybody
from backend.pipeline.place import base_transform
from backend.pipeline.records import Snapshot
from backend.pipeline.stood_on import but_ground
from backend.pipeline.surroundings import PEOPLE, SITE
from backend.pipeline.working_gauge import site_of
from backend.pipeline.zones import TOLERANCE, ZoneImage, set_upright
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array, BoolArray

VIEW, LEAST = 15.0, 2.0
"""How far from the base zones are complete [m], and how far at least, however much is there."""
MOST = {PEOPLE: 30, SITE: 100}
"""Boxes of a layer that are looked at; where there are more, the view is shorter."""
ON_SLOPES = 2
"""So many times fewer of a machine on a slope, where a zone takes some times as long."""
VARIANTS = {PEOPLE: (AS_IS, ANY_SWING, ANY_POSTURE, TURNING), SITE: (AS_IS, ANY_SWING, ANY_POSTURE)}
"""Turning takes as long as any swing; of the site it is left out."""

CELL, HEIGHT, ANGLE, LENGTH = 2.0, 0.02, 0.002, 0.02
"""Quanta of the place that the view is about [m], of a base's height [m], its yaw, pitch and roll
and its joints [rad], and of eta [m]."""


def zones_around(
    snapshot: Snapshot, config: Config
) -> list[tuple[Callable[[Snapshot, Config, str], ZoneImage], str]]:
    """What to make and of which own machine, where that means something now: those that are placed
    and valid, and people where there are LiDARs.
    """
    placed = [
        name
        for name in config.own
        if snapshot.machines[name].pose.validity is Validity.VALID
        and snapshot.machines[name].body is not None
    ]
    makers = (site_zone,) if snapshot.people is None else (people_zone, site_zone)
    return [(make, name) for name in placed for make in makers]


def people_zone(snapshot: Snapshot, config: Config, own: str) -> ZoneImage:
    """Zones of everybody who limits machines, wider by 3 sigma; none and a reason while they are
    not known. Raises ValueError when `own` is not placed, and on a site without LiDARs.
    """
    people = snapshot.people
    machine, state = config.machines[own], snapshot.machines[own]
    if state.body is None or people is None:
        raise ValueError(f"{own} is not placed yet, or the site has no LiDAR")
    T = base_transform(state.pose)
    base, time = np.array(T[:2, 3]), snapshot.state_time
    if people.reason:
        return ZoneImage(own, None, time, base, math.nan, {}, {}, PEOPLE, 0.0, people.reason)
    T, eta = set_upright(machine, T, state.pose.yaw, state.eta)
    boxes = everybody(people)[0]
    near, view = in_view(machine, T[:3, 3], boxes, eta, most_of(PEOPLE, T))
    seen = boxes.take(near)
    zones = {
        name: one_zone(name, machine, state.pose.joints, T, seen, eta, TOLERANCE)
        for name in VARIANTS[PEOPLE]
    }
    return _image(snapshot, own, PEOPLE, eta, zones, view)


def site_zone(snapshot: Snapshot, config: Config, own: str) -> ZoneImage:
    """Zones of what stands on the site and of its working gauge as it holds for `own`, not of the
    ground. Raises ValueError when `own` is not placed.
    """
    machine, state = config.machines[own], snapshot.machines[own]
    if state.body is None:
        raise ValueError(f"{own} is not placed yet")
    pose = state.pose
    site = but_ground(site_of(own, snapshot.gauge, config), state)
    cell = (round(float(pose.position[0]) / CELL), round(float(pose.position[1]) / CELL))
    height = round(float(pose.position[2]) / HEIGHT)
    turn = tuple(round(float(v) / ANGLE) for v in (pose.yaw, pose.pitch, pose.roll))
    joints = tuple(round(float(v) / ANGLE) for v in pose.joints)
    length = math.ceil(state.eta / LENGTH)
    # What a variant does not depend on stands as 0 in its key.
    asked = {
        AS_IS: joints,
        ANY_SWING: (0, *joints[1:]),
        ANY_POSTURE: tuple(0 for _ in joints),
    }
    found = {
        name: _of_site(
            name, ByIdentity(machine), ByIdentity(site), cell, height, turn, asked[name], length
        )
        for name in VARIANTS[SITE]
    }
    zones = {name: zone for name, (zone, _, _) in found.items()}
    _, eta, view = found[AS_IS]
    return _image(snapshot, own, SITE, eta, zones, view)


def most_of(layer: str, T: Array) -> int:
    """Boxes of a layer to look at when the base stands at T (4, 4)."""
    upright = np.hypot(T[0, 2], T[1, 2]) == 0.0
    return MOST[layer] if upright else MOST[layer] // ON_SLOPES


def in_view(
    machine: Machine, base: Array, boxes: Boxes, eta: float, most: int, doubt: float = 0.0
) -> tuple[BoolArray, float]:
    """(n,) which boxes matter for zones about base (3,) [m], and the view within which these are
    all: VIEW, or less when more than `most` are there, but never less than LEAST.

    eta: by which the boxes are to be grown; doubt: by which the base may be elsewhere [m].
    """
    extents = np.einsum("nij,nj->ni", np.abs(boxes.rotations), boxes.half_extents)
    # A box that is grown by eta on every side has corners that are farther out.
    gap = np.maximum(np.abs(boxes.centers - base) - extents - math.sqrt(3.0) * eta, 0.0)
    far = whole_reach(machine) + doubt
    beside = np.hypot(gap[:, 0], gap[:, 1]) - far
    beside[gap[:, 2] > far] = np.inf
    view = VIEW
    if (beside <= VIEW).sum() > most:
        view = max(float(np.partition(beside, most)[most]), LEAST)
    return np.asarray(beside <= view, dtype=bool), view


@lru_cache(maxsize=96)
def _of_site(
    variant: str,
    machine: ByIdentity[Machine],
    site: ByIdentity[SiteBodies],
    cell: tuple[int, int],
    height: int,
    turn: tuple[int, ...],
    joints: tuple[int, ...],
    length: int,
) -> tuple[BaseGeometry, float, float]:
    """The zone, the growth it was made with and its view [m]."""
    model = machine.value
    yaw, pitch, roll = (ANGLE * k for k in turn)
    place = np.array([CELL * cell[0], CELL * cell[1], HEIGHT * height])
    T = transform.make(rotation.from_attitude(yaw, pitch, roll), place)
    T, eta = set_upright(model, T, yaw, LENGTH * length + rounding(model, variant))
    boxes = site.value.boxes
    near, view = in_view(model, place, boxes, eta, most_of(SITE, T), CELL * math.sqrt(0.5))
    q = ANGLE * np.array(joints, dtype=float)
    zone = one_zone(variant, model, q, T, boxes.take(near), eta, TOLERANCE)
    return zone, eta, view


def rounding(machine: Machine, variant: str) -> float:
    """How far the quanta may move a point of a machine in the site's zone at most [m]."""
    base = 0.5 * HEIGHT + 0.5 * ANGLE * 3.0 * whole_reach(machine)
    moving = {AS_IS: len(machine.joints), ANY_SWING: len(machine.joints) - 1, ANY_POSTURE: 0}
    # What a joint moves is no farther from its axis than the links on the way are long together.
    return base + 0.5 * ANGLE * moving[variant] * machine.bounding_radius


def _image(
    snapshot: Snapshot,
    own: str,
    layer: str,
    eta: float,
    zones: Mapping[str, BaseGeometry],
    view: float,
) -> ZoneImage:
    base = snapshot.machines[own].pose.position[:2].copy()
    ways = {name: way_out(zone, base) for name, zone in zones.items()}
    exits = {
        name: replace(way, signed_distance=min(way.signed_distance, view))
        for name, way in ways.items()
    }
    time = snapshot.state_time
    return ZoneImage(own, None, time, base, eta, dict(zones), exits, layer, view)
