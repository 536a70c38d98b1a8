"""rosbag2 recordings, written by `rosbags`, become sessions with the same messages."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from program import cockpit
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from backend.shell.link.codec import decode
from backend.shell.session.convert import convert, needs_conversion
from backend.shell.session.cycles import Topics, portions
from backend.shell.session.cycles import problems as problems_of
from backend.shell.session.format import METADATA, Header
from backend.shell.session.reader import open_session
from backend.site.site import load_site

ROS = get_typestore(Stores.ROS2_HUMBLE)
T = ROS.types
START = 1_790_000_000_123_456_789
STORAGES = [StoragePlugin.SQLITE3, StoragePlugin.MCAP]


def header(time: int) -> Any:
    seconds, nanoseconds = divmod(time, 10**9)
    stamp = T["builtin_interfaces/msg/Time"](seconds, nanoseconds)
    return T["std_msgs/msg/Header"](stamp, "frame")


def joint_state(time: int, angles: list[float]) -> Any:
    names = ["swing_joint", "boom_joint", "stick_joint", "bucket_joint"]
    nothing = np.zeros(0)
    return T["sensor_msgs/msg/JointState"](header(time), names, np.array(angles), nothing, nothing)


def fix(time: int) -> Any:
    status = T["sensor_msgs/msg/NavSatStatus"](2, 1)
    covariance = (np.eye(3) * 4e-4).ravel()
    return T["sensor_msgs/msg/NavSatFix"](
        header(time), status, 37.29934195, 126.8330762, 12.5, covariance, 2
    )


def imu(time: int, yaw: float) -> Any:
    turn = T["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2))
    v3, nine = T["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), np.zeros(9)
    return T["sensor_msgs/msg/Imu"](header(time), turn, nine, v3, nine, v3, nine)


def messages(prefix: str, count: int = 20) -> list[tuple[str, int, Any]]:
    """(topic, time, message) of one machine, 5 ms apart."""
    found: list[tuple[str, int, Any]] = []
    for k in range(count):
        time = START + k * 5_000_000
        found.append((f"{prefix}/joint_states", time, joint_state(time, [0.1 * k, 0.5, -1.0, 0.2])))
        if k % 4 == 0:
            found.append((f"{prefix}/gnss/fix", time + 1000, fix(time)))
            found.append((f"{prefix}/gnss/heading", time + 2000, imu(time, 0.3)))
            found.append((f"{prefix}/imu/base", time + 3000, imu(time, 0.0)))
    return found


def write_bag(
    path: Path,
    content: list[tuple[str, int, Any]],
    storage: StoragePlugin = StoragePlugin.SQLITE3,
    compression: CompressionMode = CompressionMode.NONE,
) -> Path:
    writer = Writer(path, version=9, storage_plugin=storage)
    if compression is not CompressionMode.NONE:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, time, message in content:
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, message.__msgtype__, typestore=ROS
                )
            data = ROS.serialize_cdr(message, message.__msgtype__)
            writer.write(connections[topic], time, data)
    return path


def read(path: Path) -> tuple[Header, list[tuple[str, int, bytes]]]:
    """A session's header and its messages, by the mcap library alone."""
    with path.open("rb") as file:
        reader = make_reader(file)
        texts = next(m.metadata for m in reader.iter_metadata() if m.name == METADATA)
        found = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in reader.iter_messages()
        ]
        assert reader.get_header().profile == "ros2"
    return Header.read(texts, str(path)), found


