"""How firmly a machine stands right now: what the meter and the plan view show."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from backend.machine.model import Machine
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array
from backend.stability.dynamics import ground_wrench
from backend.stability.masses import MassModel, mass_model
from backend.stability.polygon import Polygon, support_polygon
from backend.stability.records import Stability
from backend.stability.simple_model import critical_lift, critical_swing, two_masses
from backend.stability.zmp import edge_distances, margin, share, zmp_of

CORNER = 0.15
"""Edges whose shares differ by less than this are named together ("front-left")."""


@lru_cache(maxsize=32)
def models(machine: ByIdentity[Machine], payload: float) -> tuple[MassModel, Polygon]:
    """What a machine with that payload [kg] weighs, and where it stands; made once."""
    return mass_model(machine.value, payload), support_polygon(machine.value)


def stability(
    machine: Machine,
    payload: float,
    q: Array,
    rates: Array,
    accelerations: Array,
    noise: tuple[Array, Array],
    T_site_root: Array | None = None,
) -> Stability:
    """The machine in this motion. q, rates, accelerations: (n,) [rad, rad/s, rad/s^2]; noise:
    standard deviations (n,) of the last two; T_site_root: (4, 4), level when None.

    Raises InputError when the masses are not known: ask `masses.why_unknown` first.
    """
    model, support = models(ByIdentity(machine), payload)
    n = len(q)
    # The motion itself, then each rate and each acceleration off by its sigma.
    v, a = np.tile(rates, (2 * n + 1, 1)), np.tile(accelerations, (2 * n + 1, 1))
    joint = np.arange(n)
    v[1 + joint, joint] += noise[0]
    a[1 + n + joint, joint] += noise[1]
    points = zmp_of(ground_wrench(model, q, v, a, T_site_root))
    left = margin(points, support)
    two = two_masses(model, support, np.asarray(q, dtype=float))
    with np.errstate(invalid="ignore"):
        sigma = float(np.sqrt(np.square(left[1:] - left[0]).sum()))
    return Stability(
        reason="",
        payload=payload,
        support=support,
        zmp=points[0],
        margin=float(left[0]),
        sigma=sigma,
        share=float(share(points[0], support)),
        edge=edge_words(points[0], support),
        critical_lift=float(critical_lift(two).min()),
        critical_swing=float(critical_swing(two).min()),
    )


def edge_words(point: Array, support: Polygon) -> str:
    """The edge nearest to the ZMP (2,), by share, with its neighbour where a corner is near."""
    if np.isnan(point).any():
        return "every edge"
    left = edge_distances(point, support) / support.inradii
    first = int(np.argmin(left))
    beside = [(first - 1) % len(left), (first + 1) % len(left)]
    second = min(beside, key=lambda i: float(left[i]))
    if left[second] - left[first] >= CORNER:
        return support.names[first]
    names = [support.names[first], support.names[second]]
    return "-".join(sorted(names, key=lambda name: name not in ("front", "rear")))
