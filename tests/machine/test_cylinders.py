"""Cylinders reach between their pins, and their sweep holds them at every joint value."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from backend.errors import InputError
from backend.machine.cylinders import (
    SAMPLES,
    Cylinder,
    Strut,
    common_pin,
    connected,
    stroke,
    strut_poses,
    swept_triangles,
    tube,
)
from backend.machine.cylinders_read import read_cylinder
from backend.spatial import rotation, transform

X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def bar(radius: float, length: float) -> Strut:
    return Strut(tube(radius, length), np.zeros(3), X, Y)


CYLINDER = Cylinder(
    name="boom",
    barrel_link="upper",
    barrel_pivot=np.array([0.7, 0.0, -0.5]),
    rod_link="boom",
    rod_pivot=np.array([1.5, 0.0, 0.3]),
    carried_by="boom",
    hinge=Y,
    barrel=bar(0.08, 1.0),
    rod=bar(0.04, 1.0),
)


def poses(q: np.ndarray) -> dict[str, np.ndarray]:
    """The upper body fixed, the boom turned up by q about its pivot at the origin."""
    still = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    return {"upper": still, "boom": transform.make(rotation.ry(-q), np.zeros(3))}


def test_stroke_follows_the_law_of_cosines() -> None:
    q = np.linspace(-0.4, 0.9, 7)
    a, b = np.hypot(0.7, 0.5), np.hypot(1.5, 0.3)
    between = q + np.arctan2(0.3, 1.5) + np.arctan2(0.5, 0.7)
    expected = np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(between))
    assert stroke(CYLINDER, poses(q)) == pytest.approx(expected)


def test_barrel_and_rod_lie_on_the_line_between_the_pins() -> None:
    q = np.linspace(-0.4, 0.9, 5)
    (_, T_barrel), (_, T_rod) = strut_poses(CYLINDER, poses(q))
    assert T_barrel[:, :3, 0] == pytest.approx(-T_rod[:, :3, 0])
    assert T_rod[:, :3, 3] == pytest.approx(np.tile([1.5, 0.0, 0.3], (5, 1)))
    gap = T_rod[:, :3, 3] - T_barrel[:, :3, 3]
    assert np.cross(gap, T_barrel[:, :3, 0]) == pytest.approx(np.zeros((5, 3)), abs=1e-12)


def test_the_sweep_holds_the_cylinder_between_the_samples() -> None:
    """Sideways all bars are convex, so the sweep's hull per sample pair must hold them."""
    low, high = -0.4, 0.9
    swept = swept_triangles(CYLINDER, poses(np.linspace(low, high, SAMPLES)))
    directions = rotation.ry(np.linspace(0.0, 2 * np.pi, 37)) @ X
    reach = (swept.reshape(-1, 3) @ directions.T).max(axis=0)
    for strut, T in strut_poses(CYLINDER, poses(np.random.default_rng(3).uniform(low, high, 50))):
        corners = transform.apply(T, strut.triangles.reshape(-1, 3))
        assert ((corners @ directions.T).max(axis=(0, 1)) <= reach + 1e-3).all()


def test_a_sweep_that_stands_still_is_the_part_itself() -> None:
    swept = swept_triangles(CYLINDER, poses(np.zeros(3)))
    volume = sum(ConvexHull(p.reshape(-1, 3)).volume for p in connected(swept))
    alone = sum(
        ConvexHull(s.triangles.reshape(-1, 3)).volume for s in (CYLINDER.barrel, CYLINDER.rod)
    )
    assert volume == pytest.approx(alone, rel=0.35)  # barrel and rod may share a corner


def test_a_tube_encloses_its_circle() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    circle = np.stack([np.full(100, 0.5), 0.1 * np.cos(angle), 0.1 * np.sin(angle)], axis=1)
    hull = ConvexHull(tube(0.1, 1.0).reshape(-1, 3))
    assert (circle @ hull.equations[:, :3].T + hull.equations[:, 3] <= 1e-9).all()
    assert len(connected(tube(0.1, 1.0, spread=0.3))) == 2


