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


def collides_at(a: Any, b: Any, shifts: np.ndarray) -> np.ndarray:
    """Whether boxes b, moved by each of shifts (k, 2) [m], touch boxes a: 15 separating axes.

    Gottschalk, Lin and Manocha, OBBTree (1996), the condition |axis (ca - cb - t)| <= ra + rb.
    """
    hit = np.zeros(len(shifts), dtype=bool)
    for i, j in product(range(len(a.centers)), range(len(b.centers))):
        Ra, Rb = a.rotations[i], b.rotations[j]
        crossed = np.cross(Ra.T[:, None], Rb.T[None]).reshape(9, 3)
        axes = np.concatenate([Ra.T, Rb.T, crossed])
        axes = axes[np.linalg.norm(axes, axis=1) > 1e-9]
        radii = np.abs(axes @ Ra) @ a.half_extents[i] + np.abs(axes @ Rb) @ b.half_extents[j]
        center = a.centers[i] - b.centers[j]
        size = np.linalg.norm(a.half_extents[i]) + np.linalg.norm(b.half_extents[j])
        if abs(center[2]) > size:
            continue
        near = np.flatnonzero(~hit & (np.hypot(*(center[:2] - shifts).T) <= size))
        apart = np.abs((axes @ center)[None] - shifts[near] @ axes[:, :2].T)
        hit[near[(apart <= radii).all(axis=1)]] = True
    return hit
