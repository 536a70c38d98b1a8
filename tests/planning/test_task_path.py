"""Task paths, what follows them, and the limits of the use cases."""

from __future__ import annotations

import numpy as np
import pytest
from gauge_runs import RAIL

from backend.errors import InputError
from backend.machine.pose import tool_pose
from backend.planning import rail_site
from backend.planning.proximity import posed
from backend.planning.task_path import JointPath, follow


def test_postures_are_passed_at_rest_and_rates_are_the_differences():
    path = rail_site.ballast_path()
    for t, posture in zip(path.times, path.postures, strict=True):
        q, rates = path.at(float(t))
        np.testing.assert_allclose(q, posture, atol=1e-12)
        np.testing.assert_allclose(rates, 0.0, atol=1e-12)
    for t in np.linspace(0.05, path.duration - 0.05, 40):
        want = (path.at(t + 1e-6)[0] - path.at(t - 1e-6)[0]) / 2e-6
        np.testing.assert_allclose(path.at(t)[1], want, atol=1e-6)
    np.testing.assert_array_equal(path.at(1e3)[0], path.postures[-1])


def test_the_goals_twist_moves_the_goal():
    path = rail_site.ballast_path()
    for t in (2.0, 6.5, 17.0):
        goal, later = path.goal(RAIL, t), path.goal(RAIL, t + 1e-6)
        moved = (later.pose[:3, 3] - goal.pose[:3, 3]) / 1e-6
        np.testing.assert_allclose(goal.twist[:3], moved, atol=1e-4)


def test_a_follower_makes_up_for_its_error_no_faster_than_it_may():
    path = rail_site.ballast_path()
    goal = path.goal(RAIL, 5.0)
    there = follow(goal, goal.pose, 2.0, (0.5, 0.5)).twist
    np.testing.assert_allclose(there, goal.twist)
    far = tool_pose(RAIL, posed(RAIL, path.postures[-1]))
    back = follow(goal, far, 2.0, (0.5, 0.4)).twist
    assert back is not None
    assert np.linalg.norm(back[:3] - goal.twist[:3]) == pytest.approx(0.5)
    assert np.linalg.norm(back[3:] - goal.twist[3:]) <= 0.4 + 1e-12


def test_a_path_needs_time():
    with pytest.raises(InputError, match="above 0"):
        JointPath(np.zeros((2, 6)), np.array([0.0]))


def test_the_limits_stand_where_the_thesis_says():
    limits = rail_site.ballast_limits()
    low, high = (limits.boxes.corners().min(axis=1), limits.boxes.corners().max(axis=1))
    track, line = limits.names.index("adjacent track"), limits.names.index("overhead line")
    assert high[track, 1] == pytest.approx(-4.5 + 1.845)
    assert low[track, 1] == pytest.approx(-4.5 - 1.845)
    assert low[line, 2] == pytest.approx(6.15 - 1.0)
    assert low[line, 1] == pytest.approx(-3.0)
    assert high[line, 1] == pytest.approx(3.0)
