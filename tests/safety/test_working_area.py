"""Working areas: no body is ever outside, by forward kinematics of all corners, nor far inside."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from backend.machine import kinematics
from backend.machine.arm_extent import extent_of
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.safety.area_records import Area, Within, WorkingArea
from backend.safety.working_area import Stand, touches, unknown, within, working_area
from backend.spatial import rotation, transform
from backend.spatial.angles import wrap
from backend.spatial.types import Array

SAMPLES = 250
MODELS = ["mini", "ex13", "rail6", "zx200", "turned"]
TURNED = """<robot name="turned">
  <link name="base"><collision><origin xyz="0 0 0.2"/><geometry><box size="2 1.5 0.4"/></geometry>
  </collision></link>
  <link name="house"><collision><origin xyz="-0.2 0 0.4"/><geometry><box size="1.9 1 0.6"/>
    </geometry></collision></link>
  <link name="boom"><collision><origin xyz="1 0.1 0"/><geometry><box size="2 0.2 0.2"/></geometry>
  </collision></link>
  <link name="stick"><collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.2 0.2"/></geometry>
  </collision></link>
  <link name="bucket"><collision><origin xyz="0.25 0 0.1"/><geometry><box size="0.5 0.8 0.4"/>
    </geometry></collision></link>
  <joint name="swing_joint" type="revolute"><parent link="base"/><child link="house"/>
    <origin xyz="0.3 0.1 0.5" rpy="0 0 1.0"/><axis xyz="0 0 -1"/>
    <limit lower="-1.1" upper="0.7" effort="1" velocity="0.4"/></joint>
  <joint name="boom_joint" type="revolute"><parent link="house"/><child link="boom"/>
    <origin xyz="0.3 0.05 0.4"/><axis xyz="0 -1 0"/>
    <limit lower="-0.6" upper="1.2" effort="1" velocity="0.4"/></joint>
  <joint name="arm_joint" type="revolute"><parent link="boom"/><child link="stick"/>
    <origin xyz="2 0.02 0"/><axis xyz="0 1 0"/>
    <limit lower="0.3" upper="2.6" effort="1" velocity="0.6"/></joint>
  <joint name="bucket_joint" type="revolute"><parent link="stick"/><child link="bucket"/>
    <origin xyz="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="2.2" effort="1" velocity="0.9"/></joint>
</robot>
"""


@pytest.fixture(scope="module", params=MODELS)
def machine(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Machine:
    if request.param == "turned":  # limited swing of the other sign, its arm not ahead at 0
        path = tmp_path_factory.mktemp("turned") / "turned.urdf"
        path.write_text(TURNED)
        loaded = load_machine(str(path))
        assert (loaded.sun.azimuth_sign, round(loaded.sun.azimuth_offset, 6)) == (-1.0, 1.0)
        return loaded
    if request.param == "zx200":
        shared: Path = request.getfixturevalue("shared_data")
        if not shared.is_dir():
            pytest.skip("the machine's description is not here")
        return load_machine("zx200.xacro", base_folder=shared / "zx200")
    return load_machine(request.param)


class Case(NamedTuple):
    """A machine that stands somewhere, and its true corners in the site's plane."""

    machine: Machine
    stand: Stand
    T: Array  # (4, 4) of its root

    def seen(self, q: Array, T: Array | None = None) -> Array:
        """(s, b, 8, 2) of all bodies about the swing centre as it was: of q (s, n), T (s, 4, 4)."""
        P = kinematics.link_poses(self.machine, q, self.T if T is None else T)
        P = P[:, self.machine.body_link_index]
        # Only what is seen from above; the corners are columns.
        corners = P[..., :2, :3] @ np.swapaxes(self.machine.body_corners, 1, 2)
        plan = np.swapaxes(corners, 2, 3) + P[..., None, :2, 3]
        return np.asarray(plan - self.stand.center)


def limits(machine: Machine) -> tuple[Array, Array]:
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    return low, np.where(np.isfinite(machine.upper), machine.upper, np.pi)


