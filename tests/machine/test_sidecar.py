"""Sidecars, joint_limits.yaml, and what they change."""

from __future__ import annotations

import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.load import load_machine
from backend.machine.sidecar import (
    BodiesTable,
    Heading,
    LidarTable,
    SelfCollision,
    Sidecar,
    TracksTable,
    read_sidecar,
)


def load(path, text):
    path.with_suffix(".toml").write_text(text)
    return load_machine(str(path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed = 3", ["speed", "payload"]),
        ("[tracks]\nlength = 3\nwheels = 4", ["tracks.wheels", "gauge"]),
        ("payload = -5", ["payload", "-5"]),
        ("payload = 'much'", ["payload", "much"]),
        ("payload = nan", ["payload", "nan"]),
        ("payload = ", ["TOML"]),
        ("[joints]\nboom = 'mast'", ["joints.boom", "mast", "boom_joint"]),
        ("[joints]\nmast = 'boom_joint'", ["mast"]),
        ("[joints]\nboom = 'arm_joint'\nstick = 'boom_joint'", ["follow each other"]),
        ("[joints]\nboom = 'arm_joint'\nstick = 'arm_joint'", ["arm_joint", "two roles"]),
        ("[end_point]\nlink = 'tooth'\nposition = [0, 0, 0]", ["end_point.link", "tooth"]),
        ("[end_point]\nlink = 'bucket'\nposition = [0, 0]", ["end_point.position"]),
        ("[gnss]\nlink = 'mast'\nposition = [0, 0, 0]", ["gnss.link", "mast", "house"]),
        ("[eye]\nlink = 'mast'\nposition = [0, 0, 0]", ["eye.link", "mast", "house"]),
        ("[heading]\nof = 'bucket'", ["heading.of", "bucket", "tracks"]),
        ("[limits.boom]\nlower_deg = 50\nupper_deg = -50", ["boom"]),
        ("[limits.boom]\nmax_velocity_deg = 0", ["limits.boom.max_velocity_deg", "0"]),
        ("[limits.tilt]\nmax_velocity = 1", ["limits.tilt"]),
        ("[limits.swing]\nlower_deg = -10", ["swing", "both"]),
        ("[self_collision]\nexclude = [['boom/7', 'tracks']]", ["boom/7", "boom/0"]),
        ("[[cylinder]]\nname = 'boom'", ["cylinder boom", "barrel_link"]),
    ],
)
def test_wrong_sidecars_are_refused_in_one_sentence(tiny, text, words):
    with pytest.raises(InputError) as caught:
        load(tiny(), text)
    said = str(caught.value)
    assert "tiny.toml" in said
    assert "\n" not in said
    for word in words:
        assert word in said


FULL = """
title = "Tiny"
payload = 80.0
masses_trusted = true
[end_point]
link = "bucket"
position = [0.5, 0.03, 0.0]
[gnss]
link = "base"
position = [0.1, 0.2, 1.5]
[heading]
of = "tracks"
offset_deg = 90
[tracks]
length = 2.0
gauge = 1.2
shoe = 0.3
max_speed = 0.9
max_acceleration = 0.4
[limits.swing]
lower_deg = -100
upper_deg = 120
max_velocity_deg = 45
[limits.boom]
max_velocity = 0.3
max_acceleration = 0.8
[self_collision]
exclude = [["boom", "tracks"], ["bucket/0", "upper/0"]]
"""


def test_a_sidecar_says_it_all(tiny):
    machine = load(tiny(), FULL)
    assert (machine.title, machine.payload, machine.masses_trusted) == ("Tiny", 80.0, True)
    np.testing.assert_allclose(machine.end_point, [0.5, 0.03, 0.0])
    assert machine.arm.tip_lateral == pytest.approx(0.1)
    assert machine.links[machine.antenna.link].name == "base"
    assert (machine.heading_of, machine.heading_offset) == ("tracks", pytest.approx(np.pi / 2))
    swing, boom = machine.joints[:2]
    assert not swing.continuous
    np.testing.assert_allclose([swing.lower, swing.upper], np.radians([-100, 120]))
    assert swing.max_velocity == pytest.approx(np.pi / 4)
    assert (boom.max_velocity, boom.max_acceleration) == (0.3, 0.8)
    names = {(machine.body_names[i], machine.body_names[j]) for i, j in machine.self_pairs}
    assert names == {("tracks/0", "stick/0"), ("tracks/0", "bucket/0"), ("upper/0", "stick/0"),
                     ("boom/0", "bucket/0")}  # fmt: skip


