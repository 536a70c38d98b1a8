"""The machines that come with the program, the ZX200, and how bodies are made and remembered."""

from __future__ import annotations

import numpy as np
import pytest

from backend.machine import fitting, kinematics
from backend.machine.bodies import overlaps
from backend.machine.load import load_machine, shipped_machines
from backend.machine.model import PARTS, Machine
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import about_axis


def inside(boxes: Boxes, points: np.ndarray, slack: float) -> np.ndarray:
    """(n,) True where a point lies in some box grown by `slack`."""
    local = np.einsum("bji,nbj->nbi", boxes.rotations, points[:, None] - boxes.centers)
    return (np.abs(local) <= boxes.half_extents + slack).all(axis=-1).any(axis=-1)


def test_shipped_machines():
    assert shipped_machines() == ["ex13", "mini", "rail6", "shovel"]


@pytest.mark.parametrize("name", ["mini", "ex13"])
def test_a_shipped_machine_states_everything(name):
    machine = load_machine(name)
    assert machine.name == name
    assert machine.assumptions == ()
    assert machine.masses_trusted
    assert machine.payload > 0
    assert {machine.part_of_body(b) for b in range(len(machine.bodies))} == set(PARTS[:5])
    for part in ("tracks", "upper", "boom", "stick", "bucket"):
        numbers = [n for n in machine.body_names if n.startswith(f"{part}/")]
        assert numbers == [f"{part}/{k}" for k in range(len(numbers))]
        assert len(numbers) >= 2


def test_drawings_stay_inside_the_bodies(request):
    for name in ("mini", "ex13"):
        machine: Machine = request.getfixturevalue(name)
        for i, link in enumerate(machine.links):
            own = machine.bodies.take(
                np.array([b for b, k in enumerate(machine.body_links) if k == i])
            )
            for visual in link.visuals:
                assert inside(own, visual.vertices, 0.03).all(), (name, link.name)


def test_masses_are_physical_and_of_the_class(mini, ex13):
    for machine, low, high in ((mini, 1500, 2200), (ex13, 12000, 14500)):
        inertias = [link.inertia for link in machine.links]
        assert all(inertia is not None for inertia in inertias)
        assert low < sum(inertia.mass for inertia in inertias) < high
        for inertia in inertias:
            a, b, c = np.linalg.eigvalsh(inertia.tensor)
            assert 0 < a <= b <= c < a + b  # triangle inequality of principal moments


def test_working_range_of_the_13_ton_machine(ex13, draw):
    q = draw(ex13, np.random.default_rng(0), 20_000)
    tips = kinematics.end_point(ex13, q)
    assert 8.0 < kinematics.reach(ex13, q).max() < 8.5
    assert -6.0 < tips[:, 2].min() < -5.0


def test_boom_cylinders_of_the_13_ton_machine_are_enclosed_over_their_stroke(ex13):
    """Foot and rod eye as in the URDF's drawing; each point of the line between lies in a body."""
    foot_upper, eye_boom = np.array([0.80, 0.265, -0.53]), np.array([1.85, 0.265, 0.91])
    upper, boom = (next(i for i, k in enumerate(ex13.links) if k.joint == j) for j in (0, 1))
    wanted = [b for b, k in enumerate(ex13.body_links) if k in (upper, boom)]
    for angle in np.linspace(ex13.lower[1], ex13.upper[1], 40):
        T = kinematics.link_poses(ex13, np.array([0.0, angle, -1.0, 0.0]))
        foot = T[upper, :3, :3] @ foot_upper + T[upper, :3, 3]
        eye = T[boom, :3, :3] @ eye_boom + T[boom, :3, 3]
        line = foot + np.linspace(0, 1, 30)[:, None] * (eye - foot)
        across = np.cross(eye - foot, [0.0, 1.0, 0.0])
        across *= 0.07 / np.linalg.norm(across)
        placed = kinematics.body_boxes(ex13, T).take(np.array(wanted))
        for offset in (across, -across, np.array([0, 0.07, 0]), np.array([0, -0.07, 0])):
            assert inside(placed, line + offset, 1e-3).all()


def test_the_arm_is_free_of_itself_in_ordinary_postures(mini, ex13):
    postures = [(30, -60, 30), (26.8, -38.6, 42.2), (44.8, -80.1, -22), (79, -103.7, 14.6),
                (0, -60, -60), (-20, -90, -40), (60, -130, -90)]  # fmt: skip
    for machine in (mini, ex13):
        for posture in postures:
            q = np.radians([15.0, *posture])
            q = np.clip(q, machine.lower, machine.upper)
            boxes = kinematics.body_boxes(machine, kinematics.link_poses(machine, q))
            touching = overlaps(boxes, boxes)
            assert not [pair for pair in machine.self_pairs if touching[pair]], posture


def test_self_pairs_are_pairs_of_parts_that_are_not_neighbours(machine):
    for i, j in machine.self_pairs:
        a, b = (PARTS.index(machine.part_of_body(k)) for k in (i, j))
        assert b - a >= 2
    parts = {(machine.part_of_body(i), machine.part_of_body(j)) for i, j in machine.self_pairs}
    assert {("tracks", "bucket"), ("upper", "bucket"), ("upper", "stick")} <= parts


