"""Centrelines with closed formulas, for tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import fresnel

from backend.gauge.centreline import PointStations
from backend.spatial.types import Array

Profile = Callable[[Array], Array]


def constant(value: float) -> Profile:
    return lambda s: np.full(len(s), value)


NONE = constant(0.0)


@dataclass(frozen=True)
class Curve:
    """plan: s (k,) -> x, y, heading, curvature (k,) each; height, gradient, cant: s -> (k,)."""

    name: str
    length: float
    plan: Callable[[Array], tuple[Array, Array, Array, Array]]
    height: Profile = NONE
    gradient: Profile = NONE
    cant: Profile = NONE
    state: str = "existing"
    gauge: float = 1.435

    def at(self, s: Array) -> PointStations:
        x, y, heading, curvature = self.plan(s)
        xyz = np.stack([x, y, self.height(s)], axis=1)
        return PointStations(xyz, heading, self.gradient(s), self.cant(s), curvature)


def straight(heading: float = 0.0) -> Callable[[Array], tuple[Array, Array, Array, Array]]:
    c, s_ = np.cos(heading), np.sin(heading)
    return lambda s: (c * s, s_ * s, np.full(len(s), heading), np.zeros(len(s)))


def circle(radius: float) -> Callable[[Array], tuple[Array, Array, Array, Array]]:
    """From the origin eastwards; to the left for a positive radius."""

    def plan(s: Array) -> tuple[Array, Array, Array, Array]:
        a = s / radius
        return radius * np.sin(a), radius * (1.0 - np.cos(a)), a, np.full(len(s), 1.0 / radius)

    return plan


def clothoid(a: float) -> Callable[[Array], tuple[Array, Array, Array, Array]]:
    """Curvature s / a^2, from the origin eastwards."""

    def plan(s: Array) -> tuple[Array, Array, Array, Array]:
        scale = a * np.sqrt(np.pi)
        sine, cosine = fresnel(s / scale)
        return scale * cosine, scale * sine, s**2 / (2.0 * a**2), s / a**2

    return plan
