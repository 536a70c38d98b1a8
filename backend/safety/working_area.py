"""The ground that a machine works over: now, within a second, at most (Rasul 2021, Section 3.5).

Rasul takes four points of the arm (24)-(27); here whole bodies count. (27) as printed adds up
displacements that all run from now on; here each joint is once within angle + (rate - 3 sigma) dt
to angle + (rate + 3 sigma) dt, and everything on the way there counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from backend.machine.arm_extent import extent_of
from backend.machine.model import Machine
from backend.safety.area_records import FULL, Area, WorkingArea
from backend.safety.working_area_kernel import intervals, narrowest, sectors
from backend.spatial.types import Array, BoolArray, IntArray


class Stand(NamedTuple):
    """A machine at one moment. q, rates: (n,) joint values and rates [rad, rad/s]; sigma_q,
    sigma_rate: their standard deviations; center: (2,) of the swing [m]; azimuth: of the arm [rad];
    tilt: of the swing axis from the vertical [rad]; yaw_rate: of the tracks [rad/s]; sigma_yaw
    [rad]; speed: of the swing centre [m/s]; sigma_position: of one axis [m].
    """

    q: Array
    rates: Array
    sigma_q: float
    sigma_rate: float
    center: Array
    azimuth: float
    tilt: float
    yaw_rate: float
    sigma_yaw: float
    speed: float
    sigma_position: float


def unknown(machine: Machine, reason: str) -> WorkingArea:
    """Nothing but what never changes."""
    return WorkingArea(reason, extent_of(machine).tail)


def working_area(machine: Machine, stand: Stand, dt: float) -> WorkingArea:
    """Rates are taken as constant for `dt` [s], three standard deviations either way; sudden motion
    is not foretold. Within these intervals the areas are upper bounds: no corner is outside.
    """
    extent = extent_of(machine)
    low, high = intervals(
        np.array(stand.q[:4]),  # a copy: kernels are compiled for arrays that can be written
        np.array(stand.rates[:4]),
        stand.sigma_q,
        stand.sigma_rate,
        extent.lower,
        extent.upper,
        dt,
    )
    wider = np.array([0.0, 3.0 * stand.sigma_position + stand.speed * dt, 0.0])
    body = extent.body + extent.height * math.sin(stand.tilt) + wider
    found = sectors(
        extent.pivots,
        extent.vectors,
        extent.starts,
        extent.chain,
        extent.lateral,
        extent.slack,
        extent.signs,
        low[:, 1:],
        high[:, 1:],
        stand.tilt,
        wider,
        body,
    )
    # Equal steps of the swing are no equal steps in plan on a slope.
    bent = 2.0 * math.asin(math.tan(0.5 * stand.tilt) ** 2)
    course = 3.0 * stand.sigma_yaw + bent
    yaw = stand.yaw_rate * dt
    turns = (0.0, 0.0), (min(yaw, 0.0) - course, max(yaw, 0.0) + course), (-bent, bent)
    swings = machine.sun.azimuth_sign * (np.stack([low[:, 0], high[:, 0]], axis=1) - stand.q[0])
    areas = []
    for row, turn in enumerate(turns):
        reach, right, left = found[row].tolist()
        start = stand.azimuth + float(swings[row].min()) + turn[0] - right
        end = stand.azimuth + float(swings[row].max()) + turn[1] + left
        areas.append(_area(float(body[row]), reach, start, end))
    return WorkingArea("", extent.tail, stand.center, *areas)


def touches(area: Area, places: Array, radius: Array) -> BoolArray:
    """(k,) whether discs on the ground touch the area. places: (k, 2) from the swing centre [m];
    radius: (k,) [m].
    """
    return np.asarray(narrowest(_rows(area), np.zeros(2), places, radius) > 0)


def within(area: WorkingArea, places: Array, radius: Array) -> IntArray:
    """(k,) `Within` of discs on the ground. places: (k, 2) site frame [m]; radius: (k,) [m]. All
    NONE where the area is not known: `reason` must be told.
    """
    known = area.maximum, area.predicted, area.current
    if area.center is None or None in known:
        return np.zeros(len(places), dtype=np.int64)
    # In the order of `Within`.
    return np.asarray(narrowest(_rows(*known), np.array(area.center), places, radius))


def _rows(*areas: Area | None) -> Array:
    return np.array([(a.body, a.reach, a.start, a.end) for a in areas if a is not None])


def _area(body: float, reach: float, start: float, end: float) -> Area:
    if end - start >= FULL:
        return Area(body, reach, -math.pi, math.pi)
    turned = (start + math.pi) % FULL - math.pi
    return Area(body, reach, turned, turned + end - start)
