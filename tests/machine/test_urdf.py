"""URDF and xacro files: what they mean, and what is said when they are broken."""

from __future__ import annotations

import math

import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.load import load_machine
from backend.machine.meshes import mesh_triangles
from backend.machine.urdf import parse


def refusal(path, **options):
    with pytest.raises(InputError) as caught:
        load_machine(str(path), **options)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</robot>", "", ["not well-formed"]),
        ('<robot name="tiny">', "<sdf>", ["not well-formed"]),
        ('<link name="stick">', '<link name="boom">', ["link 'boom'", "twice"]),
        ('<parent link="boom"/>', '<parent link="mast"/>', ["arm_joint", "mast", "not defined"]),
        ('<child link="stick"/>', "", ["arm_joint", "child"]),
        ('name="arm_joint" type="revolute"', 'name="arm_joint" type="hinge"', ["'hinge'"]),
        ('lower="-1.2" upper="0.6"', 'lower="0.6" upper="-1.2"', ["boom_joint", "0.6", "-1.2"]),
        ('lower="-1.2" upper="0.6"', 'lower="0.6" upper="0.6"', ["boom_joint", "0.6"]),
        ('lower="-1.2"', 'lower="low"', ["boom_joint", "'low'"]),
        ('lower="-1.2"', 'lower="nan"', ["boom_joint", "'nan'"]),
        ('<limit lower="-1.2" upper="0.6" effort="1" velocity="0.4"/>', "", ["<limit"]),
        ('xyz="2 0.02 0"', 'xyz="2 0.02"', ["arm_joint", "2 0.02", "3"]),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', ["swing_joint", "zero"]),
        ('<axis xyz="0 0 1"/>', '<axis xyz="1 0 0"/>', ["swing_joint", "up or down"]),
        ('size="1 0.2 0.2"', 'size="1 -0.2 0.2"', ["stick", "positive"]),
        ('<box size="1 0.2 0.2"/>', '<capsule radius="1"/>', ["capsule", "cylinder"]),
        ('<mass value="900"/>', '<mass value="-900"/>', ["house", "-900"]),
        ('radius="0.1" length="2"', 'radius="0.1"', ["boom", "length"]),
        ('name="bucket_joint" type="revolute"', 'name="bucket_joint" type="fixed"', ["'bucket'"]),
        ('<sphere radius="0.25"/>', '<mesh filename="gone.stl"/>', ["gone.stl", "not found"]),
        ('<sphere radius="0.25"/>', '<mesh filename="http://x/y.stl"/>', ["http"]),
        ('<collision><origin xyz="0.25 0 0"/><geometry>\n  <sphere radius="0.25"/></geometry>\n  '
         "</collision>", "", ["bucket", "geometry"]),
    ],
)  # fmt: skip
def test_broken_urdf_is_refused_in_one_sentence(tiny, old, new, words):
    text = refusal(tiny((old, new)))
    assert "tiny.urdf" in text
    for word in words:
        assert word in text


def test_two_roots_and_loops(tiny):
    assert "one root" in refusal(tiny(("</robot>", '<link name="lost"/></robot>')))
    loop = (
        '<joint name="x" type="fixed"><parent link="bucket"/><child link="base"/></joint></robot>'
    )
    assert "loop" in refusal(tiny(("</robot>", loop)))
    twice = '<joint name="x" type="fixed"><parent link="base"/><child link="boom"/></joint></robot>'
    assert "two joints" in refusal(tiny(("</robot>", twice)))


def test_axes_that_leave_the_arm_plane_are_refused(tiny):
    text = refusal(tiny(('xyz="1 0 0"/><axis xyz="0 1 0"/>', 'xyz="1 0 0"/><axis xyz="0 1 0.1"/>')))
    assert "bucket_joint" in text
    assert "parallel" in text


def test_missing_files_and_unknown_names(tmp_path):
    assert "mini" in refusal("midi")
    assert "no file" in refusal("nothing.urdf", base_folder=tmp_path)
    assert "ex13" in refusal("")
    (tmp_path / "binary.urdf").write_bytes(b"\xff\xfe\x00\x81")
    assert "not a text file" in refusal(tmp_path / "binary.urdf")
    (tmp_path / "web.urdf").write_text("<html></html>")
    assert "<html>" in refusal(tmp_path / "web.urdf")


