"""People in a LiDAR's points: detection and tracking, in time."""

from __future__ import annotations

import time

import numpy as np

from backend.documents.bench import BenchRow
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.perception.detect import detect
from backend.shell.sim.lidar import Lidar, Person, scan
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array
from backend.tracking.records import PX, PY, PZ, Detections
from backend.tracking.tracker import Tracked, later, nothing, track
from cockpit.bench_alarm import alarm_rows
from cockpit.bench_rows import percentile_rows

PLACES, SIGMA = (PX, PY, PZ), np.array([0.06, 0.06, 0.15])
PERIOD = 0.1
_SCANS = 600
_CLUTTER = 3.0  # false detections a scan, on 40 x 40 m
_BEGIN = 20  # scans until everybody is followed


def people_rows() -> list[BenchRow]:
    """The tracker alone, among clutter and in a crowd, and all from points to tracks."""
    three = _tracked(_walkers(np.random.default_rng(0)))
    crowd = _tracked(_crowd(np.random.default_rng(1)))
    rows = percentile_rows("tracks and 1 s ahead, 3 people and clutter", three, 1.0)
    return [
        *rows,
        *percentile_rows("tracks and 1 s ahead, 20 people on 2 m²", crowd, 50.0),
        *_from_points(),
        *alarm_rows(_WALLS),
    ]


def _tracked(scans: list[Detections]) -> list[float]:
    """Durations of the scans with their predictions a second ahead [s]."""
    result, durations = _first(), []
    for seen in scans:
        start = time.perf_counter()
        result = track(result.tracks, seen, result.next_id)
        later(result.tracks, 1.0)
        durations.append(time.perf_counter() - start)
    return durations[_BEGIN:]


def _first() -> Tracked:
    return Tracked(nothing(), 1, (), np.zeros((0, 0)))


def _walkers(rng: np.random.Generator) -> list[Detections]:
    """Three people who walk to and fro, each seen in 95 % of all scans."""
    scans = []
    for k in range(_SCANS):
        t = k * PERIOD
        places = np.array(
            [
                [6.0 * np.sin(0.2 * t), 4.0, 0.9],
                [5.0, 6.0 * np.sin(0.15 * t), 0.9],
                [-6.0, 1.0, 0.9],
            ]
        )
        seen = (places + rng.normal(scale=SIGMA, size=(3, 3)))[rng.random(3) < 0.95]
        false = rng.uniform([-20.0, -20.0, 0.2], [20.0, 20.0, 1.5], (rng.poisson(_CLUTTER), 3))
        scans.append(Detections(t, np.concatenate([seen, false]), PLACES, SIGMA))
    return scans


def _crowd(rng: np.random.Generator) -> list[Detections]:
    """Twenty people on two square metres."""
    x, y = (grid.ravel() for grid in np.meshgrid(0.32 * np.arange(5), 0.32 * np.arange(4)))
    places = np.stack([x, y, np.full(20, 0.9)], axis=1)
    return [
        Detections(k * PERIOD, places + rng.normal(scale=SIGMA, size=(20, 3)), PLACES, SIGMA)
        for k in range(200)
    ]


def _from_points() -> list[BenchRow]:
    """Scans of a whole VLP-16 at 10 Hz, between two machines."""
    machine = load_machine("mini")
    q = 0.5 * (np.clip(machine.lower, -1.0, 1.0) + np.clip(machine.upper, -1.0, 1.0))
    own = body_boxes(machine, link_poses(machine, q))
    other = np.eye(4)
    other[:3, 3] = [8.0, 3.0, 0.0]
    bodies = concatenated([own, own.moved(other)])
    T = np.eye(4)
    T[:3, 3] = [-0.3, 0.0, 2.6]
    rng = np.random.default_rng(2)
    clouds = [_points(T, bodies, k * PERIOD, rng) for k in range(60)]
    result, found, all_of_it = _first(), [], []
    for k, points in enumerate(clouds):
        start = time.perf_counter()
        objects = detect(points, T[:3, 3], bodies).objects
        seen = time.perf_counter()
        result = track(
            result.tracks, Detections(k * PERIOD, objects.center, PLACES, SIGMA), result.next_id
        )
        later(result.tracks, 1.0)
        all_of_it.append(time.perf_counter() - start)
        found.append(seen - start)
    n = round(float(np.mean([len(points) for points in clouds])), -3)
    return [
        *percentile_rows(f"detections of {n:,.0f} points", found[10:]),
        *percentile_rows(f"tracks of {n:,.0f} points", all_of_it[10:], 100.0),
    ]


def _points(T: Array, bodies: Boxes, t: float, rng: np.random.Generator) -> Array:
    """Ten people at different distances."""
    people = tuple(
        Person(
            np.array([(3.0 + k) * np.cos(2.4 * k + 0.1 * t), (3.0 + k) * np.sin(2.4 * k + 0.1 * t)])
        )
        for k in range(10)
    )
    return scan(
        Lidar(directions=1880, lost=0.0), T, concatenated([bodies, _WALLS]), people, rng
    ).points


_WALLS = Boxes(
    np.array([[24.0, 0.0, 5.0], [-24.0, 0.0, 5.0], [0.0, 24.0, 5.0], [0.0, -24.0, 5.0]]),
    np.tile(np.eye(3), (4, 1, 1)),
    np.array([[0.1, 24.0, 10.0], [0.1, 24.0, 10.0], [24.0, 0.1, 10.0], [24.0, 0.1, 10.0]]),
)
"""Around the site, so that every ray has an echo [m]."""
