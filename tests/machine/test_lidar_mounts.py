"""LiDARs in the sidecar: read strictly, and where they are in the site frame."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from backend.errors import InputError
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.lidars import mount_called, sensor_pose
from backend.machine.load import load_machine
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make

TWO = """
[[lidar]]
xyz = [0.4, -0.2, 1.5]
rpy_deg = [10.0, 20.0, -30.0]
[[lidar]]
name = "rear"
link = "base"
xyz = [-1.0, 0.0, 0.9]
elevations_deg = [-30.0, 0.0, 5.0]
"""


def load(path, text):
    path.with_suffix(".toml").write_text(text)
    return load_machine(str(path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[lidar]]\nname = 'a'", ["lidar.0.xyz"]),
        ("[[lidar]]\nxyz = [0, 0]", ["lidar.0.xyz"]),
        ("[[lidar]]\nxyz = [0, 0, nan]", ["lidar.0.xyz", "nan"]),
        ("[[lidar]]\nxyz = [0, 0, 1]\nlink = 'boom'", ["lidar.0.link", "boom", "upper"]),
        ("[[lidar]]\nxyz = [0, 0, 1]\nposition = 1", ["lidar.0.position", "xyz, rpy_deg"]),
        ("[[lidar]]\nxyz = [0, 0, 1]\nname = 'a/b'", ["lidar.0.name", "a/b"]),
        ("[[lidar]]\nxyz = [0, 0, 1]\nelevations_deg = []", ["lidar.0.elevations_deg"]),
        ("[[lidar]]\nxyz = [0, 0, 1]\nelevations_deg = [95]", ["lidar.0.elevations_deg", "95"]),
        ("[[lidar]]\nxyz = [0, 0, 1]\n" * 2, ["lidar", "'lidar'", "of its own"]),
    ],
)
def test_wrong_lidars_are_refused_in_one_sentence(tiny, text, words):
    with pytest.raises(InputError) as caught:
        load(tiny(), text)
    said = str(caught.value)
    assert "tiny.toml" in said
    assert "\n" not in said
    for word in words:
        assert word in said


def test_mounts_are_as_stated_and_a_vlp_16_by_default(tiny):
    first, rear = load(tiny(), TWO).lidars
    assert (first.name, rear.name) == ("lidar", "rear")
    np.testing.assert_allclose(np.degrees(first.elevations), np.linspace(-15.0, 15.0, 16))
    np.testing.assert_allclose(np.degrees(rear.elevations), [-30.0, 0.0, 5.0])
    assert mount_called(load(tiny(), TWO), "rear").link == rear.link == 0
    assert mount_called(load(tiny(), TWO), "front") is None
    assert load(tiny(), "").lidars == ()


def test_the_sensor_is_where_lever_arm_and_links_put_it(tiny):
    machine = load(tiny(), TWO)
    q = np.array([0.7, -0.3, 1.0, 0.2])
    base = make(from_attitude(0.4, 0.1, -0.05), np.array([5.0, -2.0, 1.0]))
    links = link_poses(machine, q, base)
    first, rear = (sensor_pose(machine, mount, links) for mount in machine.lidars)
    # By hand: the upper body turns about (0, 0, 0.5) of the root.
    tilted = Rotation.from_matrix(base[:3, :3])
    turned = tilted * Rotation.from_euler("z", 0.7)
    at = tilted.apply([0.0, 0.0, 0.5]) + turned.apply([0.4, -0.2, 1.5]) + base[:3, 3]
    np.testing.assert_allclose(first[:3, 3], at, atol=1e-12)
    mounted = turned * Rotation.from_euler("xyz", [10.0, 20.0, -30.0], degrees=True)
    np.testing.assert_allclose(first[:3, :3], mounted.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rear[:3, 3], tilted.apply([-1.0, 0.0, 0.9]) + base[:3, 3])
    np.testing.assert_allclose(rear[:3, :3], base[:3, :3])


def test_many_postures_at_once_and_links_of_another_machine(tiny, mini):
    machine = load(tiny(), TWO)
    q = np.random.default_rng(0).uniform(-0.5, 0.5, (6, 4))
    mount = machine.lidars[0]
    together = sensor_pose(machine, mount, link_poses(machine, q))
    for k in range(len(q)):
        one = sensor_pose(machine, mount, link_poses(machine, q[k]))
        np.testing.assert_allclose(together[k], one)
    with pytest.raises(ValueError, match="links"):
        sensor_pose(machine, mount, link_poses(mini, np.zeros(4))[:2])


@pytest.mark.parametrize("name", ["mini", "ex13"])
def test_shipped_lidars_stand_on_the_upper_body_above_its_roof(name):
    machine = load_machine(name)
    (mount,) = machine.lidars
    assert machine.links[mount.link].part == "upper"
    T = sensor_pose(machine, mount, link_poses(machine, np.zeros(4)))
    upper = body_boxes(machine, link_poses(machine, np.zeros(4)))
    tops = upper.take(machine.body_parts == "upper").corners()[..., 2].max()
    assert 0.1 < T[2, 3] - tops < 1.6
    np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-12)
