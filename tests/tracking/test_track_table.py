"""`cockpit track`: tables in, tables out, and what is wrong is said with its line."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from backend.errors import InputError
from backend.tracking.table import HEADER, followed, read, rows_of
from cockpit.cli import app


def walker() -> str:
    """Two people, one of whom hides for a second, and a scan without anybody."""
    rng = np.random.default_rng(0)
    lines = ["time,x,y,z"]
    for k in range(60):
        t = 0.1 * k
        places = (
            [(1.2 * t, 0.0, 0.9)] if 20 < k < 30 else [(1.2 * t, 0.0, 0.9), (3.0, 5.0 - t, 0.8)]
        )
        if k == 40:
            lines.append(f"{t:.1f},,,")
            continue
        seen = rng.permutation(places) + rng.normal(scale=0.03, size=(len(places), 3))
        lines += [f"{t:.1f},{x:.3f},{y:.3f},{z:.3f}" for x, y, z in seen]
    return "\n".join(lines) + "\n"


def test_from_file_to_file(tmp_path: Path) -> None:
    source, out = tmp_path / "in.csv", tmp_path / "out.csv"
    source.write_text(walker())
    done = CliRunner().invoke(app, ["track", str(source), "--out", str(out)])
    assert done.exit_code == 0, done.output
    rows = list(csv.DictReader(io.StringIO(out.read_text())))
    assert list(rows[0]) == HEADER
    last = {row["track"]: row for row in rows if float(row["time"]) == 5.9}
    assert set(last) == {"1", "2"}
    assert {row["status"] for row in last.values()} == {"confirmed"}
    assert {row["status"] for row in rows if row["time"] == "2.5"} == {"confirmed", "coasting"}
    assert {row["status"] for row in rows if row["time"] == "4"} == {"coasting"}
    ahead = min(last.values(), key=lambda row: abs(float(row["y"])))
    assert float(ahead["x_1s"]) == pytest.approx(1.2 * 6.9, abs=0.3)
    assert float(ahead["z_1s"]) == pytest.approx(0.9, abs=0.3)


def test_printed_without_a_file(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    source.write_text("time,x,y\n0,1,2\n")
    done = CliRunner().invoke(app, ["track", str(source)])
    assert done.output.splitlines()[0] == ",".join(HEADER)
    assert done.output.splitlines()[1].startswith("0,1,tentative,1,2,0")


def test_nobody_at_all_is_an_empty_table() -> None:
    scans = read("time,x,y\n0,,\n0.1,,\n", "in.csv")
    assert [len(scan.values) for scan in scans] == [0, 0]
    assert [list(rows_of(tracks)) for tracks in followed(scans)] == [[], []]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the header is ''"),
        ("time,x\n0,1\n", "needed are time, x and y"),
        ("time,x,y,speed\n", "allowed beside them z, yaw"),
        ("time,x,y,x\n", "each once"),
        ("time,x,y\n0,1\n", "line 2: has 2 cells, but the header has 3"),
        ("time,x,y\n0,1,2\n0.1,nan,2\n", "line 3: x is 'nan'"),
        ("time,x,y\n0,1,\n", "line 2: y is ''"),
        ("time,x,y\nsoon,1,2\n", "line 2: time is 'soon'"),
        ("time,x,y\n1,1,2\n0,1,2\n", "line 3: the scan at 0.0 s comes after one at 1.0 s"),
        ("time,x,y\n0,1,2\n0,,\n", "stands alone"),
        ("time,x,y,z\n0,1,2,\n", "line 2: z is ''"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text: str, says: str) -> None:
    with pytest.raises(InputError, match=r"^in\.csv") as error:
        read(text, "in.csv")
    assert says in str(error.value)


def test_a_file_that_is_missing_or_no_text(tmp_path: Path) -> None:
    from backend.tracking.records import Settings
    from cockpit.track import run_track

    with pytest.raises(InputError, match="cannot be read"):
        run_track(tmp_path / "none.csv", None, 0.08, Settings())
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(InputError, match="cannot be read"):
        run_track(tmp_path / "bytes.csv", None, 0.08, Settings())
    (tmp_path / "ok.csv").write_text("time,x,y\n")
    with pytest.raises(InputError, match="--sigma"):
        run_track(tmp_path / "ok.csv", None, -1.0, Settings())
