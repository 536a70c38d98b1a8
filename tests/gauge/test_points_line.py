"""Centrelines through points."""

from __future__ import annotations

import numpy as np
import pytest
from track_curves import circle

from backend.errors import InputError
from backend.gauge.centreline import LineThroughPoints


def test_two_points_are_a_straight() -> None:
    line = LineThroughPoints("T", np.array([[0.0, 0.0, 1.0], [30.0, 40.0, 2.0]]), 0.05, state="x")
    assert (line.name, line.state, line.length) == ("T", "x", 50.0)
    at = line.at(np.array([0.0, 25.0]))
    np.testing.assert_allclose(at.xyz, [[0.0, 0.0, 1.0], [15.0, 20.0, 1.5]], atol=1e-12)
    np.testing.assert_allclose(at.heading, np.arctan2(4.0, 3.0))
    np.testing.assert_allclose(at.gradient, 0.02)
    np.testing.assert_allclose(at.cant, 0.05)
    np.testing.assert_allclose(at.curvature, 0.0, atol=1e-12)


@pytest.mark.parametrize("radius", [300.0, -500.0])
def test_a_circle_is_followed_far_better_than_by_chords(radius: float) -> None:
    s = np.linspace(0.0, 200.0, 11)
    x, y, _, _ = circle(radius)(s)
    line = LineThroughPoints("T", np.stack([x, y, 0.01 * s], axis=1), 0.001 * s)
    u = np.linspace(0.0, line.length, 500)
    at = line.at(u)
    off = np.linalg.norm(at.xyz[:, :2] - [0.0, radius], axis=1) - abs(radius)
    # Chords would be off by 20^2 / (8 R): 167 mm and 100 mm.
    assert np.abs(off).max() < 0.5e-3
    middle = (u > 40.0) & (u < 160.0)
    assert np.abs(off[middle]).max() < 2.0 * 20.0**4 / (384.0 * abs(radius) ** 3)
    np.testing.assert_allclose(at.curvature[middle], 1.0 / radius, rtol=5e-3)
    np.testing.assert_allclose(at.gradient, 0.01, rtol=1e-3)
    np.testing.assert_allclose(np.gradient(np.unwrap(at.heading), u)[middle], 1 / radius, rtol=5e-3)
    np.testing.assert_allclose(at.cant, 0.001 * u * 200.0 / line.length, atol=1e-9)


@pytest.mark.parametrize(
    ("points", "cant"),
    [
        ([[0.0, 0.0, 0.0]], 0.0),
        ([[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]], 0.0),
        ([[0.0, 0.0], [1.0, 0.0]], 0.0),
        ([[0.0, 0.0, 0.0], [1.0, 0.0, np.inf]], 0.0),
        ([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]], [0.0, 0.1, 0.2]),
    ],
)
def test_what_is_no_line_is_refused(points: list[list[float]], cant: float | list[float]) -> None:
    with pytest.raises(InputError, match=r"^T: .*\.$"):
        LineThroughPoints("T", np.array(points), np.array(cant))