@pytest.mark.parametrize("storage", STORAGES)
def test_every_message_comes_back_byte_by_byte(tmp_path: Path, storage: StoragePlugin) -> None:
    content = messages("/left") + messages("/right")
    bag = write_bag(tmp_path / "bag", content, storage)
    fractions: list[float] = []
    done = convert(bag, load_site("demo"), tmp_path / "out.mcap", fractions.append)
    written, found = read(done.out)
    wanted = sorted(
        ((topic, time, bytes(ROS.serialize_cdr(m, m.__msgtype__))) for topic, time, m in content),
        key=lambda item: (item[1], item[0]),
    )
    assert sorted(found, key=lambda item: (item[1], item[0])) == wanted
    assert [time for _, time, _ in found] == sorted(time for _, time, _ in found)
    assert done.problems == ()
    assert done.messages == len(content)
    assert (done.begin, done.end) == (START, START + 19 * 5_000_000)
    assert written.origin == "rosbag2: bag"
    assert written.own == "left,right"
    assert 0 <= done.begin - written.offset < 10**9
    assert fractions[-1] == 1.0
    sample = decode("left", "joint_states", found[0][2], 0.0)
    assert sample.names[1] == "boom_joint"
    assert sample.stamp == pytest.approx(START / 1e9, abs=1e-6)


@pytest.mark.parametrize("storage", STORAGES)
def test_single_files_and_folders_without_metadata(tmp_path: Path, storage: StoragePlugin) -> None:
    bag = write_bag(tmp_path / "bag", messages("/left"), storage)
    (bag / "metadata.yaml").unlink()
    (file,) = bag.iterdir()
    folder = convert(bag, load_site("demo"), tmp_path / "folder.mcap")
    single = convert(file, load_site("demo"), tmp_path / "single.mcap")
    assert read(folder.out)[1] == read(single.out)[1]
    assert len(read(single.out)[1]) == 35
    assert any("metadata.yaml" in problem.text for problem in folder.problems)


def test_what_a_player_must_convert_first(tmp_path: Path, repository: Path) -> None:
    scenes = repository / "scenes"
    for storage in STORAGES:
        bag = write_bag(tmp_path / storage.name, messages("/left", 1), storage)
        (file,) = (f for f in bag.iterdir() if f.suffix != ".yaml")
        sqlite = storage is StoragePlugin.SQLITE3
        assert needs_conversion(bag) is needs_conversion(file) is sqlite
    assert needs_conversion(scenes / "can" / "sun2020-appendix-a.asc")
    assert not needs_conversion(scenes / "sessions" / "sun2020-experiment.mcap")
    assert not needs_conversion(tmp_path / "nowhere.csv")
    assert not needs_conversion(scenes)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_bags(tmp_path: Path, mode: CompressionMode) -> None:
    bag = write_bag(tmp_path / "bag", messages("/left"), compression=mode)
    done = convert(bag, load_site("demo"), tmp_path / "out.mcap")
    assert done.messages == 35


def test_clouds_of_points_pass_as_they_are(tmp_path: Path) -> None:
    field = T["sensor_msgs/msg/PointField"]("x", 0, 7, 1)
    content: list[tuple[str, int, Any]] = []
    for k in range(3):
        data = np.arange(4000, dtype=np.uint8)
        cloud = T["sensor_msgs/msg/PointCloud2"](
            header(START), 1, 1000, [field], False, 4, 4000, data, True
        )
        content.append(("/left/points", START + k, cloud))
    done = convert(write_bag(tmp_path / "bag", content), load_site("demo"), tmp_path / "o.mcap")
    _, found = read(done.out)
    assert [data for _, _, data in found] == [
        bytes(ROS.serialize_cdr(m, m.__msgtype__)) for _, _, m in content
    ]


