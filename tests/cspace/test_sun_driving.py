"""Eqs. (4)-(11): the printed samples, the zone's outline and its distance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.cspace.sun import SunPose
from backend.cspace.sun_driving import (
    co_xy,
    in_free,
    length_samples,
    link_points,
    offset_points,
    warning_zone,
    yaw_samples,
    zone_distance,
)

Make = Callable[..., SunPose]
coordinate = st.floats(-50.0, 50.0)
angle = st.floats(-7.0, 7.0)
length = st.floats(3.1, 9.0)
width = st.floats(0.0, 1.0)


def test_samples_of_the_papers_examples() -> None:
    theta = yaw_samples(10)
    assert len(theta) == 11
    assert theta[[0, 5, 10]] == pytest.approx([0.0, np.pi, 2 * np.pi])
    d = length_samples(4.0, 10)
    assert len(d) == 11
    assert d[[0, 5, 10]] == pytest.approx([0.0, 2.0, 4.0])


def test_sides_are_eta_left_and_right_of_the_arm() -> None:
    p = link_points(np.array([5.0, 6.0]), np.pi / 2, np.array([0.0, 2.0]))
    assert p == pytest.approx(np.array([[5.0, 6.0], [5.0, 8.0]]))
    left = offset_points(np.pi / 2, np.array([0.0, 2.0]), 0.1)
    assert left == pytest.approx(np.array([[-0.1, 0.0], [-0.1, 2.0]]))


def test_matrices_are_the_scalar_loop(straight: Make) -> None:
    a, b = straight(25.0, 25.0, 1.0, 4.0), straight(3.0, 4.0, 2.0, 5.0)
    m, n, eta = 6, 4, 0.1
    x, y = co_xy(a, b, eta, m, n)
    assert x.shape == y.shape == (2, m + 1, n + 1)
    for side, sign in enumerate((1.0, -1.0)):
        for i in range(m + 1):
            for j in range(n + 1):
                s, d_b, theta = a.d * j / n, b.d * j / n, 2 * np.pi * i / m
                x_s = s * np.cos(a.yaw) - sign * eta * np.sin(a.yaw)
                y_s = s * np.sin(a.yaw) + sign * eta * np.cos(a.yaw)
                assert x[side, i, j] == pytest.approx(25.0 + x_s - d_b * np.cos(theta))
                assert y[side, i, j] == pytest.approx(25.0 + y_s - d_b * np.sin(theta))


@settings(max_examples=60, deadline=None)
@given(coordinate, coordinate, angle, length, length, width, st.integers(1, 70))
def test_printed_samples_lie_inside_the_zone(
    straight: Make, x: float, y: float, yaw: float, d_a: float, d_b: float, eta: float, n: int
) -> None:
    a, b = straight(x, y, yaw, d_a), straight(0.0, 0.0, 0.0, d_b)
    points = np.stack(co_xy(a, b, eta, 24, 12), axis=-1)
    assert (zone_distance(a, b.d, eta, points) < 1e-9).all()
    zone = shapely.Polygon(warning_zone(a, b.d, eta, n)).buffer(1e-9)
    assert shapely.contains_xy(zone, *points.reshape(-1, 2).T).all()


def test_printed_index_leaves_part_of_the_zone_out(straight: Make) -> None:
    # Full reach of B at A's foot: possible, yet j = 0 pairs the foot with length 0.
    a, b = straight(0.0, 0.0, 0.0, 4.0), straight(0.0, 0.0, 0.0, 4.0)
    p = np.array([-3.9, 0.0])
    assert not in_free(a, b.d, 0.1, p)
    x, y = co_xy(a, b, 0.1, 360, 100)
    assert np.hypot(x - p[0], y - p[1]).min() > 2.0


@settings(max_examples=60, deadline=None)
@given(coordinate, coordinate, angle, length, length, width, st.integers(1, 200))
def test_outline_contains_the_exact_zone_and_little_more(
    straight: Make, x: float, y: float, yaw: float, d_a: float, d_b: float, eta: float, n: int
) -> None:
    a = straight(x, y, yaw, d_a)
    outline = warning_zone(a, d_b, eta, n)
    edges = 4 * max(1, -(-n // 4))
    assert outline.shape == (edges, 2)
    polygon = shapely.Polygon(outline)
    assert polygon.exterior.is_ccw
    turn = np.linspace(0.0, 2 * np.pi, 400)
    for s, side in ((0.0, eta), (0.0, -eta), (a.d, eta), (a.d, -eta)):
        corner = a.position + offset_points(yaw, np.array([s]), side)
        circle = corner + (d_b - 1e-9) * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        assert shapely.contains_xy(polygon, *circle.T).all()
    largest = d_b * (1.0 / np.cos(np.pi / edges) - 1.0)
    assert zone_distance(a, d_b, eta, outline).max() <= largest + 1e-9
    assert zone_distance(a, d_b, eta, outline).min() >= -1e-9


@settings(max_examples=100, deadline=None)
@given(coordinate, coordinate, angle, length, length, st.floats(0.01, 1.0), coordinate, coordinate)
def test_distance_against_shapely(
    straight: Make,
    x: float,
    y: float,
    yaw: float,
    d_a: float,
    d_b: float,
    eta: float,
    px: float,
    py: float,
) -> None:
    a = straight(x, y, yaw, d_a)
    sides = (
        offset_points(yaw, np.array([0.0, a.d]), eta),
        offset_points(yaw, np.array([a.d, 0.0]), -eta),
    )
    rectangle = shapely.Polygon(a.position + np.concatenate(sides))
    point = shapely.Point(px, py)
    to_edge = rectangle.exterior.distance(point)
    expected = (-to_edge if rectangle.contains(point) else to_edge) - d_b
    p = np.array([px, py])
    assert zone_distance(a, d_b, eta, p) == pytest.approx(expected, abs=1e-9)
    if abs(expected) > 1e-9:
        assert bool(in_free(a, d_b, eta, p)) == (expected > 0.0)


def test_edge_belongs_to_the_obstacle(straight: Make) -> None:
    a = straight(0.0, 0.0, 0.0, 4.0)
    assert not in_free(a, 5.0, 0.5, np.array([9.0, 0.0]))
    assert in_free(a, 5.0, 0.5, np.array([9.0 + 1e-9, 0.0]))


@pytest.mark.parametrize("bad", [0, -3])
def test_counts_below_one_are_refused(straight: Make, bad: int) -> None:
    a = straight(0.0, 0.0, 0.0, 4.0)
    with pytest.raises(ValueError, match="m must be at least 1"):
        co_xy(a, a, 0.1, bad, 5)
    with pytest.raises(ValueError, match="n must be at least 1"):
        co_xy(a, a, 0.1, 5, bad)


@pytest.mark.parametrize("eta", [-0.1, float("nan"), float("inf")])
def test_bad_eta_is_refused(straight: Make, eta: float) -> None:
    a = straight(0.0, 0.0, 0.0, 4.0)
    with pytest.raises(ValueError, match="eta"):
        warning_zone(a, 4.0, eta)
    with pytest.raises(ValueError, match="eta"):
        in_free(a, 4.0, eta, np.zeros(2))
