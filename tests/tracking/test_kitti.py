"""KITTI tracking labels: boxes into the tracker's frame, and what is wrong with its line."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from program import cockpit

from backend.errors import InputError
from backend.tracking.kitti import read_kitti
from backend.tracking.records import MEASURED

LINE = (
    "0 1 Pedestrian 0 0 -1.793451 296.744956 161.752147 455.226042 292.372804 2.000000 1.823255 "
    "4.433886 -4.552284 1.858523 13.410495 -2.115488"
)
IGNORED = "0 -1 DontCare -1 -1 -10.0 219.3 188.5 245.5 218.6 -1000 -1000 -1000 -10 -1 -1 -1"


def test_a_box_is_where_the_camera_sees_it() -> None:
    (scan,) = read_kitti(f"{LINE}\n{IGNORED}\n", "0000.txt")
    assert scan.measured == MEASURED
    x, y, z, yaw, *size = scan.values[0]
    assert (x, y) == (13.410495, 4.552284)  # ahead, and on the left
    assert z == pytest.approx(-1.858523 + 1.0)  # the middle, half its height over its bottom
    assert size == [4.433886, 1.823255, 2.0]
    # The object's length in the camera's frame, turned about the camera's y axis (down).
    c, s = np.cos(-2.115488), np.sin(-2.115488)
    right, _, ahead = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose([np.cos(yaw), np.sin(yaw)], [ahead, -right], atol=1e-12)


def test_frames_without_anybody_are_scans_too() -> None:
    later = LINE.replace("0 1 Ped", "3 1 Ped", 1) + " 0.93"  # a result, with its score
    scans = read_kitti(f"{later}\n\n{LINE}\n{IGNORED.replace('0', '2', 1)}\n", "a", period=0.5)
    assert [(scan.time, len(scan.values)) for scan in scans] == [(0, 1), (0.5, 0), (1, 0), (1.5, 1)]


def walkers() -> str:
    """Two people who cross before the camera, at 10 Hz."""
    lines = []
    for k in range(40):
        t = 0.1 * k
        for who, (x, z, ry) in enumerate([(-2 + t, 10.0, 0.0), (2 - t, 11.0, np.pi)]):
            lines.append(
                f"{k} {who} Pedestrian 0 0 0 1 1 2 2 1.8 0.6 0.8 {x:.4f} 1.6 {z:.4f} {ry:.4f}"
            )
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("name", "option"), [("0000.txt", ()), ("labels", ("--kitti",))])
def test_labels_in_and_tracks_out(tmp_path: Path, name: str, option: tuple[str, ...]) -> None:
    source = tmp_path / name
    source.write_text(walkers())
    done = cockpit("track", str(source), *option)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    last = {row["track"]: row for row in rows if row["time"] == "3.9"}
    assert set(last) == {"1", "2"} == {row["track"] for row in rows}
    assert {row["status"] for row in last.values()} == {"confirmed"}
    left, right = sorted(last.values(), key=lambda row: -float(row["y"]))
    assert [float(left[c]) for c in ("x", "y", "vy")] == pytest.approx([11.0, 1.9, 1.0], abs=0.1)
    assert [float(right[c]) for c in ("x", "y", "vy")] == pytest.approx([10.0, -1.9, -1.0], abs=0.1)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "has no line; needed are KITTI tracking labels"),
        ("0 1 Car\n", "line 1: has 3 words; a KITTI tracking label has 17, or 18"),
        (LINE + "\n" + LINE.replace("0 1 Ped", "x 1 Ped"), "line 2: the frame is 'x'"),
        (LINE.replace("0 1", "1000000000000 1", 1), "allowed is 0 to 99999"),
        (LINE.replace("0 1", "-1 1", 1), "line 1: the frame is '-1'"),
        (LINE.replace("Pedestrian", "Digger"), "the type is 'Digger'; allowed are Car, Van"),
        (LINE.replace("13.410495", "nan"), "z is 'nan'; allowed is a finite number"),
        (LINE.replace("-2.115488", "west"), "rotation_y is 'west'"),
        (LINE.replace("2.000000", "-1"), "height is '-1'; allowed is above 0"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text: str, says: str) -> None:
    with pytest.raises(InputError, match=r"^0000\.txt") as error:
        read_kitti(text, "0000.txt")
    assert says in str(error.value)


@given(st.integers(0, len(LINE) - 1), st.characters(codec="utf-8"))
def test_a_damaged_label_is_boxes_or_one_sentence(at: int, letter: str) -> None:
    text = LINE[:at] + letter + LINE[at + 1 :]
    said, scans = "", []
    try:
        scans = read_kitti(text, "a")
    except InputError as error:
        said = str(error)
    assert "\n" not in said
    assert bool(said) != bool(scans)
    assert all(np.isfinite(scan.values).all() for scan in scans)


def test_the_program_says_it_too(tmp_path: Path) -> None:
    source = tmp_path / "0001.txt"
    source.write_text(LINE[:50])
    done = cockpit("track", str(source))
    assert done.returncode == 2
    assert "line 1: has" in done.stderr
    source.write_text(LINE)
    assert "--period" in cockpit("track", str(source), "--period", "0").stderr