def test_an_explicit_sidecar_wins_over_the_one_beside(tiny, tmp_path):
    path = tiny()
    path.with_suffix(".toml").write_text("payload = 1")
    (tmp_path / "other.toml").write_text("payload = 2")
    assert load_machine(str(path)).payload == 1.0
    assert load_machine(str(path), sidecar="other.toml", base_folder=tmp_path).payload == 2.0
    with pytest.raises(InputError, match=r"gone\.toml"):
        load_machine(str(path), sidecar="gone.toml", base_folder=tmp_path)


def test_pairs_that_touch_at_rest_do_not_count_and_are_named(tiny):
    # Folded, the bucket lies against the boom.
    text = "[self_collision]\nrest_deg = [{boom = 0, stick = 148, bucket = 122}]"
    machine = load(tiny(), text)
    assert any("boom/0 and bucket/0 touch" in note for note in machine.assumptions)
    names = {(machine.body_names[i], machine.body_names[j]) for i, j in machine.self_pairs}
    assert ("boom/0", "bucket/0") not in names
    assert ("tracks/0", "bucket/0") in names


def test_joint_limits_yaml_replaces_rates(tiny):
    path = tiny()
    (path.parent / "joint_limits.yaml").write_text(
        "joint_limits:\n"
        "  boom_joint: {has_velocity_limits: true, max_velocity: 0.25, max_acceleration: 0.7}\n"
        "  arm_joint: {has_acceleration_limits: false, max_acceleration: 9.0}\n"
        "  bucket_joint: {max_position: 1.5}\n"
    )
    machine = load_machine(str(path))
    swing, boom, stick, bucket = machine.joints
    assert (boom.max_velocity, boom.max_acceleration) == (0.25, 0.7)
    assert stick.max_velocity == 0.6
    assert stick.max_acceleration != 9.0  # switched off
    assert bucket.upper == 1.5
    assert swing.max_velocity > 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("joint_limits: [", ["YAML"]),
        ("limits: {}", ["joint_limits"]),
        ("joint_limits:\n  mast: {max_velocity: 1}", ["mast", "boom_joint"]),
        ("joint_limits:\n  boom_joint: {max_speed: 1}", ["max_speed", "max_velocity"]),
        ("joint_limits:\n  boom_joint: {max_velocity: fast}", ["max_velocity", "fast"]),
        ("joint_limits:\n  boom_joint: {max_velocity: -1}", ["max_velocity", "-1"]),
        ("joint_limits:\n  boom_joint: 3", ["boom_joint"]),
        ("joint_limits:\n  boom_joint: {min_position: 2}", ["boom_joint", "2"]),
    ],
)
def test_wrong_joint_limits_are_refused(tiny, text, words):
    path = tiny()
    (path.parent / "joint_limits.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_machine(str(path))
    said = str(caught.value)
    assert "\n" not in said
    for word in words:
        assert word in said


def test_an_end_point_on_the_bucket_pivot_is_refused(tiny):
    with pytest.raises(InputError, match="apart"):
        load(tiny(), "[end_point]\nlink = 'bucket'\nposition = [0, 0.1, 0]")


def test_the_readme_shows_every_field(repository, tmp_path):
    text = (repository / "scenes" / "machines" / "README.md").read_text()
    example = text.split("```toml\n")[1].split("```")[0]
    (tmp_path / "example.toml").write_text(example)
    side = read_sidecar(tmp_path / "example.toml")
    assert side.model_fields_set == set(Sidecar.model_fields) - {"cylinder"}
    assert "[[cylinder]]" in text
    for table in (TracksTable, Heading, BodiesTable, SelfCollision, LidarTable):
        assert all(f"{field} = " in example for field in table.model_fields)
