"""What a machine stands on that is not on its tracks: any points of the ground, at rest.

The ground's points push up and, by friction, sideways: as long as that is enough, a machine at rest
stands when its centre of mass is above the convex hull of the points that bear it, whatever their
heights. Its distance to the hull's edges is the margin, and edges are named by where they lie.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from backend.errors import InputError
from backend.machine.model import Machine
from backend.spatial.identity import ByIdentity
from backend.spatial.transform import apply
from backend.spatial.types import Array
from backend.stability.dynamics import centre_of_mass
from backend.stability.polygon import Polygon, polygon
from backend.stability.records import Stability
from backend.stability.state import models
from backend.stability.zmp import edge_distances, margin, share

SIDES = ("front", "left", "rear", "right")


def footing(points: Array, yaw: float, origin: Array) -> Polygon | None:
    """The hull of points (k, 3) in the site frame, seen from above, in a level frame at `origin`
    (3,) with x along `yaw` [rad]; None where it has no area.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    flat = (np.asarray(points, dtype=float) - origin)[:, :2] @ np.array([[c, -s], [s, c]])
    try:
        corners = flat[ConvexHull(flat).vertices]
        made = polygon(corners)
    except (QhullError, InputError, ValueError):
        return None
    return Polygon(made.vertices, tuple(_side(*normal) for normal in -made.normals))


def _side(x: float, y: float) -> str:
    return SIDES[round(2.0 * math.atan2(y, x) / math.pi) % 4]


def standing_on(
    machine: Machine, payload: float, q: Array, T_site_root: Array, yaw: float, points: Array
) -> Stability:
    """At rest in q (n,) [rad] on points (k, 3) of the site [m]; the masses must be known.

    The record's polygon and point are in the level frame of `footing`, at the root.
    """
    support = footing(points, yaw, T_site_root[:3, 3])
    if support is None:
        return Stability("what it stands on has no area")
    model, _ = models(ByIdentity(machine), payload)
    com = apply(T_site_root, centre_of_mass(model, np.asarray(q, dtype=float))[None])[0]
    c, s = math.cos(yaw), math.sin(yaw)
    x, y = (com - T_site_root[:3, 3])[:2]
    point = np.array([c * x + s * y, c * y - s * x])
    return Stability(
        reason="",
        payload=payload,
        support=support,
        zmp=point,
        margin=float(margin(point, support)),
        sigma=0.0,
        share=float(share(point, support)),
        edge=support.names[int(np.argmin(edge_distances(point, support) / support.inradii))],
        critical_lift=math.inf,
        critical_swing=math.inf,
    )
