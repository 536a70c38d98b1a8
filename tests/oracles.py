"""Independent judges for tests: nothing here uses the project's own geometry."""

from __future__ import annotations

from itertools import product
from typing import Any

import coal
import numpy as np


def coal_box(body: dict[str, Any], origin: np.ndarray) -> tuple[coal.Box, coal.Transform3s]:
    """A body of the assess document as a coal shape, near the origin."""
    return coal.Box(*(2 * np.array(body["half_extents"]))), coal.Transform3s(
        np.array(body["rotation"]), np.array(body["center"]) - origin
    )


def coal_closest(a: list[dict[str, Any]], b: list[dict[str, Any]]) -> float:
    """Smallest distance of two lists of bodies by coal, on every pair [m]; <= 0 on overlap."""
    origin = np.array(a[0]["center"])
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    request.epa_tolerance = 1e-9
    shapes_a = [coal_box(body, origin) for body in a]
    shapes_b = [coal_box(body, origin) for body in b]
    return min(
        float(coal.distance(sa, ta, sb, tb, request, coal.DistanceResult()))
        for (sa, ta), (sb, tb) in product(shapes_a, shapes_b)
    )