def test_a_urdf_without_sidecar_loads_and_says_what_it_assumes(tiny):
    machine = load_machine(str(tiny()))
    assert [j.role for j in machine.joints] == ["swing", "boom", "stick", "bucket"]
    assert [j.name for j in machine.joints][2] == "arm_joint"
    assert machine.joints[0].continuous
    assert machine.joints[1].max_velocity == 0.4
    assert machine.name == "tiny"
    assert not machine.masses_trusted
    said = " ".join(machine.assumptions)
    for word in ("no sidecar", "arm_joint", "acceleration", "tip", "antenna", "tracks", "payload"):
        assert word in said
    np.testing.assert_allclose([machine.tracks.length, machine.tracks.gauge], [2.0, 1.2])
    # The tip: the farthest point of the bucket's sphere from its pivot.
    np.testing.assert_allclose(machine.end_point, [0.5, 0.0, 0.0], atol=1e-3)


def test_roles_come_from_the_structure_when_names_say_nothing(tiny):
    path = tiny(
        ("swing_joint", "j1"), ("boom_joint", "j2"), ("arm_joint", "j3"), ("bucket_joint", "j4")
    )
    machine = load_machine(str(path))
    assert [j.name for j in machine.joints] == ["j1", "j2", "j3", "j4"]
    assert any("place in the chain" in note for note in machine.assumptions)


def test_tilt_and_rotator_follow_the_bucket(tiny):
    more = """<link name="tilter"><collision><geometry><box size="0.3 0.3 0.3"/></geometry>
      </collision></link>
      <link name="tool"><collision><geometry><box size="0.4 0.4 0.4"/></geometry></collision></link>
      <joint name="tilt_joint" type="revolute"><parent link="bucket"/><child link="tilter"/>
      <origin xyz="0.6 0 0"/><axis xyz="1 0 0"/>
      <limit lower="-0.7" upper="0.7" velocity="1"/></joint>
      <joint name="rotator_joint" type="continuous"><parent link="tilter"/><child link="tool"/>
      <origin xyz="0.2 0 0"/><axis xyz="0 0 1"/></joint></robot>"""
    machine = load_machine(str(tiny(("</robot>", more))))
    assert [j.role for j in machine.joints] == [
        "swing",
        "boom",
        "stick",
        "bucket",
        "tilt",
        "rotate",
    ]
    assert [link.part for link in machine.links][-2:] == ["tilt", "rotate"]
    assert machine.links[machine.end_link].name == "tool"
    counted = {frozenset((machine.part_of_body(i), machine.part_of_body(j)))
               for i, j in machine.self_pairs}  # fmt: skip
    assert frozenset(("stick", "tilt")) in counted
    assert frozenset(("bucket", "tilt")) not in counted


def test_marker_of_the_bucket_end_is_kept_rigid_and_is_the_tip(tiny):
    marker = """<link name="bucket_end_link"><visual><geometry><box size="0.001 0.001 0.001"/>
      </geometry></visual></link><joint name="bucket_end_joint" type="revolute">
      <parent link="bucket"/><child link="bucket_end_link"/><origin xyz="0.45 0 -0.1"/>
      <limit lower="-3" upper="3" velocity="1"/></joint></robot>"""
    machine = load_machine(str(tiny(("</robot>", marker))))
    assert len(machine.joints) == 4
    assert machine.links[machine.end_link].name == "bucket_end_link"
    assert machine.sun.lengths[3] == pytest.approx(math.hypot(0.45, 0.1))
    assert machine.body_names.count("bucket/1") == 0
    assert any("bucket_end_joint" in note for note in machine.assumptions)


def test_a_cylinder_and_a_sphere_become_their_bounding_boxes(tiny):
    machine = load_machine(str(tiny()))
    boom, bucket = (machine.body_names.index(name) for name in ("boom/0", "bucket/0"))
    lengths = np.abs(machine.bodies.rotations[boom]) @ machine.bodies.half_extents[boom]
    np.testing.assert_allclose(lengths, [1.0, 0.1, 0.1], atol=1e-6)
    np.testing.assert_allclose(machine.bodies.half_extents[bucket], [0.25] * 3)