def case(machine: Machine, rng: np.random.Generator, slope: float, moving: bool) -> Case:
    """slope: of pitch and roll, at most [rad]; moving: the tracks drive and turn."""
    q = rng.uniform(*limits(machine))
    rates = rng.uniform(-1.0, 1.0, len(q)) * machine.max_velocity
    yaw = rng.uniform(-np.pi, np.pi)
    R = rotation.from_attitude(yaw, *rng.uniform(-slope, slope, 2))
    T = transform.make(R, np.array([30.0, -12.0, 1.0]))
    axis = T[:3, :3] @ machine.arm.T_root_swing[:3, 2]
    center = kinematics.swing_center(machine, T)[:2]
    speed, yaw_rate = (rng.uniform(0.0, 0.5), rng.uniform(-0.3, 0.3)) if moving else (0.0, 0.0)
    lever = float(np.linalg.norm(center - T[:2, 3]))
    stand = Stand(
        q,
        rates,
        sigma_q=0.003,
        sigma_rate=0.03,
        center=center,
        azimuth=float(kinematics.azimuth(machine, q, T)),
        tilt=math.acos(min(axis[2], 1.0)),
        yaw_rate=yaw_rate,
        sigma_yaw=0.01 if moving else 0.0,
        speed=speed + abs(yaw_rate) * lever,
        sigma_position=0.02 if moving else 0.0,
    )
    return Case(machine, stand, T)


def later(
    one: Case, rng: np.random.Generator, dt: float, extreme: bool = False
) -> tuple[Array, Array]:
    """(s, n) joint values and (s, 4, 4) bases that may be up to dt from now."""
    s = one.stand
    t = dt * np.where(rng.random((SAMPLES, 1)) < 0.5, 1.0, rng.random((SAMPLES, 1)))
    doubt = rng.choice([-3.0, 3.0] if extreme else [-3.0, -1.0, 0.5, 3.0], (SAMPLES, len(s.q)))
    off = rng.choice([-3.0, 3.0], (SAMPLES, len(s.q)))
    q = s.q + t * (s.rates + doubt * s.sigma_rate) + off * s.sigma_q
    q = np.clip(q, np.minimum(one.machine.lower, s.q), np.maximum(one.machine.upper, s.q))
    turned = t[:, 0] * s.yaw_rate + rng.uniform(-3.0, 3.0, SAMPLES) * s.sigma_yaw
    way = 3.0 * s.sigma_position + t[:, 0] * s.speed
    going = rng.uniform(-np.pi, np.pi, SAMPLES)
    T = np.tile(one.T, (SAMPLES, 1, 1))
    T[:, :3, :3] = rotation.rz(turned) @ one.T[:3, :3]
    moved = np.stack([np.cos(going), np.sin(going)], axis=1) * way[:, None]
    # Its tracks turn about the swing centre; what that leaves out is in the stand's speed.
    arm = np.append(s.center, 0.0) - one.T[:3, 3]
    T[:, :3, 3] += arm - np.einsum("sij,j->si", rotation.rz(turned), arm)
    T[:, :2, 3] += moved
    return q, T


def areas(found: WorkingArea) -> tuple[Area, Area, Area]:
    assert found.current is not None
    assert found.predicted is not None
    assert found.maximum is not None
    return found.current, found.predicted, found.maximum


def outside(area: Area, corners: Array, rng: np.random.Generator) -> Array:
    """(k, 2) of the corners, and of points on the bodies between them, that are not in the area."""
    share = rng.dirichlet(np.full(8, 0.3), (8, *corners.shape[:2]))
    between = np.einsum("msbk,sbkx->msbx", share, corners).reshape(-1, 2)
    points = np.concatenate([corners.reshape(-1, 2), between])
    r, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    in_sector = (r <= area.reach + 1e-7) & (
        np.mod(angle - area.start, 2.0 * np.pi) <= 1e-7 + area.end - area.start
    )
    return np.asarray(points[~in_sector & (r > area.body + 1e-7)])


