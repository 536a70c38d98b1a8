from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod, Proj

from backend.errors import InputError
from backend.fusion.crs import SiteFrame

ORIGIN = (308600.0, 4129950.0, 12.0)
FRAME = SiteFrame(32652, ORIGIN, geoid_offset=23.5, heading_reference="true")
near = st.floats(-2000.0, 2000.0)


def test_convergence_at_suns_site() -> None:
    # Sun 2020, Table 4: machine A
    point = FRAME.from_projected(np.array([308611.05, 4129957.348, 0.0]))
    convergence = FRAME.convergence(point)
    assert math.degrees(convergence) == pytest.approx(-1.31, abs=0.005)
    # 0.10 m at full reach
    assert 4.371 * abs(convergence) == pytest.approx(0.10, abs=0.001)


def test_heading_from_true_north_is_corrected_to_the_grid() -> None:
    point = np.zeros(3)
    latitude, longitude, height = FRAME.to_geodetic(point)
    north = FRAME.from_geodetic(latitude + 1e-4, longitude, height)
    measured = math.atan2(north[1], north[0])
    assert FRAME.grid_yaw(math.pi / 2, point) == pytest.approx(measured, abs=1e-6)
    assert SiteFrame(32652, ORIGIN).grid_yaw(0.7, point) == 0.7


@given(east=st.floats(-150e3, 150e3), north=st.floats(-1e6, 1e6))
@settings(max_examples=50, deadline=None)
def test_convergence_agrees_with_proj_factors(east: float, north: float) -> None:
    point = np.array([east, north, 0.0])
    latitude, longitude, _ = FRAME.to_geodetic(point)
    factors = Proj("EPSG:32652").get_factors(longitude, latitude)
    assert math.degrees(FRAME.convergence(point)) == pytest.approx(
        factors.meridian_convergence, abs=1e-5
    )


@given(east=near, north=near, up=st.floats(-100.0, 1000.0))
@settings(max_examples=50, deadline=None)
def test_round_trips(east: float, north: float, up: float) -> None:
    point = np.array([east, north, up])
    back = FRAME.from_geodetic(*FRAME.to_geodetic(point))
    np.testing.assert_allclose(back, point, atol=1e-6)
    np.testing.assert_allclose(FRAME.from_projected(FRAME.to_projected(point)), point, atol=1e-8)


def test_many_points_are_the_single_ones() -> None:
    points = np.random.default_rng(1).uniform(-500.0, 500.0, (4, 5, 3))
    geodetic = FRAME.to_geodetic_many(points)
    assert geodetic.shape == points.shape
    np.testing.assert_allclose(geodetic[2, 3], FRAME.to_geodetic(points[2, 3]), atol=1e-12)
    np.testing.assert_allclose(FRAME.from_geodetic_many(geodetic), points, atol=1e-6)


def test_heights_use_the_stated_geoid_offset() -> None:
    latitude, longitude, height = FRAME.to_geodetic(np.zeros(3))
    assert height == pytest.approx(12.0 + 23.5)
    assert FRAME.from_geodetic(latitude, longitude, 40.0)[2] == pytest.approx(40.0 - 23.5 - 12.0)


@pytest.mark.parametrize(("boundary", "easting"), [(126.0, 234000.0), (132.0, 766000.0)])
def test_no_jump_where_utm_zones_meet(boundary: float, easting: float) -> None:
    frame = SiteFrame(32652, (easting, 4129950.0, 0.0))
    latitude = frame.to_geodetic(np.zeros(3))[0]
    longitudes = boundary + np.linspace(-50e-5, 50e-5, 101)
    points = np.array([frame.from_geodetic(latitude, lon, 0.0) for lon in longitudes])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    true = Geod(ellps="WGS84").inv(boundary, latitude, boundary + 1e-5, latitude)[2]
    assert np.abs(steps - true).max() < 0.01
    assert np.ptp(steps) < 1e-6


def test_scale_is_that_of_the_projection() -> None:
    factors = Proj("EPSG:32652").get_factors(*FRAME.to_geodetic(np.zeros(3))[1::-1])
    assert FRAME.scale == pytest.approx(factors.meridional_scale, abs=2e-6)


def test_northing_first_crs_takes_easting_first() -> None:
    # EPSG:3879 lists north before east; the site file always says easting, northing.
    frame = SiteFrame(3879, (25_500_000.0, 6_672_000.0, 0.0))
    assert frame.to_geodetic(np.zeros(3))[1] == pytest.approx(25.0, abs=1e-6)


@pytest.mark.parametrize(
    ("epsg", "origin", "words"),
    [
        (4326, ORIGIN, "geographic"),
        (4978, ORIGIN, "geocentric"),
        (999999, ORIGIN, "not a known"),
        (0, ORIGIN, "not a known"),
        (2272, (820000.0, 75000.0, 0.0), "US survey foot"),
        (2048, (0.0, 0.0, 0.0), "west"),
        (3857, ORIGIN, "1.2"),
        (3879, ORIGIN, "outside the area"),
        (32652, (1e9, 0.0, 0.0), "outside the area"),
        (32652, (math.nan, 0.0, 0.0), "finite"),
    ],
)
def test_unusable_frames_are_refused(
    epsg: int, origin: tuple[float, float, float], words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        SiteFrame(epsg, origin)
    assert "allowed" in str(caught.value)


def test_other_fields_are_checked() -> None:
    with pytest.raises(InputError, match="heading_reference"):
        SiteFrame(32652, ORIGIN, heading_reference="magnetic")
    with pytest.raises(InputError, match="geoid_offset"):
        SiteFrame(32652, ORIGIN, geoid_offset=300.0)
