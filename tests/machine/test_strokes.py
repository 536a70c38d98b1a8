"""Strokes against geometry done another way: law of cosines, and a four-bar closed by search."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from backend.errors import InputError
from backend.machine.cylinders import stroke as pins_apart
from backend.machine.cylinders_read import read_cylinder
from backend.machine.kinematics import link_poses
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.machine.strokes import BEYOND, Stroke, angle, length_and_slope, position, rate

PINS = """
[[cylinder]]
name = "lift"
barrel_link = "house"
barrel_pivot = [0.7, 0.05, 0.1]
rod_link = "boom"
rod_pivot = [1.0, 0.0, 0.15]
closed_length = 0.4

[[cylinder]]
name = "arm"
barrel_link = "stick"       # turned round: the barrel is on the link that the joint moves
barrel_pivot = [-0.3, 0.12, 0.15]
rod_link = "boom"
rod_pivot = [0.9, 0.0, 0.3]

[[cylinder]]
name = "bucket"
barrel_link = "stick"
barrel_pivot = [0.15, 0.0, 0.2]
rod_link = "bucket"
[cylinder.linkage]
rocker_pivot = [0.914, 0.0, -0.035]
tie_pivot = [0.005, 0.0, 0.13]
rocker_length = 0.195
tie_length = 0.177
side = -1
"""


def with_pins(tiny: Callable[..., Path], pins: str = PINS, *changes: tuple[str, str]) -> Machine:
    path = tiny()
    for old, new in changes:
        assert old in pins
        pins = pins.replace(old, new)
    path.with_suffix(".toml").write_text(pins)
    return load_machine(str(path))


@pytest.fixture
def jointed(tiny: Callable[..., Path]) -> Machine:
    return with_pins(tiny)


def draws(stroke: Stroke, count: int, seed: int) -> np.ndarray:
    ends = stroke.angles[0], stroke.angles[-1]
    return np.random.default_rng(seed).uniform(min(ends), max(ends), count)


def test_boom_and_arm_follow_the_law_of_cosines(jointed: Machine) -> None:
    """Joint axes are +y: a positive value lowers. Arm: barrel and rod 0.1 m apart along it."""
    lift, arm, _ = jointed.strokes
    q = draws(lift, 500, 1)
    a, b = math.hypot(0.4, 0.3), math.hypot(1.0, 0.15)
    between = math.atan2(0.15, 1.0) - q - math.atan2(-0.3, 0.4)
    expected = np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(between))
    np.testing.assert_allclose(length_and_slope(lift, q)[0], expected, atol=1e-12)
    np.testing.assert_allclose(position(lift, q), expected - 0.4, atol=1e-12)
    q = draws(arm, 500, 2)
    a, b = math.hypot(1.1, 0.3), math.hypot(0.3, 0.15)
    between = math.atan2(0.15, -0.3) - q - math.atan2(0.3, -1.1)
    flat = a * a + b * b - 2.0 * a * b * np.cos(between)
    aside = 0.12 + 0.02  # the stick stands 0.02 m left of the boom
    expected = np.sqrt(flat + aside * aside)
    np.testing.assert_allclose(length_and_slope(arm, q)[0], expected, atol=1e-12)
    assert arm.shortest == 0.0
    assert arm.longest == pytest.approx(expected.max() - expected.min(), abs=0.01)


def closed_by_search(q: float) -> float:
    """From pin to pin of the bucket's cylinder: the rocker turned until the tie is as long as it
    is, on the upper side of the line between the pivots.
    """
    c, s = math.cos(q), math.sin(q)
    tie = np.array([1.0 + 0.005 * c + 0.13 * s, -0.005 * s + 0.13 * c])  # x, z about +y
    pivot = np.array([0.914, -0.035])

    def pin(turned: float) -> np.ndarray:
        return pivot + 0.195 * np.array([math.cos(turned), math.sin(turned)])

    def too_long(turned: float) -> float:
        return float(np.linalg.norm(pin(turned) - tie)) - 0.177

    straight = math.atan2(*(tie - pivot)[::-1])
    turned = brentq(too_long, straight, straight + math.pi, xtol=1e-14)
    return float(np.linalg.norm(pin(turned) - np.array([0.15, 0.2])))


def test_the_bucket_follows_its_four_bar(jointed: Machine) -> None:
    bucket = jointed.strokes[2]
    q = draws(bucket, 300, 3)
    expected = [closed_by_search(value) for value in q]
    np.testing.assert_allclose(length_and_slope(bucket, q)[0], expected, atol=1e-10)


def test_the_opposite_hinge_with_the_opposite_side_is_the_same(
    jointed: Machine, tiny: Callable[..., Path]
) -> None:
    turned = ('rod_link = "bucket"', 'rod_link = "bucket"\nhinge = [0.0, -2.0, 0.0]')
    other = with_pins(tiny, PINS, turned, ("side = -1", "side = 1")).strokes[2]
    q = draws(other, 50, 4)
    np.testing.assert_allclose(position(other, q), position(jointed.strokes[2], q), atol=1e-12)


def test_strokes_give_the_angles_they_came_from(
    jointed: Machine, mini: Machine, ex13: Machine
) -> None:
    every = [*jointed.strokes, *mini.strokes, *ex13.strokes]
    assert len(every) == 9
    for k, stroke in enumerate(every):
        q = draws(stroke, 1200, 10 + k)
        back = [angle(stroke, float(read)) for read in position(stroke, q)]
        np.testing.assert_allclose(back, q, atol=1e-9, rtol=0.0)
        for end in (0, -1):
            read = stroke.lengths[end] - stroke.closed_length
            assert angle(stroke, read) == pytest.approx(stroke.angles[end], abs=1e-9)


def test_slopes_and_rates_are_finite_differences(jointed: Machine) -> None:
    h = 1e-6
    for stroke in jointed.strokes:
        q = draws(stroke, 200, 5)
        slope = (position(stroke, q + h) - position(stroke, q - h)) / (2.0 * h)
        np.testing.assert_allclose(length_and_slope(stroke, q)[1], slope, atol=1e-8)
        ahead = position(stroke, q) + 0.1 * h
        turned = (np.array([angle(stroke, float(read)) for read in ahead]) - q) / h
        inside = (ahead > stroke.shortest) & (ahead < stroke.longest)
        np.testing.assert_allclose(rate(stroke, q, 0.1)[inside], turned[inside], atol=1e-2)


def test_beyond_the_range_it_goes_on_for_5_mm_and_then_is_no_angle(jointed: Machine) -> None:
    for stroke in jointed.strokes:
        for end, sign in ((0, -1.0), (-1, 1.0)):
            read, q = stroke.lengths[end] - stroke.closed_length, stroke.angles[end]
            slope = float(length_and_slope(stroke, q)[1])
            near = angle(stroke, read + sign * 0.99 * BEYOND)
            assert near == pytest.approx(q + sign * 0.99 * BEYOND / slope, abs=1e-12)
            assert rate(stroke, near, 1.0) == pytest.approx(1.0 / slope)
            assert math.isnan(angle(stroke, read + sign * 1.01 * BEYOND))
        assert math.isnan(angle(stroke, math.nan))
        assert math.isnan(angle(stroke, math.inf))


def test_a_length_of_0_when_closed_reads_from_pin_to_pin(tiny: Callable[..., Path]) -> None:
    lift = with_pins(tiny, PINS, ("closed_length = 0.4", "closed_length = 0.0")).strokes[0]
    q = draws(lift, 20, 6)
    np.testing.assert_array_equal(position(lift, q), length_and_slope(lift, q)[0])
    assert lift.shortest > 0.5


def test_names_are_by_role_joint_and_table(jointed: Machine) -> None:
    assert [stroke.names for stroke in jointed.strokes] == [
        ("boom_cylinder", "lift_cylinder"),
        ("stick_cylinder", "arm_cylinder"),
        ("bucket_cylinder",),
    ]
    assert [stroke.joint for stroke in jointed.strokes] == [1, 2, 3]


def test_pins_alone_are_no_bodies(jointed: Machine, tiny: Callable[..., Path]) -> None:
    plain = load_machine(str(tiny(name="plain.urdf")))
    np.testing.assert_array_equal(jointed.bodies.centers, plain.bodies.centers)
    assert plain.strokes == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[1.0, 0.0, 0.15]", "[-0.3, 0.0, 1.0]", ["lift", "turns round", "deg of boom_joint"]),
        ("[1.0, 0.0, 0.15]", "[0.0, 0.0, 0.0]", ["lift", "stands still"]),
        ("tie_length = 0.177", "tie_length = 0.03", ["bucket", "do not meet", "bucket_joint"]),
        ("side = -1", "side = -1\nrocker = 3", ["bucket", "rocker"]),
        ("closed_length = 0.4", "closed_length = -0.4", ["lift", "closed_length"]),
        ("closed_length = 0.4", "barrel = { radius = 0.1, length = 1.0 }", ["lift", "both"]),
        ('rod_link = "bucket"', 'rod_link = "bucket"\nhinge = [0.0, 1.0, 0.1]', ["hinge"]),
        ('rod_link = "boom"\nrod_pivot = [1.0', 'rod_link = "arm"\nrod_pivot = [1.0', ["'arm'"]),
        ('barrel_link = "house"', 'barrel_link = "base"', ["one joint", "swing_joint"]),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(
    tiny: Callable[..., Path], old: str, new: str, words: list[str]
) -> None:
    with pytest.raises(InputError) as error:
        with_pins(tiny, PINS, (old, new))
    text = str(error.value)
    assert "tiny.toml: cylinder " in text
    assert "\n" not in text
    for word in words:
        assert word in text


def test_the_angle_where_it_turns_is_named(tiny: Callable[..., Path]) -> None:
    """The pin at 1 m on the line from the foot through the axis, 53.1 deg short of it at 0."""
    with pytest.raises(InputError, match="turns round") as error:
        with_pins(tiny, PINS, ("[1.0, 0.0, 0.15]", "[0.28, 0.0, 0.96]"))
    # foot at -36.87 deg, pin at 73.74 deg - q: in line when q = -69.39 deg, beyond the limits'
    # -68.75; within a quarter of a degree of it the length moves less than 0.01 m/rad.
    at = float(str(error.value).split(" deg of")[0].rsplit(" ", 1)[1])
    assert at == pytest.approx(-68.75, abs=0.1)
    with pytest.raises(InputError, match="turns round") as error:
        with_pins(tiny, PINS, ("[1.0, 0.0, 0.15]", "[0.0, 0.0, 1.0]"))
    at = float(str(error.value).split(" deg of")[0].rsplit(" ", 1)[1])
    assert at == pytest.approx(90.0 + 36.87 - 180.0, abs=0.3)


def test_the_ex13s_pins_lie_in_its_bodies(ex13: Machine, repository: Path) -> None:
    """All postures: feet, rods' pins, and the bucket linkage's, in the plane of the arm."""
    tables = tomllib.loads((repository / "scenes/machines/ex13/ex13.toml").read_text())["cylinder"]
    links = {link.name: k for k, link in enumerate(ex13.links)}

    def held(link: str, point: list[float]) -> bool:
        local = np.einsum("bji,bj->bi", ex13.bodies.rotations, point - ex13.bodies.centers)
        inside = (np.abs(local) <= ex13.bodies.half_extents + 2e-3).all(axis=1)
        return bool((inside & (ex13.body_link_index == links[link])).any())

    for table in tables:
        assert held(table["barrel_link"], table["barrel_pivot"])
        if "linkage" not in table:
            assert held(table["rod_link"], table["rod_pivot"])
    bar = tables[2]["linkage"]
    assert held("stick_link", bar["rocker_pivot"])
    assert held("bucket_link", bar["tie_pivot"])
    bucket = ex13.strokes[2]
    a, d = np.array([2.337, -0.096]), bar["rocker_length"]
    for length in np.linspace(bucket.lengths[0], bucket.lengths[-1], 30):
        foot = np.array([0.05, 0.5])
        apart = float(np.linalg.norm(a - foot))  # pin: d from the rocker's pivot, above foot -> a
        along = (length**2 - d**2 + apart**2) / (2.0 * apart)
        u = (a - foot) / apart
        x, z = foot + along * u + math.sqrt(length**2 - along**2) * np.array([-u[1], u[0]])
        assert held("stick_link", [x, 0.0, z])


def test_the_zx200s_own_cylinders_are_strokes(shared_data: Path) -> None:
    """Against the three-dimensional placing of barrels and rods that their sweep is made with."""

    zx200 = load_machine("zx200.xacro", base_folder=shared_data / "zx200")
    sidecar = Path(__file__).resolve().parents[2] / "scenes/machines/zx200.toml"
    tables = tomllib.loads(sidecar.read_text())["cylinder"]
    names = [link.name for link in zx200.links]
    bar = {"radius": 0.1, "length": 1.0}
    for stroke, table in zip(zx200.strokes, tables, strict=True):
        bare = {**table, "barrel": bar, "rod": bar}
        if "linkage" in table:
            linkage = {k: v for k, v in table["linkage"].items() if k not in ("rocker", "tie")}
            bare["linkage"] = linkage
        cylinder = read_cylinder(bare, lambda mesh: np.zeros((0, 3, 3)), "zx200.toml")
        q = np.zeros((40, len(zx200.joints)))
        q[:, stroke.joint] = draws(stroke, 40, 7)
        T = np.array([link_poses(zx200, one) for one in q])
        poses = {name: T[:, names.index(name)] for name in cylinder.links}
        read = position(stroke, q[:, stroke.joint])
        np.testing.assert_allclose(
            read + stroke.closed_length, pins_apart(cylinder, poses), atol=1e-6
        )
        back = [angle(stroke, float(value)) for value in read]
        np.testing.assert_allclose(back, q[:, stroke.joint], atol=1e-9, rtol=0.0)


def test_the_readmes_example_is_the_minis_bucket(mini: Machine, repository: Path) -> None:
    text = (repository / "scenes/machines/README.md").read_text().split("## Stroke sensors")[1]
    (table,) = tomllib.loads(text.split("```toml\n")[1].split("```")[0])["cylinder"]
    shipped = tomllib.loads((repository / "scenes/machines/mini/mini.toml").read_text())["cylinder"]
    assert table.pop("closed_length") == pytest.approx(mini.strokes[2].closed_length, abs=1e-3)
    assert table == shipped[2]