@pytest.mark.parametrize(("slope", "moving"), [(0.0, False), (0.2, False), (0.1, True)])
def test_no_body_is_ever_outside(machine: Machine, slope: float, moving: bool) -> None:
    rng = np.random.default_rng(round(100 * slope) + moving)
    for dt in (1.0, 1.0, 0.3, 2.0, 1.0, 0.1):
        one = case(machine, rng, slope, moving)
        now, ahead, most = areas(working_area(machine, one.stand, dt))
        assert not len(outside(now, one.seen(one.stand.q[None]), rng))
        assert not len(outside(ahead, one.seen(*later(one, rng, dt)), rng))
        anywhere = rng.uniform(*limits(machine), (SAMPLES, len(one.stand.q)))
        assert not len(outside(most, one.seen(anywhere), rng))


def test_it_is_not_much_larger_than_needed(machine: Machine) -> None:
    """On level ground, standing: now and at most nearly exact, predicted by a tenth on average."""
    rng = np.random.default_rng(7)
    tilts = len(machine.joints) > 4
    over: list[list[float]] = []
    for _ in range(8):
        one = case(machine, rng, 0.0, False)
        found = areas(working_area(machine, one.stand, 1.0))
        q, _ = later(one, rng, 1.0, extreme=True)
        low, high = limits(machine)
        anywhere = low + (high - low) * np.clip(
            rng.uniform(-0.5, 1.5, (6 * SAMPLES, len(low))), 0, 1
        )
        rows = []
        for area, values in zip(found, (one.stand.q[None], q, anywhere), strict=True):
            r = np.hypot(*one.seen(values).reshape(-1, 2).T)
            rows.append(area.reach / max(float(r.max()), area.body))
        over.append(rows)
    now, ahead, most = np.array(over).T
    # What is tilted and rotated counts in all its positions.
    assert now.max() < (1.2 if tilts else 1.01)
    assert ahead.mean() < (1.2 if tilts else 1.1)
    assert ahead.max() < (1.4 if tilts else 1.3)
    assert most.max() < 1.08


def test_the_sector_is_as_wide_as_swing_and_bodies() -> None:
    """Stretched out: the bucket's half width at the edge of the disc, and how far it swings."""
    machine = load_machine("mini")
    q = np.array([0.4, 0.1, -0.5, 0.2])
    rates = np.array([0.5, 0.0, 0.0, 0.0])
    still = Stand(q, 0 * rates, 0.0, 0.0, np.zeros(2), 1.4, 0.0, 0.0, 0.0, 0.0, 0.0)
    now, ahead, most = areas(working_area(machine, still, 1.0))
    assert (now.start, now.end, now.reach) == (ahead.start, ahead.end, ahead.reach)
    corners = Case(machine, still, np.eye(4)).seen(q[None])[0]
    far = np.hypot(*corners.reshape(-1, 2).T)
    beyond = corners.reshape(-1, 2)[far > now.body]
    seen = wrap(np.arctan2(beyond[:, 1], beyond[:, 0]) - 0.4)
    assert now.end - 1.4 == pytest.approx(1.4 - now.start)
    assert 0.0 <= now.end - 1.4 - seen.max() < 0.02
    assert most.end - most.start == pytest.approx(2.0 * np.pi)
    swung = areas(working_area(machine, still._replace(rates=rates), 1.0))[1]
    assert swung.start == pytest.approx(now.start)
    assert swung.end == pytest.approx(now.end + 0.5)
    doubted = areas(working_area(machine, still._replace(sigma_rate=0.1), 1.0))[1]
    assert doubted.start == pytest.approx(wrap(now.start - 0.3), abs=0.02)
    assert doubted.reach > now.reach