def test_topics_by_the_site_file(tmp_path: Path, repository: Path) -> None:
    text = (repository / "scenes" / "sites" / "demo.toml").read_text()
    named = text.replace(
        'label = "LEFT"\n',
        'label = "LEFT"\ntopics = { joint_states = "/zx200/joint_states", '
        'gnss_heading = "/ins", imu = { base = "/ins" } }\n',
    )
    assert named != text
    (tmp_path / "site.toml").write_text(named)
    content = [(f"/zx200{t[5:]}" if "joint" in t else t, k, m) for t, k, m in messages("/left")]
    content = [("/ins" if "imu" in t else t, k, m) for t, k, m in content if "heading" not in t]
    bag = write_bag(tmp_path / "bag", content)
    done = convert(bag, load_site(str(tmp_path / "site.toml")), tmp_path / "out.mcap")
    assert done.counts == {
        "/left/joint_states": 20,
        "/left/gnss/fix": 5,
        "/left/gnss/heading": 5,
        "/left/imu/base": 5,
    }


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("keep", [0.0, 0.001, 0.3, 0.7, 0.99])
def test_cut_bags_are_told_never_a_traceback(
    tmp_path: Path, storage: StoragePlugin, keep: float
) -> None:
    bag = write_bag(tmp_path / "bag", messages("/left", 4000), storage)
    file = next(f for f in bag.iterdir() if f.suffix != ".yaml")
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * keep)])
    run = cockpit(
        *("convert", str(bag), "--site", "demo", "--out", str(tmp_path / "o.mcap"), "--json")
    )
    assert "Traceback" not in run.stderr
    if run.returncode == 2:
        assert run.stderr.startswith("cockpit: ")
        assert run.stderr.count("\n") == 1
        assert not list(tmp_path.glob("o.mcap*"))
    else:
        document = json.loads(run.stdout)
        assert 0 < document["messages"] <= 7000
        assert document["problems"]


