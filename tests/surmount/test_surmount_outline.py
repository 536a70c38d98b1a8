"""The crawler's and the bodies' distances to a step against shapely's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, MultiPoint, Polygon

from backend.errors import InputError
from backend.surmount.outline import belt_clearance, body_clearance, leans

FAR = 50.0


def ground(h: float) -> Polygon:
    return Polygon([(0.0, h), (FAR, h), (FAR, -FAR), (0.0, -FAR)])


@settings(max_examples=200, deadline=None)
@given(
    st.floats(-2.0, 2.0),
    st.floats(-0.5, 1.5),
    st.floats(-1.2, 1.2),
    st.floats(0.05, 0.6),
)
def test_belt_clearance(x: float, z: float, alpha: float, h: float) -> None:
    a, r = 0.6, 0.2
    u, n = np.array([np.cos(alpha), np.sin(alpha)]), np.array([-np.sin(alpha), np.cos(alpha)])
    middle = np.array([x, z]) + r * n
    axis = LineString([middle - a * u, middle + a * u])
    apart = axis.distance(ground(h))
    found = float(belt_clearance(np.array([x]), np.array([z]), np.array([alpha]), h, a, r)[0])
    if apart > 0.0:
        assert found == pytest.approx(apart - r, abs=1e-9)
    else:
        assert found <= -r + 1e-9


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10_000))
def test_body_clearance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1.0, 1.0, (8, 2)) * rng.uniform(0.1, 1.0, 2) + rng.uniform(-1.0, 1.5, 2)
    h = float(rng.uniform(0.05, 0.6))
    found = float(body_clearance(corners[None], h)[0])
    hull = MultiPoint(corners).convex_hull
    all_ground = Polygon([(-FAR, 0.0), (0.0, 0.0), (0.0, h), (FAR, h), (FAR, -FAR), (-FAR, -FAR)])
    apart = hull.distance(all_ground)
    if apart > 0.0:
        assert found == pytest.approx(apart, abs=1e-9)
    else:
        assert found <= 1e-9


def test_steps_that_are_too_high_for_the_crawler() -> None:
    with pytest.raises(InputError, match="higher than the crawler can lean on"):
        leans(5.0, 0.5, 0.2)