def test_inertia_is_turned_into_the_link_frame():
    text = """<robot name="r"><link name="a"><inertial>
      <origin xyz="1 2 3" rpy="0 0 1.5707963267949"/><mass value="2"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="5" iyz="0" izz="7"/></inertial></link>
      </robot>"""
    inertia = parse(text, "r.urdf").links[0].inertia
    assert inertia is not None
    assert inertia.mass == 2.0
    np.testing.assert_allclose(inertia.com, [1, 2, 3])
    np.testing.assert_allclose(inertia.tensor, np.diag([5.0, 1.0, 7.0]), atol=1e-9)


XACRO = """<robot name="tiny" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find tiny_description)/urdf/part.xacro"/>
  <xacro:property name="reach" value="${2.0 + 0.5}"/>"""


def test_xacro_is_expanded_with_packages_found_beside(tiny, tmp_path):
    package = tmp_path / "tiny_description"
    (package / "urdf").mkdir(parents=True)
    (package / "urdf" / "part.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:property name="side" value="0.02"/></robot>'
    )
    change = ('<robot name="tiny">', XACRO)
    path = tiny(change, ('xyz="2 0.02 0"', 'xyz="${reach} ${side} 0"'), name="tiny.xacro")
    machine = load_machine(str(path))
    assert machine.sun.lengths[1] == pytest.approx(2.5)
    (package / "urdf" / "part.xacro").unlink()
    assert "part.xacro" in refusal(path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('<xacro:nothing_of_that_name a="1"/>', "nothing_of_that_name"),
        ('<xacro:property name="x" value="${1/0}"/><link name="${x}"/>', "division"),
        ('<link name="$(find nowhere_at_all)"/>', "nowhere_at_all"),
    ],
)
def test_broken_xacro_is_refused(tiny, line, words):
    start = '<robot name="tiny" xmlns:xacro="http://www.ros.org/wiki/xacro">' + line
    text = refusal(tiny(('<robot name="tiny">', start), name="tiny.xacro"))
    assert words in text
    assert "tiny.xacro" in text


def test_package_meshes_are_found_with_scale_and_unit(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    import trimesh

    folder = tmp_path / "some_package" / "meshes"
    folder.mkdir(parents=True)
    trimesh.creation.box(extents=(500, 400, 300)).export(folder / "b.stl")
    mesh = '<mesh filename="package://some_package/meshes/b.stl" scale="0.001 0.001 0.001"/>'
    machine = load_machine(str(tiny(('<sphere radius="0.25"/>', mesh))))
    bucket = [b for b, name in enumerate(machine.body_names) if name.startswith("bucket")]
    corners = machine.bodies.take(np.array(bucket)).corners().reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.5, 0.4, 0.3], atol=5e-3)
    assert (folder / "b.stl").exists()
    (folder / "b.stl").write_bytes(b"not a mesh")
    assert "b.stl" in refusal(tiny(('<sphere radius="0.25"/>', mesh)))


def test_collada_units_and_axes_are_those_of_the_vertices(shared_data):
    """The undercarriage of a ZX200 is 4.2 m long over its shoes' centres and stands on z = 0."""
    points = mesh_triangles(shared_data / "zx200" / "meshes" / "zx200-crawler.dae").reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    assert high[0] - low[0] == pytest.approx(4.35, abs=0.02)
    assert low[2] == pytest.approx(0.0, abs=0.01)


def test_collada_in_millimetres(shared_data, tmp_path):
    source = (shared_data / "zx200" / "meshes" / "zx200-arm-cyl1.dae").read_text()
    assert '<unit name="meter" meter="1"/>' in source
    changed = source.replace('<unit name="meter" meter="1"/>', '<unit name="mm" meter="0.001"/>')
    (tmp_path / "a.dae").write_text(source)
    (tmp_path / "b.dae").write_text(changed)
    in_metres, in_millimetres = (
        mesh_triangles(tmp_path / "a.dae"),
        mesh_triangles(tmp_path / "b.dae"),
    )
    np.testing.assert_allclose(in_millimetres, in_metres / 1000.0)