def test_a_limited_swing_limits_the_maximum(tmp_path: Path) -> None:
    path = tmp_path / "turned.urdf"
    path.write_text(TURNED)
    machine = load_machine(str(path))
    q = np.array([0.0, 0.5, 0.5, 0.3])
    T = np.eye(4)
    azimuth = float(kinematics.azimuth(machine, q, T))
    stand = Stand(q, 0 * q, 0.0, 0.0, np.zeros(2), azimuth, 0.0, 0.0, 0.0, 0.0, 0.0)
    now, _, most = areas(working_area(machine, stand, 1.0))
    assert azimuth == pytest.approx(1.0)
    # The swing's lower limit is where the azimuth is largest.
    assert most.end - 1.0 >= 1.1 + (now.end - 1.0) - 1e-9
    assert 1.0 - most.start >= 0.7 + (1.0 - now.start) - 1e-9
    assert not most.whole


def test_the_prediction_holds_the_present_and_grows_with_time(machine: Machine) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        one = case(machine, rng, 0.1, True)
        now, _, _ = areas(working_area(machine, one.stand, 1.0))
        before = now
        for dt in (0.0, 0.2, 1.0, 3.0):
            ahead = areas(working_area(machine, one.stand, dt))[1]
            assert ahead.reach >= before.reach - 1e-12
            assert ahead.body >= before.body - 1e-12
            assert ahead.end - ahead.start >= before.end - before.start - 1e-12
            before = ahead


def test_who_is_in_it() -> None:
    area = WorkingArea(
        "",
        1.0,
        np.array([10.0, 20.0]),
        Area(1.2, 3.0, -0.1, 0.1),
        Area(1.2, 3.5, -0.6, 0.8),
        Area(1.2, 4.4, -np.pi, np.pi),
    )
    polar = [
        (1.1, 3.0, Within.CURRENT),  # beside the tail
        (2.9, 0.0, Within.CURRENT),
        (2.9, 0.3, Within.PREDICTED),
        (3.3, 0.0, Within.PREDICTED),
        (3.3, -0.9, Within.MAXIMUM),
        (4.3, np.pi, Within.MAXIMUM),
        (4.5, 0.0, Within.NONE),
    ]
    places = np.array([[10.0 + r * np.cos(a), 20.0 + r * np.sin(a)] for r, a, _ in polar])
    found = within(area, places, np.zeros(len(polar)))
    assert found.tolist() == [kind for _, _, kind in polar]
    nearer = within(area, places, np.full(len(polar), 0.25))
    assert (nearer >= found).all()
    assert nearer[3:].tolist() == [Within.PREDICTED, Within.MAXIMUM, Within.MAXIMUM, 1]
    assert not within(WorkingArea("unknown", 1.0), places, np.zeros(len(polar))).any()


def test_a_disc_touches_where_its_points_do() -> None:
    rng = np.random.default_rng(5)
    for _ in range(60):
        start = rng.uniform(-np.pi, np.pi)
        area = Area(
            rng.uniform(0.5, 1.5), rng.uniform(1.0, 4.0), start, start + rng.uniform(0, 6.2)
        )
        place, radius = rng.uniform(-5.0, 5.0, 2), rng.uniform(0.1, 1.0)
        # All of the area, densely, against one point.
        r, a = np.meshgrid(np.linspace(0, area.reach, 400), np.linspace(area.start, area.end, 700))
        sector = np.stack([r * np.cos(a), r * np.sin(a)]).reshape(2, -1).T
        gap = min(float(np.hypot(*(sector - place).T).min()), float(np.hypot(*place)) - area.body)
        if abs(gap - radius) > 0.03:
            assert bool(touches(area, place[None], np.array([radius]))[0]) == (gap < radius)


def test_what_is_not_known_is_no_area() -> None:
    machine = load_machine("mini")
    found = unknown(machine, "position is 0.6 s old")
    assert (found.reason, found.current, found.predicted) == ("position is 0.6 s old", None, None)
    assert found.maximum is None
    assert found.tail == pytest.approx(extent_of(machine).tail)
