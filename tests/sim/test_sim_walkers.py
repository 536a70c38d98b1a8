"""Simulated people and vehicles: where the time puts them, however it is asked."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.errors import InputError
from backend.shell.sim import walkers
from backend.shell.sim.walkers import boxes_around, people_at, vehicles_at
from backend.site.site import Site, parse_site

E, N = 308600.0, 4129950.0


def site(**tables: Any) -> Site:
    """The origin is at (E, N, 5)."""
    table = {
        "name": "yard",
        "frame": {"epsg": 32652, "origin": [E, N, 5.0]},
        "machine": [{"name": "left", "model": "mini"}],
        **tables,
    }
    return parse_site(table, Path("yard.toml"))


def one(person: dict[str, Any], *times: float) -> np.ndarray:
    """(k, 2) where a person is at the times, in the site frame."""
    yard = site(person=[{"name": "ann", **person}])
    return np.array([people_at(yard, t)[0].place for t in times])


SQUARE = {"path": [[E, N], [E + 4.0, N], [E + 4.0, N + 2.0]], "speed": 2.0}


def test_a_path_is_walked_to_and_fro() -> None:
    places = one(SQUARE, 0.0, 1.0, 2.0, 2.5, 3.0, 3.5, 5.0, 6.0, 8.0, -1.0)
    expected = [[0, 0], [2, 0], [4, 0], [4, 1], [4, 2], [4, 1], [2, 0], [0, 0], [4, 0], [2, 0]]
    np.testing.assert_allclose(places, expected, atol=1e-9)


def test_people_stand_at_ends_and_corners() -> None:
    places = one({**SQUARE, "pause": 1.0}, 0.0, 0.9, 2.0, 3.0, 3.9, 4.5, 5.0, 5.9, 7.1, 10.0)
    expected = [[0, 0], [0, 0], [2, 0], [4, 0], [4, 0], [4, 1], [4, 2], [4, 2], [4, 0], [0, 0]]
    np.testing.assert_allclose(places, expected, atol=1e-9)


def test_nobody_is_faster_than_told() -> None:
    times = np.arange(0.0, 30.0, 0.05)
    steps = np.linalg.norm(np.diff(one({**SQUARE, "pause": 0.7}, *times), axis=0), axis=1)
    assert steps.max() <= 2.0 * 0.05 + 1e-9
    assert 0.3 < (steps < 1e-9).mean() < 0.6


def test_one_point_is_where_somebody_stands() -> None:
    np.testing.assert_allclose(one({"path": [[E + 1.0, N - 2.0]]}, 0.0, 50.0), [[1, -2]] * 2)


WANDERER = {"seed": 3, "around": [E + 5.0, N + 1.0], "within": [3.0, 9.0]}


def test_a_random_walk_stays_about_its_place_and_comes_back() -> None:
    times = np.arange(0.0, 2.0 * walkers.WALKED, 1.0)
    places = one(WANDERER, *times)
    far = np.linalg.norm(places - [5.0, 1.0], axis=1)
    assert 0.5 < far.min() < 5.0
    assert 7.0 < far.max() < 13.0
    np.testing.assert_allclose(places[1:], places[:0:-1], atol=1e-9)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 1.6
    other = one({**WANDERER, "seed": 4}, *times[:5])
    assert not np.allclose(other, places[:5])


def test_every_process_sees_the_same() -> None:
    first = one(WANDERER, 0.0, 12.34)
    walkers._random_walk.cache_clear()
    np.testing.assert_array_equal(one(WANDERER, 0.0, 12.34), first)


def test_a_vehicle_is_a_box_that_drives_and_backs() -> None:
    path = [[E, N], [E + 10.0, N], [E + 10.0, N + 10.0]]
    lorry = {"name": "lorry", "path": path, "size": [6.0, 2.0, 3.0], "speed": 5.0}
    yard = site(vehicle=[lorry])
    for t, place, yaw in ((1.0, [5, 0], 0.0), (3.0, [10, 5], 90.0), (5.0, [10, 5], 90.0)):
        boxes = vehicles_at(yard, t)
        np.testing.assert_allclose(boxes.centers, [[*place, 1.5]], atol=1e-9)
        np.testing.assert_allclose(boxes.half_extents, [[3.0, 1.0, 1.5]])
        ahead = [math.cos(math.radians(yaw)), math.sin(math.radians(yaw)), 0.0]
        np.testing.assert_allclose(boxes.rotations[0, :, 0], ahead, atol=1e-9)
    assert len(vehicles_at(site(), 1.0)) == 0


def test_people_stand_on_the_ground_in_boxes_around_them() -> None:
    yard = site(person=[{"name": "ann", "height": 1.6, **SQUARE}, {"name": "bob", **WANDERER}])
    people = people_at(yard, 1.0)
    boxes = boxes_around(people)
    np.testing.assert_allclose(boxes.corners()[0].min(axis=0), [1.78, -0.22, 0.0])
    np.testing.assert_allclose(boxes.corners()[0].max(axis=0), [2.22, 0.22, 1.6])
    assert len(boxes) == 2
    assert len(boxes_around(())) == 0


@pytest.mark.parametrize(
    ("person", "words"),
    [
        ({}, 'person[1]: needs one way to go; allowed is "path", or "seed" with "around"'),
        ({"seed": 1}, "needs one way"),
        ({"seed": 1, "around": [E, N], "path": [[E, N]]}, "needs one way"),
        ({"path": []}, "person[1].path is []; allowed is at least 1 entries"),
        ({"path": [[E, N], [E, N]]}, "twice in a row"),
        ({"path": [[E, N, 0.0]]}, "person[1].path[1]"),
        ({**SQUARE, "speed": 0.0}, "person[1].speed is 0.0; allowed is more than 0"),
        ({**SQUARE, "pause": -1.0}, "person[1].pause is -1.0"),
        ({**WANDERER, "within": [3.0, 5.0]}, "3 m in width"),
        ({**SQUARE, "height": 9.0}, "person[1].height is 9.0"),
        ({**SQUARE, "sped": 1.0}, "person[1].sped is not a known field; allowed are name, path"),
    ],
)
def test_mistakes_in_people_are_one_sentence(person: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        site(person=[{"name": "ann", **person}])
    message = str(caught.value)
    assert words in message
    assert message.endswith(".")
    assert "\n" not in message


def test_mistakes_in_vehicles_and_names() -> None:
    lorry = {"name": "lorry", "path": [[E, N], [E + 1.0, N]], "size": [6.0, 2.0, 3.0]}
    for table, words in (
        ({"vehicle": [{**lorry, "path": [[E, N]]}]}, "at least 2 entries"),
        ({"vehicle": [{**lorry, "size": [6.0, 2.0, 0.0]}]}, "vehicle[1].size[3] is 0.0"),
        ({"vehicle": [lorry, lorry]}, 'vehicle has the name "lorry" twice'),
        ({"person": [{"name": "ann", **SQUARE}] * 2}, 'person has the name "ann" twice'),
        ({"sim": {"lidar": 1}}, "sim.lidar is 1; allowed is true or false"),
    ):
        with pytest.raises(InputError) as caught:
            site(**table)
        assert words in str(caught.value)
