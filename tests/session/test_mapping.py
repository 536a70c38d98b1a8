"""Topics of recordings to the streams of a site's machines."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from backend.errors import InputError
from backend.shell.session.mapping import map_topics, refuse_nothing, stream_of
from backend.site.site import Site, load_site, parse_site

JOINTS, FIX = "sensor_msgs/msg/JointState", "sensor_msgs/msg/NavSatFix"
IMU = "sensor_msgs/msg/Imu"


def site(repository: Path, left: str, right: str = "") -> Site:
    """The demo site with the topics of its machines."""
    path = repository / "scenes" / "sites" / "demo.toml"
    data = tomllib.loads(path.read_text())
    for machine, text in zip(data["machine"], (left, right), strict=True):
        machine["topics"] = tomllib.loads(text)
    return parse_site(data, path)


def test_a_streams_own_name_is_its_topic() -> None:
    mapped = map_topics(load_site("demo"), {"/left/joint_states": JOINTS, "/left/imu/base": IMU})
    (joints,) = mapped.streams["/left/joint_states"]
    assert (joints.machine, joints.suffix, joints.topic) == (
        "left",
        "joint_states",
        "/left/joint_states",
    )
    (imu,) = mapped.streams["/left/imu/base"]
    assert imu.fields == (("link", "base"),)
    assert not mapped.unknown


def test_named_topics_win_over_own_names(repository: Path) -> None:
    named = site(repository, 'joint_states = "/zx200/joint_states"\nimu.base = "/zx200/imu"')
    types = {"/zx200/joint_states": JOINTS, "/left/joint_states": JOINTS, "/zx200/imu": IMU}
    mapped = map_topics(named, types)
    assert [s.topic for s in mapped.streams["/zx200/joint_states"]] == ["/left/joint_states"]
    assert [s.topic for s in mapped.streams["/zx200/imu"]] == ["/left/imu/base"]
    assert "/left/joint_states" not in mapped.streams
    assert any("/left/joint_states is not used" in note for note in mapped.notes)
    # Without the named one in the recording the own name counts.
    assert "/left/joint_states" in map_topics(named, {"/left/joint_states": JOINTS}).streams


def test_one_topic_may_be_attitude_and_heading(repository: Path) -> None:
    both = site(repository, 'gnss_heading = "/ins"\nimu.base = "/ins"')
    mapped = map_topics(both, {"/ins": IMU})
    assert {s.suffix for s in mapped.streams["/ins"]} == {"gnss/heading", "imu/base"}


def test_a_wrong_type_is_told_and_not_used() -> None:
    mapped = map_topics(load_site("demo"), {"/left/gnss/fix": IMU, "/left/joint_states": JOINTS})
    assert "/left/gnss/fix" not in mapped.streams
    assert any(IMU in note and FIX in note for note in mapped.notes)


def test_what_a_machine_lacks_is_told() -> None:
    types = {"/left/joint_states": JOINTS, "/left/gnss/fix": FIX, "/left/gnss/heading": IMU}
    notes = map_topics(load_site("demo"), types).notes
    assert not any('"left"' in note for note in notes)
    assert any('"right" has no joint_states, gnss/fix, gnss/heading' in note for note in notes)


def test_strangers_are_listed_and_only_strangers_are_refused() -> None:
    types = {"/tf": "tf2_msgs/msg/TFMessage", "/left/joint_states": JOINTS, "/cockpit/cycle": "x"}
    mapped = map_topics(load_site("demo"), types)
    assert mapped.unknown == ("/tf",)
    refuse_nothing(mapped, "bag")
    with pytest.raises(InputError, match=r"bag: none of its topics .*/tf.*\[machine.topics\]"):
        refuse_nothing(map_topics(load_site("demo"), {"/tf": types["/tf"]}), "bag")


def test_clock_and_unknown_keys_are_no_streams() -> None:
    demo = load_site("demo")
    assert stream_of(demo, "/left/clock") is None
    assert stream_of(demo, "/left/nonsense") is None
    assert stream_of(demo, "/leftover/joint_states") is None
    assert stream_of(demo, "/right/points") is not None


def test_two_machines_cannot_share_a_topic(repository: Path) -> None:
    with pytest.raises(InputError, match='topic "/joint_states" for "left" and for "right"'):
        site(repository, 'joint_states = "/joint_states"', 'joint_states = "/joint_states"')


@pytest.mark.parametrize("topic", ["joint_states", "/a//b", "/a/", "/a b"])
def test_topics_in_a_site_file_are_checked(repository: Path, topic: str) -> None:
    with pytest.raises(InputError, match=r"machine\[1\].topics.joint_states"):
        site(repository, f'joint_states = "{topic}"')