@pytest.mark.parametrize("side", [-1, 1])
def test_the_common_pin_keeps_both_lengths(side: int) -> None:
    rng = np.random.default_rng(2)
    a, c = np.zeros((20, 3)), rng.uniform(-0.4, 0.4, (20, 3)) * [1.0, 0.0, 1.0]
    pin = common_pin(a, c, 0.6, 0.6, side, Y)
    assert np.linalg.norm(pin - a, axis=1) == pytest.approx(np.full(20, 0.6))
    assert np.linalg.norm(pin - c, axis=1) == pytest.approx(np.full(20, 0.6))
    assert (np.sign(np.cross(c - a, pin - a) @ Y) == side).all()


def test_a_linkage_that_cannot_close_is_refused() -> None:
    with pytest.raises(ValueError, match="does not close"):
        common_pin(np.zeros((1, 3)), X[None], 0.3, 0.3, 1, Y)


TABLE = {
    "name": "boom",
    "barrel_link": "upper",
    "barrel_pivot": [0.7, 0.0, -0.5],
    "rod_link": "boom",
    "rod_pivot": [1.5, 0.0, 0.3],
    "carried_by": "boom",
    "barrel": {"radius": 0.08, "length": 1.0},
    "rod": {"radius": 0.04, "length": 1.0},
}


def no_mesh(name: str) -> np.ndarray:
    raise AssertionError(name)


def test_a_table_of_bars_reads_as_the_same_cylinder() -> None:
    read = read_cylinder(TABLE, no_mesh, "x.toml")
    q = np.linspace(-0.4, 0.9, 9)
    assert np.array_equal(swept_triangles(read, poses(q)), swept_triangles(CYLINDER, poses(q)))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"rod": {"radius": -1.0, "length": 1.0}}, "rod.radius"),
        ({"rod": {"mesh": "a.dae"}}, "toward"),
        ({"rod_pivot": None}, "linkage"),
        ({"stroke": 1.0}, "stroke"),
        ({"hinge": [0.0, 0.0, 0.0]}, "hinge"),
    ],
)
def test_wrong_tables_are_said_in_one_sentence(change: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says) as error:
        read_cylinder({**TABLE, **change}, no_mesh, "x.toml")
    assert str(error.value).startswith("x.toml: cylinder boom: ")
    assert "\n" not in str(error.value)


def test_the_shipped_sidecar_closes_over_the_whole_range(
    shared_data: Path, repository: Path
) -> None:
    """Joint origins and limits as in zx200.xacro; strokes as a machine of this class has them."""
    from backend.machine.meshes import mesh_triangles

    folder = shared_data / "zx200" / "meshes"
    tables = tomllib.loads((repository / "scenes/machines/zx200.toml").read_text())["cylinder"]
    cylinders = {
        t["name"]: read_cylinder(t, lambda m: mesh_triangles(folder / Path(m).name), "zx200.toml")
        for t in tables
    }
    joints = {
        "boom": (32.0357, (0.22767, -0.040187, 0.83669), -1.137, -0.1, 2.44, 3.07),
        "stick": (16.9707, (4.7878, 0.010957, 2.9959), 0.594, 2.687, 1.82, 3.30),
        "bucket": (-9.20083, (1.8954, -0.023546, 2.1809), -0.622, 2.372, 1.68, 2.67),
    }
    for name, (degrees, origin, low, high, shortest, longest) in joints.items():
        c = cylinders[name]
        q = np.linspace(low, high, SAMPLES)
        moved = transform.make(rotation.ry(np.radians(degrees) + q), np.array(origin))
        still = np.broadcast_to(np.eye(4), moved.shape)
        length = stroke(c, {c.barrel_link: still, c.rod_link: moved})
        assert shortest < length.min() < length.max() < longest
        # The rod never leaves the barrel.
        reach = np.linalg.norm(c.rod.toward - c.rod.pin) + np.linalg.norm(c.barrel.toward)
        assert length.max() < reach + 0.1