def test_what_is_whole_of_a_cut_mcap_is_kept(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", messages("/left", 40_000), StoragePlugin.MCAP)
    (file,) = bag.glob("*.mcap")
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    for path in (bag, file):
        done = convert(path, load_site("demo"), tmp_path / f"{path.name}.out.mcap")
        assert 0.3 * 70_000 < done.messages < 0.6 * 70_000
        assert any("what is whole is read" in problem.text for problem in done.problems)


def test_missing_streams_and_strangers_are_told(tmp_path: Path) -> None:
    content = [m for m in messages("/left") if "joint" in m[0]] + messages("/third")
    bag = write_bag(tmp_path / "bag", content)
    done = convert(bag, load_site("demo"), tmp_path / "out.mcap")
    texts = [problem.text for problem in done.problems]
    assert any('"left" has no gnss/fix, gnss/heading' in text for text in texts)
    assert any('"right" has no joint_states' in text for text in texts)
    assert done.skipped["/third/joint_states"] == 20


def test_nan_and_clocks_that_jump_back_are_told_and_kept(tmp_path: Path) -> None:
    times = [START, START + 10**7, START - 10**9, START + 2 * 10**7]
    content: list[tuple[str, int, Any]] = [
        (
            "/left/joint_states",
            START + k,
            joint_state(time, [0.0, np.nan if k == 3 else 0.5, -1, 0]),
        )
        for k, time in enumerate(times)
    ]
    bag = write_bag(tmp_path / "bag", content)
    done = convert(bag, load_site("demo"), tmp_path / "out.mcap")
    texts = [problem.text for problem in done.problems if problem.where == "left/joint_states"]
    assert any("not finite" in text for text in texts)
    assert any("clock goes back by 1.010 s" in text for text in texts)
    assert done.messages == 4


def test_two_senders_on_one_topic_are_told(tmp_path: Path) -> None:
    path = tmp_path / "two.mcap"
    kind = "sensor_msgs/msg/JointState"
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2")
        text = ROS.generate_msgdef(kind, ros_version=2)[0].encode()
        schema = writer.register_schema(kind, "ros2msg", text)
        for k in range(2):
            channel = writer.register_channel(
                "/left/joint_states", "cdr", schema, {"sender": str(k)}
            )
            data = bytes(ROS.serialize_cdr(joint_state(START + k, [0, 0, 0, k]), kind))
            writer.add_message(channel, START + k, data, START + k)
        writer.finish()
    done = convert(path, load_site("demo"), tmp_path / "out.mcap")
    assert done.messages == 2
    assert any("two machines with one name" in problem.text for problem in done.problems)


def test_a_session_is_not_converted_again(tmp_path: Path, repository: Path) -> None:
    session = repository / "scenes" / "sessions" / "sun2020-experiment.mcap"
    more = ("--site", "sun2020-experiment", "--out", str(tmp_path / "o.mcap"))
    done = cockpit("convert", str(session), *more)
    assert done.returncode == 2
    assert "is a session already" in done.stderr


def test_garbage_in_a_message_is_told(tmp_path: Path) -> None:
    content = messages("/left")
    bag = tmp_path / "bag"
    with Writer(bag, version=9) as writer:
        connection = writer.add_connection(
            "/left/joint_states", "sensor_msgs/msg/JointState", typestore=ROS
        )
        good = ROS.serialize_cdr(content[0][2], content[0][2].__msgtype__)
        writer.write(connection, START, good)
        writer.write(connection, START + 1, b"\x00\x01\x00\x00\xff\xff")
    done = convert(bag, load_site("demo"), tmp_path / "out.mcap")
    assert any("cannot be decoded" in problem.text for problem in done.problems)


def test_nothing_usable_is_one_sentence_and_no_file(tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    bag = write_bag(tmp_path / "bag", messages("/third"))
    (tmp_path / "text.mcap").write_text("hello")
    (tmp_path / "empty.db3").write_bytes(b"")
    (tmp_path / "folder").mkdir()
    (tmp_path / "file.xyz").write_text("x")
    shutil.copytree(bag, tmp_path / "broken")
    (tmp_path / "broken" / "metadata.yaml").write_text("{")
    cases = {
        "bag": "none of its topics is of a machine",
        "text.mcap": "cannot be read as a ROS 2 recording",
        "empty.db3": "is empty",
        "folder": "of no known kind",
        "file.xyz": "of no known kind",
        "broken": "cannot be read as a ROS 2 recording",
        "nowhere": "no such file",
    }
    for name, words in cases.items():
        run = cockpit("convert", str(tmp_path / name), "--site", "demo", "--out", str(out))
        assert run.returncode == 2, name
        assert words in run.stderr, name
        assert run.stderr.count("\n") == 1, name
        assert not out.exists()
        assert not list(tmp_path.glob("*.part"))


def test_an_existing_session_is_never_overwritten(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", messages("/left"))
    (tmp_path / "out.mcap").write_text("precious")
    run = cockpit("convert", str(bag), "--site", "demo", "--out", str(tmp_path / "out.mcap"))
    assert run.returncode == 2
    assert "exists already" in run.stderr
    assert (tmp_path / "out.mcap").read_text() == "precious"


def test_a_foreign_mcap_is_played_directly_with_the_site_files_topics(
    tmp_path: Path, repository: Path
) -> None:
    """The same poses from the recording itself and from what it is converted to."""
    text = (repository / "scenes" / "sites" / "demo.toml").read_text()
    named = text.replace(
        'label = "LEFT"\n',
        'label = "LEFT"\ntopics = { joint_states = "/zx200/joint_states", '
        'gnss_heading = "/ins", imu = { base = "/ins" } }\n',
    )
    (tmp_path / "site.toml").write_text(named)
    site = load_site(str(tmp_path / "site.toml"))
    content = [(f"/zx200{t[5:]}" if "joint" in t else t, k, m) for t, k, m in messages("/left")]
    content = [("/ins" if "imu" in t else t, k, m) for t, k, m in content if "heading" not in t]
    bag = write_bag(tmp_path / "bag", content, StoragePlugin.MCAP)
    direct = open_session(bag)
    topics = Topics.of(site, direct)
    converted = open_session(convert(bag, site, tmp_path / "out.mcap").out)
    heard = [
        [
            (type(s).__name__, s.machine, s.stamp)
            for p in portions(session, of)
            for s in p.inputs.samples
        ]
        for session, of in ((direct, topics), (converted, Topics.of(site, converted)))
    ]
    assert sorted(heard[0]) == sorted(heard[1])
    assert {name for name, _, _ in heard[0]} == {
        "JointSample", "FixSample", "HeadingSample", "AttitudeSample",
    }  # fmt: skip
    assert len(heard[0]) == 35
    assert not any("left" in problem for problem in problems_of(direct, topics))
