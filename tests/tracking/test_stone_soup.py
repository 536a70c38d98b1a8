"""Association and measures of quality against Stone Soup, which others wrote."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from people_metrics import gospa, ospa, switches
from stone_soup_tracker import at, followed, shares
from stonesoup.measures import Euclidean
from stonesoup.metricgenerator.clearmotmetrics import ClearMotMetrics
from stonesoup.metricgenerator.manager import MultiManager
from stonesoup.metricgenerator.ospametric import GOSPAMetric, OSPAMetric
from stonesoup.types.association import AssociationSet, TimeRangeAssociation
from stonesoup.types.groundtruth import GroundTruthPath
from stonesoup.types.state import State
from stonesoup.types.time import TimeRange
from stonesoup.types.track import Track

from backend.tracking.association import associate
from backend.tracking.records import PX, PY, Detections


@pytest.mark.parametrize(("n", "k"), [(1, 1), (1, 3), (2, 2), (3, 2), (3, 4)])
def test_association_probabilities(n: int, k: int) -> None:
    rng = np.random.default_rng(10 * n + k)
    for _ in range(4):
        places = rng.uniform(0.0, 0.8, (n, 2))
        ratio, expected = shares(places, rng.normal(size=(n, 2)), rng.uniform(0.0, 0.9, (k, 2)))
        assert (ratio > 0.0).any()
        np.testing.assert_allclose(associate(ratio).share, expected, rtol=0, atol=1e-9)


def states(places: np.ndarray) -> list[State]:
    return [State([[x], [y]], at(0.0)) for x, y in places]


PAIRS = ((0, 3), (2, 0), (1, 1), (3, 3), (5, 2), (4, 6))


@pytest.mark.parametrize(("c", "p"), [(1.0, 2.0), (0.5, 1.0), (3.0, 2.0)])
def test_gospa(c: float, p: float) -> None:
    rng = np.random.default_rng(int(10 * c + p))
    for n, m in PAIRS:
        found, true = rng.uniform(0.0, 3.0, (n, 2)), rng.uniform(0.0, 3.0, (m, 2))
        theirs = GOSPAMetric(c=c, p=p).compute_gospa_metric(states(found), states(true))[0]
        assert gospa(found, true, c, p) == pytest.approx(theirs.value["distance"], abs=1e-9)
    assert gospa(np.zeros((0, 2)), np.zeros((0, 2))) == 0.0


@pytest.mark.parametrize(("c", "p"), [(1.0, 2.0), (0.5, 1.0), (3.0, 2.0)])
def test_ospa(c: float, p: float) -> None:
    """Stone Soup assigns by distances, not by their p-th powers: the same where p = 1, and never
    less than the best of all ways.
    """
    rng = np.random.default_rng(int(10 * c + p))
    for n, m in PAIRS:
        found, true = rng.uniform(0.0, 3.0, (n, 2)), rng.uniform(0.0, 3.0, (m, 2))
        theirs = OSPAMetric(c=c, p=p).compute_OSPA_distance(states(found), states(true)).value
        ours = ospa(found, true, c, p)
        few, many = sorted((found, true), key=len)
        best = min(
            sum(min(c, float(np.linalg.norm(few[i] - many[j]))) ** p for i, j in enumerate(way))
            for way in itertools.permutations(range(len(many)), len(few))
        )
        best = ((best + c**p * (len(many) - len(few))) / len(many)) ** (1.0 / p)
        assert ours == pytest.approx(best, abs=1e-9)
        assert ours <= theirs + 1e-9
        if p == 1.0:
            assert ours == pytest.approx(theirs, abs=1e-9)
    assert ospa(np.zeros((0, 2)), np.zeros((0, 2))) == 0.0


def test_changes_of_identity_by_hand() -> None:
    true = [np.array([[0.0, 0.0], [1.0, 0.0]])] * 4
    a, b = true[0] + 0.05, true[0][::-1] + 0.05
    same = [(np.array([7, 9]), a), (np.array([9, 7]), b)]  # another order is no change
    assert switches([*same, *same], true) == 0
    swapped = [*same, (np.array([9, 7]), a), (np.array([9, 7]), a)]
    assert switches(swapped, true) == 2
    gone = [(np.array([7, 9]), a), (np.zeros(0, int), a[:0]), (np.array([7, 8]), a), same[0]]
    assert switches(gone, true) == 2  # 9, 8, 9


def clear_mot_switches(scans: list[tuple[np.ndarray, np.ndarray]], true: list[np.ndarray]) -> int:
    """Stone Soup's CLEAR MOT, where nobody is missed and nothing is false: N (1 - MOTA)."""
    people = [GroundTruthPath(id=f"person {k}") for k in range(len(true[0]))]
    tracks: dict[int, Track] = {}
    pairs = set()
    for k, ((ids, places), truth) in enumerate(zip(scans, true, strict=True)):
        for who, (x, y) in enumerate(truth):
            people[who].append(State([[x], [y]], at(0.1 * k)))
        for number, (x, y) in zip(ids.tolist(), places, strict=True):
            one = tracks.setdefault(number, Track(id=f"track {number}"))
            one.append(State([[x], [y]], at(0.1 * k)))
            who = int(np.argmin(np.linalg.norm(truth - [x, y], axis=1)))
            moment = TimeRange(at(0.1 * k - 0.01), at(0.1 * k + 0.01))
            pairs.add(TimeRangeAssociation({people[who], one}, moment))
    metric = ClearMotMetrics(distance_measure=Euclidean())
    manager = MultiManager([metric])
    manager.add_data({"groundtruth_paths": set(people), "tracks": set(tracks.values())})
    manager.association_set = AssociationSet(pairs)
    mota = next(m.value for m in metric.compute_metric(manager) if m.title == "MOTA")
    return round(sum(map(len, people)) * (1.0 - mota))


@pytest.mark.parametrize("seed", range(4))
def test_changes_of_identity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = [np.array([[0.0, 0.0], [1.0, 0.2 * k], [3.0, 1.0]]) for k in range(12)]
    scans, ids = [], np.array([4, 5, 6])
    for truth in true:
        if rng.random() < 0.3:
            ids = rng.permutation(ids)
        if rng.random() < 0.2:
            ids = np.where(ids == ids[0], ids.max() + 1, ids)  # somebody is begun anew
        scans.append((ids, truth + rng.uniform(-0.1, 0.1, (3, 2))))
    assert switches(scans, true) == clear_mot_switches(scans, true) > 0


def test_stone_soups_tracker_follows_two_walkers() -> None:
    """Of use as a peer only if it does its work."""
    rng = np.random.default_rng(5)
    scans = [
        Detections(
            0.1 * k,
            np.array([[0.12 * k, 0.0], [4.0, 6.0 - 0.1 * k]]) + rng.normal(scale=0.06, size=(2, 2)),
            (PX, PY),
            np.array([0.06, 0.06]),
        )
        for k in range(30)
    ]
    end = followed(scans)[-1]
    assert len(end.ids) == 2
    order = np.argsort(end.places[:, 1])
    np.testing.assert_allclose(end.places[order], [[3.48, 0.0], [4.0, 3.1]], atol=0.15)
    np.testing.assert_allclose(end.ahead[order], [[4.68, 0.0], [4.0, 2.1]], atol=0.5)
