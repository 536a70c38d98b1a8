"""A real track alignment: what is read agrees with the file's own numbers, and what in the file
disagrees is told."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from backend.gauge.alignment import Alignment
from backend.gauge.elements import Arc, Line
from backend.gauge.read import read
from backend.gauge.records import Conflict, Model

# Type, start station, length, radius and end point (east, north), copied from the file.
ELEMENTS = [
    ("line", 0.0, 617.216021, math.inf, (25496584.501863, 6674323.241168)),
    ("curve", 617.216021, 17.269938, 1360.0, (25496581.182815, 6674340.189049)),
    ("curve", 634.485959, 30.346722, 820.0, (25496574.989356, 6674369.895268)),
]


@pytest.fixture(scope="module")
def model(shared_data: Path) -> Model:
    return read(shared_data / "inframodel" / "testfile_simple.xml")


@pytest.fixture(scope="module")
def track(model: Model) -> Alignment:
    return model.alignments[0]


def test_names_states_and_codes(model: Model, track: Alignment) -> None:
    assert (model.format, model.name) == ("Inframodel 4.0.3", "Geoviite test")
    assert (track.name, track.description, track.state) == ("T1", "T1", "proposed")
    assert track.coding == {"terrainCoding": "111", "terrainCodingDesc": "Pituusmittausraide"}
    assert (track.gauge, track.gauge_stated) == (1.524, True)
    assert model.skipped == ()


def test_elements_agree_to_a_millimetre(track: Alignment) -> None:
    assert len(track.elements) == len(ELEMENTS)
    for element, start, row in zip(track.elements, track.starts, ELEMENTS, strict=True):
        kind, station, length, radius, end = row
        assert element.kind == kind
        assert start == pytest.approx(station, abs=1e-3)
        assert element.length == pytest.approx(length, abs=1e-3)
        np.testing.assert_allclose(element.end, end, rtol=0, atol=1e-3)
        np.testing.assert_allclose(track.plan(np.array([station + length]))[0], [end], atol=1e-3)
        if isinstance(element, Arc):
            assert element.radius == pytest.approx(radius, abs=1e-3)
        else:
            assert isinstance(element, Line)
    assert track.length == pytest.approx(sum(row[2] for row in ELEMENTS), abs=1e-3)


def test_the_direction_is_387_grads_clockwise_from_north(track: Alignment) -> None:
    heading = track.at(np.array([100.0])).heading[0]
    assert math.pi / 2 - heading == pytest.approx(
        387.284143 * math.pi / 200 - 2 * math.pi, abs=1e-6
    )


def test_it_bends_first_right_then_left(track: Alignment) -> None:
    bend = track.at(np.array([600.0, 625.0, 650.0])).curvature
    np.testing.assert_allclose(bend, [0.0, -1 / 1360, 1 / 820], rtol=1e-6)


def test_joints_are_continuous(track: Alignment) -> None:
    for joint in track.starts[1:]:
        line = track.at(np.array([joint - 1e-9, joint + 1e-9]))
        assert np.linalg.norm(line.xyz[1] - line.xyz[0]) < 1e-3
        assert abs(line.heading[1] - line.heading[0]) < 1e-4


def test_stations_and_posts(track: Alignment) -> None:
    assert track.stations.address(304.954785) == ("1", pytest.approx(0.0, abs=1e-6))
    assert track.stations.address(2247.612517) == ("2", pytest.approx(941.8, abs=1e-3))
    assert track.stations.address(0.0) == ("0", pytest.approx(698.486))
    assert math.isnan(track.stations.equations[0].back)


def test_heights_run_through_the_files_points(track: Alignment) -> None:
    z, gradient = track.height(np.array([0.0, 600.0, 2372.489079]))
    rise = (21.937 - 3.48) / (2247.612517 - 169.514)
    assert z == pytest.approx([3.48, 3.48 + rise * (600 - 169.514), 22.889808], abs=1e-6)
    assert gradient[1] == pytest.approx(rise)


def test_what_disagrees_is_told_with_both_numbers(model: Model) -> None:
    def told(word: str) -> Conflict:
        (found,) = [c for c in model.conflicts if word in c.what]
        return found

    assert len(model.conflicts) == 4
    length = told("sum of the elements")
    assert (length.stated, length.used) == (2372.489079, pytest.approx(664.832681, abs=1e-5))
    assert told("radius of the vertical").stated == 50000.0
    assert told("length of the vertical").stated == 27.241469
    code = told("EPSG code")
    assert code.stated == "EPSG:2392 (KKJ / Finland zone 2)"
    assert code.used == "EPSG:3879 (ETRS89 / GK25FIN)"
    assert (model.crs.epsg, model.crs.source, model.crs.heights) == (3879, "name", "N2000")


def test_the_site_decides_the_crs(shared_data: Path) -> None:
    model = read(shared_data / "inframodel" / "testfile_simple.xml", 3880)
    assert (model.crs.epsg, model.crs.source) == (3880, "site")
    assert any("the site decides" in c.what for c in model.conflicts)
