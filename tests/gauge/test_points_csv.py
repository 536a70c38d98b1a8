"""Points and lines as CSV; meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from backend.errors import InputError
from backend.gauge.points_csv import parse
from backend.gauge.read import read

ROWS = """name,kind,east,north,height,gauge,cant
T1,track,0,0,10,1.524,0
T1,track,30,40,11,,0.1
T1,track,30,140,12,,
wire,overhead line,5,5,7,,
wire,,9,5,7,,
mast,,3,4,,,
bad,,x,4,1,,
bad,,1e300,4,1,,
short,1
"""


def test_tracks_lines_and_points() -> None:
    model = parse(ROWS.encode(), "p.csv", 3879)
    (track,) = model.alignments
    assert (track.name, track.gauge, track.length) == ("T1", 1.524, pytest.approx(150.0))
    line = track.at(np.array([25.0, 100.0]))
    np.testing.assert_allclose(line.xyz, [[15, 20, 10.5], [30, 90, 11.5]])
    np.testing.assert_allclose(line.cant, [0.05, 0.05])
    wire, mast = model.features
    assert (wire.name, wire.kind, wire.length) == ("wire", "overhead line", 4.0)
    assert mast.lines == ()
    assert mast.points[0, :2].tolist() == [3.0, 4.0]
    assert np.isnan(mast.points[0, 2])
    assert model.crs.epsg == 3879
    assert [s.where for s in model.skipped] == ["row 8", "row 9", "row 10"]


def test_semicolons_and_a_byte_order_mark() -> None:
    model = parse("﻿name;east;north\nA;1;2\nA;4;6\n".encode(), "p.csv")
    assert model.features[0].length == 5.0
    assert any("no CRS" in note for note in model.notes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "allowed are name, east, north"),
        ("name,x,y\nA,1,2\n", "allowed are name, east, north"),
        ("name,east,north,colour\nA,1,2,3\n", "colour"),
        ("name,east,north,east\nA,1,2,3\n", "each once"),
        ("name,east,north\nA,NaN,2\n", "no row with sound coordinates"),
    ],
)
def test_wrong_tables_are_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse(text.encode(), "p.csv")


def test_what_is_no_text_is_refused() -> None:
    with pytest.raises(InputError, match="UTF-8"):
        parse(b"\xff\xfe\x00name", "p.csv")


def test_an_unsound_track_is_skipped_alone() -> None:
    rows = "name,kind,east,north,gauge,cant\n"
    rows += "a,track,0,0,9,\na,track,1,0,,\nb,track,0,0,,2\nb,track,1,0,,\nc,track,0,0,,\n"
    rows += "d,track,0,0,,\nd,track,1,0,,\ne,track,0,0,no,\ne,track,1,0,,\n"
    model = parse(rows.encode(), "p.csv")
    assert [a.name for a in model.alignments] == ["d"]
    assert [s.where for s in model.skipped] == [f'track "{n}"' for n in "abce"]


def test_a_mesh(tmp_path: Path) -> None:
    path = tmp_path / "box.stl"
    trimesh.creation.box((2, 3, 4)).export(path)
    (surface,) = read(path).surfaces
    assert (surface.name, surface.kind) == ("box", "mesh")
    assert surface.points.shape == (8, 3)
    assert surface.area == pytest.approx(2 * (6 + 8 + 12))
    bad = tmp_path / "bad.stl"
    bad.write_bytes(b"solid nothing\n")
    with pytest.raises(InputError):
        read(bad)
