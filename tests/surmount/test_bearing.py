"""What bears a machine, from geometry alone, against what is known and against the loads' way."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest

from backend.contact.crawler import crawler_of
from backend.machine.load import load_machine
from backend.spatial.rotation import from_attitude, rz
from backend.spatial.transform import make
from backend.stability.masses import mass_model
from backend.stability.polygon import support_polygon
from backend.stability.zmp import margin, zmp
from backend.surmount.bearing import Ledge, bearing, margins
from backend.surmount.machine import climber
from backend.surmount.manoeuvre import Manoeuvre, manoeuvre
from backend.surmount.records import Demands, Parameters, Step

MINI = load_machine("mini")
CRAWLER = crawler_of(MINI)
FLAT = Ledge(np.array([50.0, 0.0]), np.array([1.0, 0.0]), 0.0, 0.3)
UP = np.array([[0.0, 0.9, -1.6, -0.6]])


def on(points: np.ndarray) -> np.ndarray:
    return points[np.isfinite(points).all(axis=1)]


def test_level_it_stands_on_all_of_its_belts() -> None:
    q, T = np.array([[0.4, 0.9, -1.4, -0.3]]), make(from_attitude(0.7), np.array([3.0, 1.0, 0.0]))
    (found,) = bearing(MINI, q, T[None], FLAT)
    local = (on(found) - T[:3, 3]) @ T[:3, :3]
    assert len(local) == 4
    a, half = CRAWLER.half_base, CRAWLER.half_width
    np.testing.assert_allclose(np.abs(local[:, 1]), half, atol=1e-9)
    # To where the end wheels leave the ground: by a hair they are still on it.
    assert (np.abs(local[:, 0]) >= a - 0.02).all()
    assert (np.abs(local[:, 0]) <= a + 0.08).all()
    (got,) = margins(MINI, 0.0, q, T[None], found[None])
    point = zmp(mass_model(MINI), q[0], np.zeros(4), np.zeros(4))
    assert got == pytest.approx(float(margin(point, support_polygon(MINI))), abs=0.16)


def test_leaning_on_an_edge_it_stands_on_its_rear_and_the_edge() -> None:
    lean, height, yaw = math.radians(14.0), 0.25, 0.3
    a, r = CRAWLER.half_base, CRAWLER.radius
    # The rear wheel's centre is its radius above the ground; the underside passes over the edge.
    rear = np.array([0.0, 0.0, r])
    middle = rear + a * np.array([math.cos(lean), 0.0, math.sin(lean)])
    root = middle - r * np.array([-math.sin(lean), 0.0, math.cos(lean)])
    over = root[0] + (height - root[2]) / math.tan(lean)
    turn = rz(yaw)
    T = make(turn @ from_attitude(0.0, lean), turn @ root)
    ledge = Ledge((turn @ np.array([over, 0.0, 0.0]))[:2], turn[:2, 0], 0.0, height)
    (found,) = bearing(MINI, UP, T[None], ledge)
    local = on(found) @ turn
    assert len(local) == 4
    edge = local[local[:, 2] > 0.1]
    np.testing.assert_allclose(edge[:, 0], over, atol=0.03)
    np.testing.assert_allclose(edge[:, 2], height, atol=0.01)
    rest = local[local[:, 2] < 0.1]
    np.testing.assert_allclose(rest[:, 0], 0.0, atol=0.06)
    np.testing.assert_allclose(rest[:, 2], 0.0, atol=0.01)


def test_lifted_it_stands_on_nothing() -> None:
    T = make(np.eye(3), np.array([0.0, 0.0, 0.5]))[None]
    found = bearing(MINI, UP, T, FLAT)
    assert not np.isfinite(found).any()
    assert margins(MINI, 0.0, UP, T, found)[0] == -math.inf


def test_down_a_step_is_the_same_ground_the_other_way() -> None:
    down = Ledge(np.array([2.0, 0.0]), np.array([1.0, 0.0]), 0.0, -0.3, depth=4.0)
    points = np.array([[1.9, 0.0], [2.1, 5.0], [6.1, 0.0]])
    assert down.height(points).tolist() == [0.0, -0.3, 0.0]


@lru_cache(maxsize=1)
def made() -> Manoeuvre:
    """One over 0.25 m."""
    demands = Demands(0.0, 0.7, 0.03, 0.03, 0.5, np.full(4, np.inf), 1, -1.7556)
    found = Parameters(1.8009, 1.5796, 2.3725, 0.9008, 0.345)
    home = np.array([0.0, 0.7, -1.6, -0.6])
    return manoeuvre(climber(MINI, demands), Step(0.25), found, home, 0.05)


def test_of_a_manoeuvre_it_says_what_the_loads_say() -> None:
    """The lines that bear it by `judge`, which knows from its course what touches."""
    whole = made()
    assert whole.motion is not None, whole.why
    motion, ledge = whole.motion, Ledge(np.zeros(2), np.array([1.0, 0.0]), 0.0, 0.25)
    points = bearing(MINI, motion.q, motion.T_step_root, ledge)
    got = margins(MINI, 0.0, motion.q, motion.T_step_root, points)
    assert got.min() > 0.1
    assert np.isfinite(points[..., 0]).sum(axis=1).min() >= 4
    for phase in motion.phases:
        if not phase.name.startswith("sequence"):
            continue
        rows = (motion.time > phase.start + 0.1) & (motion.time < phase.end - 0.1)
        low = np.nanmin(points[rows][..., 0], axis=1)
        high = np.nanmax(points[rows][..., 0], axis=1)
        lines = motion.support[rows][..., 0]
        # Geometry finds all that touches, loads say what bears: never less, and hardly more.
        assert (low <= lines.min(axis=1) + 0.02).all(), phase.name
        assert (high >= lines.max(axis=1) - 0.02).all(), phase.name
