"""Lift capacity: what a machine can hold before an edge of its support polygon bears no more.

At rest every edge's moment is affine in the payload, so the payload at which it is used up follows
from two of them. `least` is the share of the way from the polygon's centre to an edge that must be
left (`zmp.share`): 0 is the tipping load itself. What the hydraulics can lift is not asked here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.machine.inverse import inverse
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.machine.sun_map import sun_angles
from backend.spatial import transform
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array
from backend.stability.dynamics import rest_wrench
from backend.stability.masses import MassModel, mass_model
from backend.stability.polygon import Polygon, shrunk
from backend.stability.state import models
from backend.stability.zmp import moments_of

DIRECTIONS = 36
"""Of the plan's capacity curve."""
_REACHES = 25
_PROBE = 1000.0  # payload whose moments are compared with those of none [kg]


@dataclass(frozen=True)
class CapacityChart:
    """payload: (a, r) [kg] that may hang at the tip, NaN where it cannot be, inf where a load only
    steadies; azimuths: (a,) of the tip in the root frame, counter-clockwise from its x [rad];
    reaches: (r,) from the swing axis, ascending [m]; height: above the swing joint's origin [m].
    """

    azimuths: Array
    reaches: Array
    payload: Array
    height: float


def lift_capacity(
    machine: Machine,
    support: Polygon,
    q: Array,
    T_site_root: Array | None = None,
    least: float = 0.0,
    at: Array | None = None,
) -> Array:
    """(...) greatest payload at rest [kg]; 0 where even none is too much, inf where none is.

    q: (..., n) [rad]; T_site_root: (..., 4, 4), level when None; at: as in `mass_model`. Raises
    InputError when masses are not known or `least` is no share.
    """
    within = shrunk(support, least)
    empty = _static(_model(machine, 0.0, at), within, q, T_site_root)
    loaded = _static(_model(machine, _PROBE, at), within, q, T_site_root)
    taken = (empty - loaded) / _PROBE
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(taken > 0.0, empty / taken, np.inf).min(axis=-1)
    # An edge that does not hold the empty machine is not helped by what hangs elsewhere.
    return np.asarray(np.where((empty < 0.0).any(axis=-1), 0.0, most))


def capacity_chart(
    machine: Machine,
    support: Polygon,
    azimuths: Array,
    reaches: Array,
    height: float,
    attitude: float,
    T_site_root: Array | None = None,
    least: float = 0.0,
    elbow: int = 1,
) -> CapacityChart:
    """The capacity with the tip at `height` and the bucket at `attitude` [rad]; elbow: +1 up.

    azimuths: (a,) [rad]; reaches: (r,) ascending [m]; T_site_root: (4, 4); as in `lift_capacity`.
    """
    angle, reach = np.meshgrid(azimuths, reaches, indexing="ij")
    p_swing = np.stack(
        [reach * np.cos(angle), reach * np.sin(angle), np.full_like(reach, height)], -1
    )
    found = inverse(machine, transform.apply(machine.arm.T_root_swing, p_swing), attitude, elbow)
    can = found.reachable & found.within_limits
    payload = lift_capacity(machine, support, found.q, T_site_root, least)
    return CapacityChart(
        np.asarray(azimuths, dtype=float),
        np.asarray(reaches, dtype=float),
        np.where(can, payload, np.nan),
        float(height),
    )


def farthest(chart: CapacityChart, payload: float) -> Array:
    """(a,) the greatest reach up to which `payload` [kg] may be held everywhere [m].

    Between charted reaches the capacity is taken as straight. NaN in directions where the payload
    may be held nowhere.
    """
    known = ~np.isnan(chart.payload)
    refused = known & (chart.payload < payload)
    good = known & ~np.logical_or.accumulate(refused, axis=1)
    last = chart.reaches.size - 1 - good[:, ::-1].argmax(axis=1)
    after = np.minimum(last + 1, chart.reaches.size - 1)
    rows = np.arange(len(good))
    more, less = chart.payload[rows, last], chart.payload[rows, after]
    with np.errstate(invalid="ignore"):
        part = np.where(refused[rows, after] & np.isfinite(more), (more - payload), 0.0)
        part = part / np.where(more > less, more - less, 1.0)
    part = np.where(np.isfinite(part), part, 0.0)
    reach = chart.reaches[last] + part * (chart.reaches[after] - chart.reaches[last])
    return np.where(good.any(axis=1), reach, np.nan)


def holding_reach(
    machine: Machine,
    support: Polygon,
    q: Array,
    payload: float,
    T_site_root: Array | None = None,
    least: float = 0.0,
    directions: slice = slice(None),
) -> Array:
    """(DIRECTIONS,), or those of them that are asked for: up to which reach `payload` [kg] may be
    held with the tip as high, the bucket at the attitude and the elbow on the side that q (n,) has
    now [m]; NaN where nowhere.

    Directions are of the tip from the swing axis, in the root frame, evenly from -pi. Tilt and
    rotate joints are taken at 0. Up to the lengths of the arm's links and the joints' limits.
    """
    theta = sun_angles(machine, np.asarray(q, dtype=float))
    p_root = end_point(machine, np.asarray(q, dtype=float))[None]
    height = transform.apply(transform.inverse(machine.arm.T_root_swing), p_root)[0, 2]
    azimuths = np.linspace(-np.pi, np.pi, DIRECTIONS, endpoint=False)
    reaches = np.linspace(0.0, machine.max_reach, _REACHES)
    chart = capacity_chart(
        machine,
        support,
        np.asarray(azimuths[directions], dtype=float),
        np.asarray(reaches, dtype=float),
        float(height),
        float(theta.sum()),
        T_site_root,
        least,
        elbow=1 if np.sin(theta[1]) <= 0.0 else -1,
    )
    return farthest(chart, payload)


def _model(machine: Machine, payload: float, at: Array | None) -> MassModel:
    if at is None:
        return models(ByIdentity(machine), payload)[0]
    return mass_model(machine, payload, at)


def _static(model: MassModel, support: Polygon, q: Array, T_site_root: Array | None) -> Array:
    return moments_of(rest_wrench(model, q, T_site_root), support)
