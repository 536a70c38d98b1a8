"""Tables of poses, long and wide, CSV and Parquet, become sessions that fuse to the same poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from mcap.reader import make_reader
from program import Done, cockpit

from backend.fusion.fuse import fuse
from backend.fusion.pose import FusedPose
from backend.fusion.rig import make_rig
from backend.fusion.streams import Streams, ingest
from backend.machine.load import load_machine
from backend.shell.link.codec import decode
from backend.shell.session.convert import Conversion, convert
from backend.site.site import load_site

START = 1_790_000_000.0
HEADER = (
    "time_s,machine,swing_deg,boom_rad,stick_rad,bucket_rad,easting_m,northing_m,height_m,"
    "yaw_deg,pitch_deg,roll_deg,sigma_position_m"
)
LEFT = "{t},left,-30,0.5,-1.1,-0.4,308604.5,4129954.25,1.5,40,3,-2,0.03"
RIGHT = "{t},right,10,0.7,-1.3,0.1,308610,4129946,0,-120,0,0,0.02"


def long_table(count: int = 20) -> str:
    rows = [row.format(t=f"{START + 0.05 * k:.3f}") for k in range(count) for row in (LEFT, RIGHT)]
    return "\n".join([HEADER, *rows]) + "\n"


def fused(done: Conversion, machine: str) -> FusedPose:
    """The pose at the end of a session, by the live fusion."""
    site = load_site("demo")
    rig, streams, now = make_rig(machine, load_machine("mini"), site.frame), Streams(), 0.0
    with done.out.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            name, suffix = channel.topic[1:].split("/", 1)
            now = (message.log_time - done.begin) / 1e9
            if name == machine:
                streams = ingest(rig, streams, decode(name, suffix, message.data, now))
    return fuse(rig, streams, now, now)


def check(done: Conversion) -> None:
    frame = load_site("demo").frame
    left, right = fused(done, "left"), fused(done, "right")
    assert frame.to_projected(left.position) == pytest.approx([308604.5, 4129954.25, 1.5], abs=1e-5)
    assert np.degrees([left.yaw, left.pitch, left.roll]) == pytest.approx([40, 3, -2], abs=1e-6)
    assert left.joints == pytest.approx([np.radians(-30), 0.5, -1.1, -0.4])
    assert frame.to_projected(right.position) == pytest.approx([308610, 4129946, 0], abs=1e-5)
    assert np.degrees(right.yaw) == pytest.approx(-120)
    # 0.03 m of the table, and what yaw and tilt add over the antenna's lever.
    assert 0.03 <= left.sigma_position < 0.032


def test_a_long_table_fuses_to_the_poses_it_gives(tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text(long_table())
    done = convert(tmp_path / "poses.csv", load_site("demo"), tmp_path / "o.mcap")
    assert done.problems == ()
    assert done.counts["/left/joint_states"] == done.counts["/right/gnss/fix"] == 20
    assert done.end - done.begin == pytest.approx(0.95e9, abs=1e3)
    check(done)


def test_latitude_and_longitude(tmp_path: Path) -> None:
    frame = load_site("demo").frame
    latitude, longitude, altitude = frame.to_geodetic(
        frame.from_projected(np.array([308604.5, 4129954.25, 1.5]))
    )
    text = long_table().replace(
        "easting_m,northing_m,height_m", "latitude_deg,longitude_deg,altitude_m"
    )
    text = text.replace("308604.5,4129954.25,1.5", f"{latitude!r},{longitude!r},{altitude!r}")
    latitude, longitude, altitude = frame.to_geodetic(
        frame.from_projected(np.array([308610.0, 4129946.0, 0.0]))
    )
    text = text.replace("308610,4129946,0", f"{latitude!r},{longitude!r},{altitude!r}")
    (tmp_path / "poses.csv").write_text(text)
    check(convert(tmp_path / "poses.csv", load_site("demo"), tmp_path / "o.mcap"))


def wide_columns() -> dict[str, Any]:
    names = HEADER.split(",")
    columns: dict[str, Any] = {"time_ns": [int(START) * 10**9 + k * 50_000_001 for k in range(20)]}
    for row in (LEFT, RIGHT):
        values = row.format(t=0).split(",")
        for name, value in zip(names[2:], values[2:], strict=True):
            columns[f"{values[1]}.{name}"] = [float(value)] * 20
    return columns


def test_wide_tables_csv_and_parquet(tmp_path: Path) -> None:
    columns = wide_columns()
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "poses.parquet")
    lines = [",".join(columns)]
    lines += [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join(lines))
    contents = []
    for suffix in ("csv", "parquet"):
        done = convert(tmp_path / f"poses.{suffix}", load_site("demo"), tmp_path / f"{suffix}.mcap")
        check(done)
        assert done.end - done.begin == 19 * 50_000_001  # whole nanoseconds
        with done.out.open("rb") as file:
            contents.append([(m.log_time, m.data) for _, _, m in make_reader(file).iter_messages()])
    assert contents[0] == contents[1]


def test_empty_cells_nan_and_infinities_are_not_measured(tmp_path: Path) -> None:
    text = "time_s,machine,swing_rad,boom_rad,stick_rad,bucket_rad,yaw_rad,easting_m,northing_m\n"
    text += "1,left,0,0,0,0,,,\n2,left,0,nan,0,0,0.5,,\n3,left,,,,,0.5,308604,4129954\n"
    text += "4,left,0,0,inf,0,0.5,,\n"
    (tmp_path / "p.csv").write_text(text)
    done = convert(tmp_path / "p.csv", load_site("demo"), tmp_path / "o.mcap")
    assert done.counts == {"/left/joint_states": 3, "/left/gnss/heading": 3, "/left/gnss/fix": 1}
    told = {problem.text: problem.where for problem in done.problems}
    assert told["column boom_rad is NaN; it counts as not measured"] == "p.csv, line 3"
    assert told["column stick_rad is inf; it counts as not measured"] == "p.csv, line 5"


def test_rows_out_of_time_and_strangers_are_told(tmp_path: Path) -> None:
    rows = [
        *(LEFT.format(t=t) for t in (1.0, 1.1, 0.5, 1.2, 1.2)),
        *(RIGHT.format(t=t) for t in (1.0, 1.1)),
        RIGHT.format(t=1.3).replace("right", "third"),
    ]
    (tmp_path / "p.csv").write_text("\n".join([HEADER, *rows]))
    done = convert(tmp_path / "p.csv", load_site("demo"), tmp_path / "o.mcap")
    told = {problem.text: (problem.where, problem.count) for problem in done.problems}
    assert told == {
        'the time of machine "left" goes back; rows are taken in the order of their times': (
            "p.csv, line 4",
            1,
        ),
        'the time of machine "left" comes twice; rows are taken in the order of their times': (
            "p.csv, line 6",
            1,
        ),
        'machine "third" is not of the site': ("p.csv, line 9", 1),
    }
    assert done.begin == 500_000_000
    assert done.skipped == {'machine "third"': 1}


ROW = LEFT.format(t=1)
MISTAKES = {
    "no time": (f"{HEADER[7:]}\n{ROW[2:]}\n", "column of time: there is none"),
    "two times": (f"time_ms,{HEADER}\n1,{ROW}\n", "column of time: there is time_ms, time_s"),
    "word": (f"{HEADER}\n{ROW}\n{ROW.replace('0.5', 'abc')}\n", 'line 3: column boom_rad is "abc"'),
    "negative": (f"{HEADER}\n-{ROW}\n", "line 2: column time_s is -1.0"),
    "no time in a row": (f"{HEADER}\n{ROW}\n{ROW[1:]}\n", "line 3: column time_s is nan"),
    "cells": (f"{HEADER}\n{ROW},7\n", "cannot be read as a table"),
    "twice": (f"{HEADER},boom_rad\n{ROW},1\n", '"boom_rad" is there twice'),
    "both units": (f"{HEADER},boom_deg\n{ROW},1\n", "boom_rad, boom_deg say the same"),
    "no northing": (f"{HEADER.replace('northing', 'north')}\n{ROW}\n", "northing_m is missing"),
    "no swing": (f"{HEADER.replace('swing', 'slew')}\n{ROW}\n", "no swing_rad or swing_deg"),
    "no yaw": (f"{HEADER.replace('yaw', 'head')}\n{ROW}\n", "no yaw_rad or yaw_deg"),
    "strangers": (f"{HEADER}\n{ROW.replace('left', 'dozer')}\n", 'column machine has "dozer"'),
    "nothing known": ("time_s,a,b\n1,2,3\n", 'neither a column "machine" nor columns such as'),
    "no rows": (f"{HEADER}\n", "has no rows"),
    "positions twice": (
        f"{HEADER},latitude_deg,longitude_deg\n{ROW},1,1\n",
        "given by easting_m and by latitude_deg",
    ),
}


def run(path: Path, out: Path) -> Done:
    return cockpit("convert", str(path), "--site", "demo", "--out", str(out))


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_one_sentence(tmp_path: Path, mistake: str) -> None:
    text, words = MISTAKES[mistake]
    (tmp_path / "p.csv").write_text(text)
    done = run(tmp_path / "p.csv", tmp_path / "o.mcap")
    assert done.returncode == 2
    assert words in done.stderr
    assert "p.csv" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "o.mcap").exists()


def test_files_that_are_no_tables(tmp_path: Path) -> None:
    pyarrow.parquet.write_table(pa.table(wide_columns()), tmp_path / "good.parquet")
    data = (tmp_path / "good.parquet").read_bytes()
    (tmp_path / "cut.parquet").write_bytes(data[: len(data) // 2])
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    table = pa.table({"time_s": [1.0], "left.swing_rad": [[1, 2]]})
    pyarrow.parquet.write_table(table, tmp_path / "lists.parquet")
    for name in ("cut.parquet", "binary.csv", "lists.parquet"):
        done = run(tmp_path / name, tmp_path / "o.mcap")
        assert done.returncode == 2, name
        assert name in done.stderr
        assert done.stderr.count("\n") == 1
