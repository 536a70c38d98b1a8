"""Use cases as runs: their series agree with python-fcl, and say what Mäkinen's figures say."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.errors import InputError
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.machine.pose import tool_pose
from backend.planning import rail_site
from backend.planning.simulate import STEP
from backend.planning.use_cases import MODEL, UseCaseRun, run_use_case, settings_of, use_case

RAIL = load_machine(MODEL)
MOVING = RAIL.body_joints.any(axis=1)
Runs = dict[tuple[str, str], UseCaseRun]


@pytest.fixture(scope="module")
def runs() -> Runs:
    wanted = [
        ("pole", "none"),
        ("pole", "scaling"),
        ("ballast", "none"),
        ("ballast", "constrained"),
    ]
    return {one: run_use_case(*one, RAIL) for one in wanted}


def test_the_distance_is_that_of_fcl_and_lies_between_the_two_points(runs: Runs) -> None:
    for done in runs.values():
        near, limits = done.nearest, done.case.limits.boxes
        for i in range(0, len(done.run.times), 40):
            boxes = body_boxes(RAIL, link_poses(RAIL, done.run.q[i]))
            want = closest_pairs(boxes.take(MOVING), limits).distance[0]
            if want < 0.0:
                assert near.distance[i] < 0.0
            elif done.case.own and near.words[near.pair[i]].partition(" to own ")[2]:
                assert near.distance[i] <= want + 1e-6
            else:
                assert near.distance[i] == pytest.approx(want, abs=1e-4)
        apart = np.linalg.norm(near.points[:, 0] - near.points[:, 1], axis=1)
        np.testing.assert_allclose(apart, np.maximum(near.distance, 0.0), atol=1e-6)


def test_the_pole_is_approached_slowly_and_left_at_full_speed(runs: Runs) -> None:
    done, free = runs["pole", "scaling"], runs["pole", "none"]
    lower, upper = settings_of("scaling").thresholds.lower, settings_of("scaling").thresholds.upper
    distance, t = done.nearest.distance, done.run.times
    assert distance.min() >= lower
    assert free.nearest.distance.min() < lower  # or there were nothing to see
    coming = (t > rail_site.POLE_GO) & (t < rail_site.POLE_BACK)
    felt = coming & (distance < upper)
    assert 2.0 <= t[felt][0] < 4.0  # Fig. 4.4
    assert (np.diff(done.run.scale[felt]) < 0.0).all()
    assert (done.run.scale[t >= rail_site.POLE_BACK] == 1.0).all()
    assert done.run.arrived < free.run.arrived  # it had not gone as far
    assert set(done.nearest.words) == {"rotate to pole"}  # Fig. 4.4 counts limits alone


def test_what_was_meant_is_what_is_done_without_a_limit(runs: Runs) -> None:
    assert runs["pole", "none"].run.error.max() < 1e-9
    assert runs["ballast", "none"].run.error[:, 0].max() < 0.005  # caught up with, cycle by cycle
    np.testing.assert_array_equal(runs["pole", "scaling"].designed, runs["pole", "none"].tool)
    done, path = runs["ballast", "constrained"], rail_site.ballast_path()
    for i in (0, 300, 900, 1499):
        want = tool_pose(RAIL, link_poses(RAIL, path.at(i * STEP)[0]))
        np.testing.assert_allclose(done.designed[i], want, atol=1e-9)
        moved = tool_pose(RAIL, link_poses(RAIL, done.run.q[i]))
        off = np.linalg.norm(moved[:3, 3] - want[:3, 3])
        assert done.run.error[i, 0] == pytest.approx(off, abs=1e-9)


def test_ballast_removal_meets_limits_and_itself(runs: Runs) -> None:
    free, done = runs["ballast", "none"], runs["ballast", "constrained"]
    assert free.nearest.distance.min() < -0.5
    assert done.nearest.distance.min() > 0.199
    duration = rail_site.ballast_path().duration
    assert done.run.arrived == pytest.approx(duration, abs=0.5)
    said = {word.partition(" to ")[2] for word in done.nearest.words}
    assert {"adjacent track", "own tracks"} <= said  # Figs. 4.6 and 4.11
    assert done.run.error[:, 0].max() > 0.5
    assert done.vibration.energy > free.vibration.energy


def test_it_is_the_same_every_time_and_tells_how_far_it_is(runs: Runs) -> None:
    told: list[float] = []
    again = run_use_case("pole", "scaling", RAIL, told.append)
    for name in ("q", "rates", "scale", "error"):
        first = getattr(runs["pole", "scaling"].run, name)
        np.testing.assert_array_equal(getattr(again.run, name), first)
    np.testing.assert_array_equal(again.nearest.points, runs["pole", "scaling"].nearest.points)
    np.testing.assert_allclose(told, again.run.times)


def test_who_is_told_can_end_it() -> None:
    class Enough(Exception):  # noqa: N818
        pass

    def tell(t: float) -> None:
        if t > 1.0:
            raise Enough

    with pytest.raises(Enough):
        run_use_case("ballast", "potential", RAIL, tell)


def test_unknown_names_are_told_with_those_there_are() -> None:
    with pytest.raises(InputError, match='"bridge" is not known; allowed are pole, ballast'):
        use_case("bridge")
    with pytest.raises(InputError, match='"magic" is not known; allowed are none, scaling'):
        run_use_case("pole", "magic", RAIL)
