"""Stages to look at: every point has one, and a picture of few points shows all that is there."""

from __future__ import annotations

import numpy as np
import pytest

from backend.errors import InputError
from backend.perception import stages
from backend.perception.detect import Settings, Stages, detect
from backend.shell.sim.lidar import Lidar, Person, scan
from backend.spatial.boxes import Boxes

SENSOR = np.eye(4)
SENSOR[:3, 3] = [0.0, 0.0, 2.0]
BODY = Boxes(np.array([[2.5, 0.0, 1.0]]), np.eye(3)[None], np.array([[0.5, 0.4, 1.0]]))


def detected() -> tuple[np.ndarray, Stages]:
    """A turn among two people and a machine's body, with what is no number."""
    people = (Person(np.array([5.0, 1.0])), Person(np.array([-4.0, -3.0])))
    points = scan(Lidar(), SENSOR, BODY, people, np.random.default_rng(3)).points
    points = np.concatenate([points, [[np.nan, 0.0, 0.0], [4.0, -4.0, 3.5]]])
    return points, detect(points, SENSOR[:3, 3], BODY, Settings(reach=12.0))


def test_every_point_ends_at_one_stage() -> None:
    points, found = detected()
    code = stages.codes(found)
    far = ~(np.hypot(points[:, 0], points[:, 1]) <= 12.0)
    np.testing.assert_array_equal(code == stages.OUTSIDE, far)
    np.testing.assert_array_equal(code == stages.OBJECT, found.cluster >= 0)
    np.testing.assert_array_equal(code == stages.GROUND, found.ground)
    body = (np.abs(points - BODY.centers[0]) <= BODY.half_extents[0] + 0.15).all(axis=1)
    np.testing.assert_array_equal(code == stages.MACHINE, body)
    assert code[-1] == stages.LEFT  # too high
    counted = stages.counts(code)
    assert counted == tuple(int((code == k).sum()) for k in range(5))
    assert sum(counted) == len(points)
    assert min(counted) > 0
    assert counted[stages.OBJECT] == found.objects.points.sum()


def test_of_no_points_there_are_none() -> None:
    none = np.zeros(0, np.uint8)
    assert stages.counts(none) == (0, 0, 0, 0, 0)
    assert len(stages.thinned(none, none.astype(int))) == 0


@pytest.mark.parametrize("most", [60, 500, 3_000])
def test_a_thin_picture_shows_all_and_the_large_make_room(most: int) -> None:
    _, found = detected()
    code = stages.codes(found)
    rows = stages.thinned(code, found.cluster, most)
    assert len(rows) == most
    assert (np.diff(rows) > 0).all()
    groups = np.where(code == stages.OBJECT, 10 + found.cluster, code)
    kept = {int(g): int((groups[rows] == g).sum()) for g in np.unique(groups)}
    whole = {int(g): int((groups == g).sum()) for g in np.unique(groups)}
    assert len(whole) == 6  # four stages and two people
    level = max(kept.values())
    for group, n in whole.items():
        assert kept[group] in (n, level, level - 1), group


def test_what_fits_is_kept_whole() -> None:
    code = np.array([0, 2, 2, 3], np.uint8)
    cluster = np.array([-1, -1, -1, 0])
    np.testing.assert_array_equal(stages.thinned(code, cluster, 4), [0, 1, 2, 3])


def test_more_objects_than_points_of_the_picture() -> None:
    cluster = np.arange(300) // 3
    rows = stages.thinned(np.full(300, stages.OBJECT, np.uint8), cluster, 40)
    assert len(rows) == len(set(cluster[rows])) == 40


def test_kept_points_are_spread_over_the_scan() -> None:
    code = np.full(10_000, stages.GROUND, np.uint8)
    rows = stages.thinned(code, np.full(10_000, -1), 1_000)
    assert set(np.diff(rows)) == {10}


def test_a_picture_of_nothing_is_no_picture() -> None:
    with pytest.raises(InputError, match="most is 0; allowed is 1 or more"):
        stages.thinned(np.zeros(3, np.uint8), np.full(3, -1), 0)
