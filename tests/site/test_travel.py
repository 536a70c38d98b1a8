"""A site's tracks as ways for machines on rails: frames, names, and heights that nobody tells."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.errors import InputError
from backend.gauge.centreline import InFrame, LineThroughPoints
from backend.site.site import Site, parse_site
from backend.site.travel import site_ways, way_called

ORIGIN = [25496700.0, 6673700.0, 3.0]
CSV = """name,east,north,height,kind
T9,25496700,6673700,4,track
T9,25496760,6673700,4,track
T8,25496700,6673710,,track
T8,25496760,6673710,,track
"""
TRACK = {
    "name": "T1",
    "points": [[25496700.0, 6673690.0, 5.0], [25496700.0, 6673750.0, 5.0]],
    "cant": [0.15],
    "gauge": 1.428,
    "pivot": "centre",
}


def site(folder: Path, **source: Any) -> Site:
    (folder / "lines.csv").write_text(CSV)
    table = {
        "name": "yard",
        "frame": {"epsg": 3879, "origin": ORIGIN},
        "machine": [{"name": "a", "model": "mini"}],
        "gauge": {"track": [TRACK], "source": [{"file": "lines.csv", **source}], "radius": 80.0},
    }
    return parse_site(table, folder / "yard.toml")


def test_a_way_has_the_tracks_frame_with_its_cant(tmp_path: Path) -> None:
    way = way_called(site_ways(site(tmp_path)), "T1")
    assert way.length == pytest.approx(60.0)
    T = way.frames(np.array([20.0]))[0]
    np.testing.assert_allclose(T[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)  # northwards
    # The left rail, in the west, is 0.15 m higher over 1.5 m: asin 0.1.
    np.testing.assert_allclose(T[:3, 1], [-math.cos(math.asin(0.1)), 0.0, 0.1], atol=1e-12)
    np.testing.assert_allclose(T[:3, 3], [0.0, 10.0, 2.0], atol=1e-9)
    assert way.nearest(np.array([1.2, 20.0, 2.0])) == pytest.approx((30.0, 1.2))
    assert way.nearest(np.array([0.0, 99.0, 2.0])) == pytest.approx((60.0, 49.0))


def test_heights_that_nobody_tells_stay_unknown(tmp_path: Path) -> None:
    s = np.array([0.0, 30.0])
    ways = {way.name: way for way in site_ways(site(tmp_path))}
    np.testing.assert_allclose(ways["T9"].frames(s)[:, :3, 3], [[0, 0, 1], [30, 0, 1]], atol=1e-9)
    assert np.isnan(ways["T8"].frames(s)).all()
    assert ways["T8"].nearest(np.array([12.0, 11.0, 0.0])) == pytest.approx((12.0, 1.0))
    told = {way.name: way for way in site_ways(site(tmp_path, height=6.0))}
    np.testing.assert_allclose(told["T8"].frames(s)[:, 2, 3], 3.0)


def test_limits_are_known_within_the_radius_less_the_reach(tmp_path: Path) -> None:
    known = way_called(site_ways(site(tmp_path)), "T1").known(10.0)
    at = np.array([[69.0, 0.0, 0.0], [0.0, -71.0, 0.0], [50.0, 50.0, 0.0]])
    np.testing.assert_array_equal(known(at), [True, False, False])


def test_an_unknown_name_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='"T7"; allowed are T1, T9, T8'):
        way_called(site_ways(site(tmp_path)), "T7")
    with pytest.raises(InputError, match="the site has no track"):
        way_called((), "T1")


def test_a_line_as_told_has_only_its_own_heights() -> None:
    flat = LineThroughPoints("L", np.array([[0.0, 0.0, 7.0], [50.0, 0.0, 7.0]]))
    line = InFrame(flat, np.array([0.0, 0.0, 2.0]), 1.0, assumed=True)
    line.name = "renamed"
    told = line.as_told()
    assert told.name == "renamed"
    assert told.at(np.array([5.0])).xyz[0, 2] == pytest.approx(5.0)
