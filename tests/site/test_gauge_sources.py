"""Files of features named in a site file become limit volumes of the site."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.errors import InputError
from backend.gauge.features import Buried, Overhead, Pole, Track
from backend.site.bodies import site_bodies
from backend.site.gauge_sources import source_features
from backend.site.site import Site, parse_site

ORIGIN = [25496706.0, 6673718.0, 3.0]
CSV = """name,east,north,height,kind
wire,25496700,6673710,12,line
wire,25496760,6673710,12,line
cable,25496700,6673730,2,line
cable,25496760,6673730,2,line
mast,25496720,6673725,3,points
loose,25496700,6673740,,line
loose,25496760,6673740,,line
T9,25496700,6673700,3,track
T9,25496760,6673700,3,track
"""


def site(folder: Path, *sources: dict[str, Any], **gauge: Any) -> Site:
    table = {
        "name": "yard",
        "frame": {"epsg": 3879, "origin": ORIGIN},
        "machine": [{"name": "a", "model": "mini"}, {"name": "b", "model": "mini"}],
        "gauge": {"source": list(sources), **gauge},
    }
    return parse_site(table, folder / "yard.toml")


@pytest.fixture
def csv(tmp_path: Path) -> Path:
    (tmp_path / "lines.csv").write_text(CSV)
    return tmp_path


def test_lines_and_points_count_as_the_site_file_says(csv: Path) -> None:
    source = {
        "file": "lines.csv",
        "overhead": ["wire"],
        "buried": ["cable"],
        "poles": ["mast"],
        "pole_height": 7.0,
    }
    found = {f.name: f for f in source_features(site(csv, source))}
    assert {name: type(f) for name, f in found.items()} == {
        "T9": Track,
        "wire": Overhead,
        "cable": Buried,
        "mast": Pole,
    }
    wire, mast = found["wire"], found["mast"]
    assert isinstance(wire, Overhead)
    assert isinstance(mast, Pole)
    np.testing.assert_allclose(wire.points, [[-6, -8, 9], [54, -8, 9]])
    np.testing.assert_allclose(mast.base, [14, 7, 0])
    assert mast.height == 7.0
    bodies = site_bodies(site(csv, source))
    assert {n.split("/")[0] for n in bodies.names} == {f"gauge:{name}" for name in found}
    # The wire's volume reaches 1 m below and 3 m beside it (Mäkinen 2021, Section 2.1.2).
    volume = next(v for v in bodies.volumes if v.name == "wire")
    inside = volume.contains(np.array([[20.0, -8.0, 8.01], [20.0, -10.99, 9.0]]))
    outside = volume.contains(np.array([[20.0, -8.0, 7.97], [20.0, -11.03, 9.0]]))
    assert inside.all()
    assert not outside.any()


def test_names_that_are_there_twice_get_a_number(csv: Path) -> None:
    twice = {"file": "lines.csv", "buried": []}
    names = [f.name for f in source_features(site(csv, twice, twice))]
    assert names == ["T9", "T9 (2)"]


def test_the_site_switches_a_proposed_track_on(tmp_path: Path, shared_data: Path) -> None:
    shutil.copy(shared_data / "inframodel" / "testfile_simple.xml", tmp_path / "line.xml")
    source = {"file": "line.xml"}
    off = site_bodies(site(tmp_path, source))
    (volume,) = off.volumes
    assert (volume.name, volume.kind, len(off.boxes)) == ("T1", "track", 0)
    assert "proposed" in off.idle["T1"]
    on = site_bodies(site(tmp_path, source, on=["T1"]))
    assert on.idle == {}
    assert len(on.boxes) > 0
    # 1.845 m to the side of the line's start, which leads 387.284 gon from north.
    heading = np.pi / 2 - np.radians(387.284143 * 0.9)
    along = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-along[1], along[0]])
    start = np.array([25496706.966606, 6673718.296540]) - ORIGIN[:2] + 5.0 * along
    z = 3.48 - ORIGIN[2] + 1.0
    near, far = ([*(start + side * left), z] for side in (1.84, 1.88))
    np.testing.assert_array_equal(on.volumes[0].contains(np.array([near, far])), [True, False])


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ({"file": "nothing.xml"}, ["nothing.xml", "does not exist", "LandXML"]),
        ({"file": "lines.csv", "epsg": 3067}, ["3067", "3879"]),
        ({"file": "lines.txt"}, ["lines.txt", "known format"]),
        ({"file": "lines.csv", "diameter": -1.0}, ["diameter"]),
    ],
)
def test_a_wrong_source_is_one_sentence(
    csv: Path, source: dict[str, Any], words: list[str]
) -> None:
    (csv / "lines.txt").write_text("x")
    with pytest.raises(InputError) as caught:
        source_features(site(csv, source))
    assert all(word in str(caught.value) for word in words)
    assert len(str(caught.value).splitlines()) == 1


def test_a_file_in_another_crs_is_refused(tmp_path: Path, shared_data: Path) -> None:
    shutil.copy(shared_data / "inframodel" / "testfile_simple.xml", tmp_path / "line.xml")
    table = {
        "name": "yard",
        "frame": {"epsg": 3067, "origin": [385000.0, 6673000.0, 0.0]},
        "machine": [{"name": "a", "model": "mini"}, {"name": "b", "model": "mini"}],
        "gauge": {"source": [{"file": "line.xml"}]},
    }
    with pytest.raises(InputError, match="3879"):
        source_features(parse_site(table, tmp_path / "yard.toml"))
