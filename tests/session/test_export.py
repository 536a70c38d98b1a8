"""Sessions leave as tables and as plain ROS 2 recordings, and come back equal."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from mcap.reader import make_reader
from program import Done, cockpit
from rosbags.highlevel import AnyReader

from backend.shell.link.typestore import TYPESTORE
from backend.shell.session.format import ALARM, SNAPSHOT, Header, Message, dumps
from backend.shell.session.sun2020 import NAME
from backend.shell.session.writer import SessionWriter
from backend.site.site import load_site
from cockpit.export import export_zip


@pytest.fixture(scope="module")
def session(repository: Path) -> Path:
    return repository / "scenes" / "sessions" / f"{NAME}.mcap"


def run(session: Path, kind: str, out: Path, *more: str) -> Done:
    return cockpit("export", str(session), "--format", kind, "--out", str(out), *more)


def machine(easting: float, validity: str = "VALID") -> dict[str, Any]:
    return {
        "validity": validity,
        "fix": "RTK fixed",
        "position_projected": [easting, 4129954.5, 0.25],
        "yaw": 0.5,
        "pitch": 0.01,
        "roll": -0.02,
        "joints": {"swing": -0.3, "boom": 0.5, "stick": -1.0, "bucket": 0.2},
        "sigma": {"position": 0.03, "yaw": 0.004, "joints": 0.003},
        "eta": 0.2,
        "swing_center": [0.0, 0.0, 0.65],
    }


def recorded(path: Path, documents: list[dict[str, Any]], offset: int) -> Path:
    """A session with snapshots, as the recorder leaves it."""
    site = load_site("demo")
    header = Header(
        offset, "test", 0, str(site.path), site.path.read_text(), "left,right", "live", "x"
    )
    writer = SessionWriter(path, header)
    for document in documents:
        time = round(document.get("time", 0.0) * 1e9) + offset
        writer.write(Message(SNAPSHOT, time, dumps(document)))
        writer.write(Message(ALARM, time, dumps({"alarms": []})))
    writer.close()
    return path


def snapshot(k: int, level: str = "CLEAR") -> dict[str, Any]:
    time = 100.0 + 0.1 * k
    alarm = {"name": "partner", "machine": "left", "level": level, "line": f"{level} · {k}"}
    return {
        "time": time,
        "state_time": time - 0.02,
        "cycle": k,
        "machines": {
            "left": machine(308604.0 + 0.01 * k),
            "right": machine(308610.0) | {"swing_center": None, "validity": "UNKNOWN"},
        },
        "pairs": [
            {"a": "left", "b": "right", "body_a": "boom/0", "body_b": "tracks/1"}
            | {"distance": 1.5 - 0.1 * k, "at_least": None, "reason": "", "approach": 1.0}
        ],
        "concerns": [{"machine": "left", "level": level}, {"machine": "left", "level": "CLEAR"}],
        "alarms": [] if level == "CLEAR" else [alarm | {"active": True, "since": time}],
    }


OFFSET = 1_790_000_000_000_000_000
LEVELS = ["CLEAR", "SLOW", "SLOW", "STOP", "CLEAR", "SLOW"]


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_recorded_snapshots_as_tables(tmp_path: Path, kind: str) -> None:
    documents = [snapshot(k, level) for k, level in enumerate(LEVELS)]
    path = recorded(tmp_path / "s.mcap", documents, OFFSET)
    done = run(path, kind, tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["source"] == "recorded"
    tables = {}
    for name in ("poses", "clearances", "alarms"):
        file = tmp_path / "out" / f"{name}.{kind}"
        read = pyarrow.csv.read_csv if kind == "csv" else pyarrow.parquet.read_table
        tables[name] = read(file).to_pylist()
    left = [row for row in tables["poses"] if row["machine"] == "left"]
    assert [row["time_ns"] for row in left] == [
        OFFSET + round((100.0 + 0.1 * k - 0.02) * 1e9) for k in range(6)
    ]
    assert [row["easting_m"] for row in left] == [308604.0 + 0.01 * k for k in range(6)]
    assert left[0]["stick_rad"] == -1.0
    right = next(row for row in tables["poses"] if row["machine"] == "right")
    assert right["validity"] == "UNKNOWN"
    assert right["easting_m"] is None
    assert right["boom_rad"] is None
    assert [row["level_a"] for row in tables["clearances"]] == LEVELS
    assert tables["clearances"][2]["distance_m"] == 1.5 - 0.2
    alarms = [(r["level"], round(r["elapsed_s"], 6), round(r["duration_s"], 6), r["line"])
              for r in tables["alarms"]]  # fmt: skip
    assert alarms == [
        ("SLOW", 0.1, 0.2, "SLOW · 1"),
        ("STOP", 0.3, 0.1, "STOP · 3"),
        ("SLOW", 0.5, 0.0, "SLOW · 5"),
    ]


def test_parquet_says_units_and_origin(session: Path, tmp_path: Path) -> None:
    assert run(session, "parquet", tmp_path / "out").returncode == 0
    schema = pyarrow.parquet.read_schema(tmp_path / "out" / "poses.parquet")
    for field in schema:
        unit = field.metadata[b"unit"].decode()
        assert field.metadata[b"description"]
        ending = {"ns": "_ns", "s": "_s", "m": "_m", "rad": "_rad", "": ""}[unit]
        assert field.name.endswith(ending)
    assert b"synthesised" in schema.metadata[b"note"]
    assert schema.metadata[b"crs"] == b"EPSG:32652"


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_tables_come_back(session: Path, tmp_path: Path, kind: str) -> None:
    """session -> tables -> session -> tables: the same poses at the same times."""
    assert run(session, kind, tmp_path / "first").returncode == 0
    first = tmp_path / "first" / f"poses.{kind}"
    back = tmp_path / "back.mcap"
    more = ("--site", "sun2020-experiment", "--out", str(back), "--json")
    done = cockpit("convert", str(first), *more)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["problems"] == []
    assert run(back, kind, tmp_path / "second").returncode == 0
    read = pyarrow.csv.read_csv if kind == "csv" else pyarrow.parquet.read_table
    frames = []
    for folder in ("first", "second"):
        table = read(tmp_path / folder / f"poses.{kind}")
        frames.append({(r["time_ns"], r["machine"]): r for r in table.to_pylist()})
    shared = frames[0].keys() & frames[1].keys()
    assert len(shared) > 0.9 * len(frames[0]) > 700
    for key in sorted(shared):
        before, after = frames[0][key], frames[1][key]
        for column in ("swing", "boom", "stick", "bucket", "yaw", "pitch", "roll"):
            assert after[f"{column}_rad"] == pytest.approx(before[f"{column}_rad"], abs=1e-9)
        for column in ("easting_m", "northing_m", "height_m"):
            assert after[column] == pytest.approx(before[column], abs=1e-5)


def test_ros2_recording_reads_back_equal(session: Path, tmp_path: Path) -> None:
    done = run(session, "ros2", tmp_path / "bag", "--json")
    assert done.returncode == 0, done.stderr
    with session.open("rb") as file:
        wanted = [
            (channel.topic, message.log_time, bytes(message.data))
            for schema, channel, message in make_reader(file).iter_messages()
            if channel.message_encoding == "cdr"
        ]
    found, types = [], set()
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, time, data in reader.messages():
            found.append((connection.topic, time, bytes(data)))
            types.add(connection.msgtype)
            if connection.msgtype == "sensor_msgs/msg/JointState":
                # By the definitions in the bag, not by ours.
                theirs = reader.deserialize(data, connection.msgtype)
                ours = TYPESTORE.deserialize_cdr(data, connection.msgtype)
                assert np.array_equal(theirs.position, ours.position)
                assert list(theirs.name) == list(ours.name)
    assert sorted(found) == sorted(wanted)
    assert types == {
        "sensor_msgs/msg/JointState",
        "sensor_msgs/msg/NavSatFix",
        "sensor_msgs/msg/Imu",
    }
    (file,) = (tmp_path / "bag").glob("*.mcap")
    assert file.name == "bag.mcap"
    with file.open("rb") as stream:
        mcap = make_reader(stream)
        assert mcap.get_header().profile == "ros2"
        channels = mcap.get_summary().channels.values()
        assert {channel.message_encoding for channel in channels} == {"cdr"}
    assert sum(json.loads(done.stdout)["counts"].values()) == len(wanted)


def test_a_ros2_export_converts_back_to_the_same_messages(session: Path, tmp_path: Path) -> None:
    assert run(session, "ros2", tmp_path / "bag").returncode == 0
    more = ("--site", "sun2020-experiment", "--out", str(tmp_path / "o.mcap"), "--json")
    done = cockpit("convert", str(tmp_path / "bag"), *more)
    assert json.loads(done.stdout)["messages"] == 2527  # the marker is ours and stays behind
    assert json.loads(done.stdout)["problems"] == []


def test_one_file_for_a_browser(session: Path, tmp_path: Path) -> None:
    archive = export_zip(session, "ros2", tmp_path, None, "")
    assert [file.name for file in tmp_path.iterdir()] == [archive.name]
    with zipfile.ZipFile(archive) as file:
        names = {Path(name).name for name in file.namelist() if not name.endswith("/")}
    assert names == {"metadata.yaml", f"{NAME}-ros2.mcap"}


def test_snapshots_of_strangers_are_left_out(tmp_path: Path) -> None:
    documents: list[dict[str, Any]] = [snapshot(0), {"time": 100.1, "machines": {"left": 3}}]
    path = recorded(tmp_path / "s.mcap", [*documents, snapshot(2)], OFFSET)
    done = run(path, "csv", tmp_path / "out", "--json")
    assert json.loads(done.stdout)["counts"]["poses.csv"] == 4
    assert "1 recorded snapshots are not this program's" in done.stdout


def test_mistakes_are_one_sentence(session: Path, tmp_path: Path) -> None:
    strange = recorded(tmp_path / "strange.mcap", [{"time": 1.0, "machines": 3}], OFFSET)
    (tmp_path / "there").mkdir()
    (tmp_path / "text.mcap").write_text("text")
    cases: dict[str, tuple[Path, str, Path, tuple[str, ...]]] = {
        'unknown; allowed are csv': (session, "xls", tmp_path / "o", ()),
        "exists already": (session, "csv", tmp_path / "there", ()),
        'allowed are recorded, evaluated': (session, "csv", tmp_path / "o", ("--source", "x")),
        "no snapshots were recorded": (session, "csv", tmp_path / "o", ("--source", "recorded")),
        "no snapshots that this program can read": (strange, "csv", tmp_path / "o", ()),
        "no ROS 2 messages": (strange, "ros2", tmp_path / "o", ()),
        "text.mcap": (tmp_path / "text.mcap", "csv", tmp_path / "o", ()),
        "no such file": (tmp_path / "nowhere", "csv", tmp_path / "o", ()),
        "cannot be written": (session, "ros2", Path("/proc/none/o"), ()),
    }  # fmt: skip
    for words, (path, kind, out, more) in cases.items():
        done = run(path, kind, out, *more)
        assert done.returncode == 2, words
        assert words in done.stderr
        assert done.stderr.count("\n") == 1, done.stderr
        assert not (tmp_path / "o").exists()
    assert not list(tmp_path.glob(".*.part"))
