"""The ZMP, margins and the moments of edges, against statics and against each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from momentum import centre
from shapely.geometry import Point
from shapely.geometry import Polygon as Area

from backend.errors import InputError
from backend.stability.dynamics import ground_wrench
from backend.stability.masses import mass_model
from backend.stability.polygon import polygon, shrunk, support_polygon
from backend.stability.zmp import (
    edge_moment_terms,
    edge_moments,
    margin,
    share,
    zmp,
    zmp_of,
)

PENTAGON = np.array([[2.0, -1.0], [2.2, 0.8], [0.0, 1.6], [-1.7, 0.9], [-1.2, -1.1]])


def test_at_rest_on_level_ground_it_is_under_the_centre_of_mass(machine, draw):
    q, _, _ = draw(machine, np.random.default_rng(1), 50)
    got = zmp(mass_model(machine, 120.0), q, 0 * q, 0 * q)
    np.testing.assert_allclose(got, centre(machine, q, 120.0)[:, :2], atol=1e-12)


@pytest.mark.parametrize("attitude", [(0.3, 0.25, 0.0), (-2.0, 0.0, 0.3), (1.0, -0.2, 0.15)])
def test_on_a_slope_it_is_straight_below_the_centre_of_mass(machine, draw, slope, attitude):
    q, _, _ = draw(machine, np.random.default_rng(2), 20)
    T = slope(*attitude)
    got = zmp(mass_model(machine), q, 0 * q, 0 * q, T)
    flat = np.concatenate([got, np.zeros((len(got), 1))], axis=1)
    on_site = flat @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(on_site[:, :2], centre(machine, q, 0.0, T)[:, :2], atol=1e-11)


def test_no_moment_along_the_plane_is_left_about_it(machine, draw, slope):
    motion = draw(machine, np.random.default_rng(3), 30)
    model, T = mass_model(machine), slope(0.0, 0.1, -0.2)
    f, tau = ground_wrench(model, *motion, T)
    x = np.pad(zmp(model, *motion, T), ((0, 0), (0, 1)))
    left = tau - np.cross(x, f)
    np.testing.assert_allclose(left[:, :2], 0.0, atol=1e-8 * np.abs(tau).max())


def test_where_nothing_presses_on_the_ground_there_is_no_zmp(ex13):
    model, q, still = mass_model(ex13), np.array([0.3, 0.2, -1.0, 0.0]), np.zeros(4)
    falling = np.array([0.0, 0.0, -12.0])
    got = zmp_of(ground_wrench(model, q, still, still, base_acceleration=falling))
    assert np.isnan(got).all()
    support = support_polygon(ex13)
    assert margin(got, support) == -np.inf
    assert share(got, support) == -np.inf


def test_margin_is_the_distance_to_the_outline(ex13):
    random = np.random.default_rng(4)
    for corners in (support_polygon(ex13).vertices, PENTAGON):
        support, area = polygon(corners), Area(corners)
        for point in random.uniform(-2.5, 2.5, (200, 2)):
            got, wanted = margin(point, support), area.exterior.distance(Point(point))
            if area.contains(Point(point)):
                assert got == pytest.approx(wanted, abs=1e-12)
            else:
                assert -wanted - 1e-12 <= got < 0.0


def test_share_is_one_in_the_centre_and_nothing_on_an_edge():
    support = polygon(PENTAGON)
    assert share(support.centre, support) == pytest.approx(1.0)
    edges = 0.5 * (support.vertices + np.roll(support.vertices, -1, axis=0))
    np.testing.assert_allclose(share(edges, support), 0.0, atol=1e-12)
    halfway = 0.5 * (edges + support.centre)
    np.testing.assert_allclose(share(halfway, support), 0.5, atol=1e-12)


def test_a_moment_is_force_times_distance_and_its_sign_the_margins(machine, draw, slope):
    motion = draw(machine, np.random.default_rng(5), 200)
    model, support, T = mass_model(machine, 500.0), support_polygon(machine), slope(1.0, 0.1, 0.1)
    moments = edge_moments(model, support, *motion, T)
    at = zmp(model, *motion, T)
    force = ground_wrench(model, *motion, T).f[:, 2]
    pressed = force > 0.0
    distance = moments[pressed] / force[pressed, None]
    np.testing.assert_allclose(distance.min(axis=1), margin(at, support)[pressed], atol=1e-9)
    outside = (moments[pressed] < 0.0).any(axis=1)
    assert outside.any()
    assert not outside.all()


def test_moments_are_affine_in_accelerations_and_quadratic_in_rates(machine, draw):
    q, qd, qdd = draw(machine, np.random.default_rng(6), 20)
    model, support = mass_model(machine), support_polygon(machine)

    def moments(v, a):
        return edge_moments(model, support, q, v, a)

    size = np.abs(moments(qd, qdd)).max()
    middle = 0.5 * (moments(qd, qdd) + moments(qd, -qdd))
    np.testing.assert_allclose(middle, moments(qd, 0 * qdd), atol=1e-10 * size)
    at_rest = moments(0 * qd, qdd)
    np.testing.assert_allclose(
        moments(3.0 * qd, qdd) - at_rest, 9.0 * (moments(qd, qdd) - at_rest), atol=1e-9 * size
    )


def test_terms_along_a_path_are_what_direct_evaluation_gives(machine, draw, slope):
    q, first, second = draw(machine, np.random.default_rng(7), 60)
    model, support, T = mass_model(machine, 90.0), support_polygon(machine), slope(0.2, -0.1, 0.0)
    a, b, c = edge_moment_terms(model, support, q, first, second, T)
    assert a.shape == b.shape == c.shape == (60, 4)
    random = np.random.default_rng(8)
    for _ in range(5):
        sd, sdd = random.uniform(0.0, 2.0, (60, 1)), random.uniform(-2.0, 2.0, (60, 1))
        direct = edge_moments(model, support, q, first * sd, first * sdd + second * sd**2, T)
        np.testing.assert_allclose(
            a * sdd + b * sd**2 + c, direct, atol=1e-10 * np.abs(direct).max()
        )


def test_the_polygon_is_the_tracks_outline(ex13):
    support, tracks = support_polygon(ex13), ex13.tracks
    area = Area(support.vertices)
    assert area.exterior.is_ccw
    assert area.area == pytest.approx(tracks.length * (tracks.gauge + tracks.shoe))
    normals = dict(zip(support.names, support.normals.tolist(), strict=True))
    assert normals["front"] == [-1.0, 0.0]
    assert normals["left"] == [0.0, -1.0]


def test_corners_in_either_order_make_the_same_edges():
    names = ("a", "b", "c", "d", "e")
    one, other = polygon(PENTAGON, names), polygon(PENTAGON[::-1], ("d", "c", "b", "a", "e"))
    assert Area(other.vertices).exterior.is_ccw
    normals = [
        dict(zip(s.names, map(tuple, s.normals.round(12)), strict=True)) for s in (one, other)
    ]
    assert normals[0] == normals[1]


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ([[0, 0], [1, 0]], "three or more"),
        ([[0, 0], [1, 0], [np.nan, 1]], "finite"),
        ([[0, 0], [1, 0], [2, 0]], "area"),
        ([[0, 0], [2, 0], [0.2, 0.2], [0, 2]], "convex"),
        ([[0, 0], [0, 0], [1, 0], [0, 1]], "neighbouring"),
        ("no", "three or more"),
    ],
)
def test_what_is_no_polygon_is_refused_in_a_sentence(corners, said):
    with pytest.raises(InputError, match=said):
        polygon(corners)


def test_a_share_shrinks_every_edge_alike(ex13):
    whole = support_polygon(replace(ex13))
    less = shrunk(whole, 0.25)
    np.testing.assert_allclose(less.inradii, 0.75 * whole.inradii)
    with pytest.raises(InputError, match="share"):
        shrunk(whole, 1.0)