def test_zx200_loads_unchanged(zx200):
    assert zx200.name == "zx200"
    assert [j.name for j in zx200.joints] == [
        "swing_joint",
        "boom_joint",
        "arm_joint",
        "bucket_joint",
    ]
    assert zx200.joints[0].continuous
    # joint_limits.yaml, not the URDF's 6.16 rad/s
    assert [j.max_velocity for j in zx200.joints] == [1.1, 0.45, 1.1, 1.1]
    assert zx200.sun.signs == (-1.0, -1.0, -1.0)  # +y is down
    assert zx200.sun.lengths[1] == pytest.approx(np.hypot(4.7878, 2.9959))
    assert abs(zx200.arm.tip_lateral) > 0.05  # off the swing plane
    assert not zx200.masses_trusted
    assert any("bucket_end_joint" in note for note in zx200.assumptions)
    assert sum(len(v.faces) for link in zx200.links for v in link.visuals) > 30_000
    assert len({v.color for link in zx200.links for v in link.visuals}) >= 2


def test_touch_test_of_boxes_against_sampled_points():
    random = np.random.default_rng(8)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 13)] * 3), axis=-1).reshape(-1, 3)
    apart = touching = 0
    for _ in range(300):
        axes = random.normal(size=(2, 3))
        R = np.stack([about_axis(a / np.linalg.norm(a), random.uniform(0, 3)) for a in axes])
        pair = Boxes(random.uniform(-0.9, 0.9, (2, 3)), R, random.uniform(0.1, 0.7, (2, 3)))
        a, b = pair.take(np.array([0])), pair.take(np.array([1]))
        points = (grid * b.half_extents) @ b.rotations[0].T + b.centers
        if inside(a, points, 0.0).any():
            touching += 1
            assert overlaps(a, b)[0, 0]
        if not overlaps(a, b)[0, 0]:
            apart += 1
            assert not inside(a, points, 0.0).any()
    assert touching > 50
    assert apart > 50


@pytest.fixture
def meshed(tiny, tmp_path, monkeypatch):
    """A tiny machine with one mesh, and the count of fittings so far."""
    import trimesh

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    trimesh.creation.box(extents=(0.5, 0.4, 0.3)).export(tmp_path / "b.stl")
    calls = []

    def fit(triangles, max_boxes, max_excess, progress=None):
        calls.append((max_boxes, max_excess))
        if progress is not None:
            progress(1.0)
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        return Boxes((low + high)[None] / 2, np.eye(3)[None], (high - low)[None] / 2)

    monkeypatch.setattr(fitting, "fit_boxes", fit)
    return tiny(('<sphere radius="0.25"/>', '<mesh filename="b.stl"/>')), calls


def test_fitted_boxes_are_remembered(meshed, tmp_path):
    path, calls = meshed
    said = []
    first = load_machine(str(path), progress=lambda what, share: said.append((what, share)))
    assert said == [("fitting boxes: bucket", 1.0)]
    again = load_machine(str(path))
    assert calls == [(12, 0.15)]
    np.testing.assert_array_equal(first.bodies.centers, again.bodies.centers)
    path.with_suffix(".toml").write_text("[bodies]\nmax_boxes = 5\nmax_excess = 0.3")
    load_machine(str(path))
    assert calls == [(12, 0.15), (5, 0.3)]
    assert len(list((tmp_path / "cache" / "excavator-cockpit").iterdir())) == 2


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 cut short", None])
def test_a_damaged_cache_is_rebuilt(meshed, tmp_path, damage):
    path, calls = meshed
    load_machine(str(path))
    (kept,) = (tmp_path / "cache" / "excavator-cockpit").iterdir()
    whole = kept.read_bytes()
    kept.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    load_machine(str(path))
    assert len(calls) == 2
    load_machine(str(path))
    assert len(calls) == 2


def test_without_a_place_for_the_cache_it_still_loads(meshed, tmp_path, monkeypatch):
    path, calls = meshed
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    load_machine(str(path))
    assert len(calls) == 1


CYLINDER = """
[[cylinder]]
name = "boom"
barrel_link = "house"
barrel_pivot = [0.6, 0.05, 0.1]
rod_link = "boom"
rod_pivot = [0.9, 0.0, 0.15]
carried_by = "boom"
barrel = {radius = 0.06, length = 0.4}
rod = {radius = 0.04, length = 0.4}
"""


def test_cylinders_of_the_sidecar_are_swept_into_the_bodies(meshed):
    path, calls = meshed
    plain = load_machine(str(path))
    path.with_suffix(".toml").write_text(CYLINDER)
    machine = load_machine(str(path))
    assert len(machine.bodies) == len(plain.bodies) + 1
    pivot = np.array([0.6, 0.05, 0.1])
    house, boom = (next(i for i, k in enumerate(machine.links) if k.joint == j) for j in (0, 1))
    own = machine.bodies.take(np.array([b for b, k in enumerate(machine.body_links) if k == boom]))
    for angle in np.linspace(-1.2, 0.6, 20):
        T = kinematics.link_poses(machine, np.array([0.4, angle, 1.0, 0.0]))
        seen = np.linalg.inv(T[boom]) @ T[house] @ np.append(pivot, 1.0)
        assert inside(own, seen[None, :3], 1e-3).all()
    assert len(calls) == 2
