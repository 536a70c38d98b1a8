"""The collision server against python-fcl on every pair, in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from backend.collision.peer import FclScene
from backend.collision.scene import Scene, Surface, scene
from backend.collision.server import closest
from backend.documents.bench import BenchRow
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

_T = TypeVar("_T")

LINKS = 10
REACH = 3.0
"""Obstacles up to this far from a link are asked for [m]."""
TARGET = 2.0
"""Of the query among 10,000 boxes [ms]."""
_QUERIES = 200
_RADIUS = 0.02


def collision_rows() -> list[BenchRow]:
    """Ten links against boxes, a mesh of 100,000 triangles and a cloud of 30,000 points."""
    rng = np.random.default_rng(0)
    links = _boxes(rng, LINKS, 2.5, 0.5)
    rows = []
    for count, repeats in ((100, 50), (1_000, 10), (10_000, 3)):
        boxes = _boxes(rng, count, 0.9 * count ** (1 / 3), 0.4)
        names = tuple(str(k) for k in range(count))
        made, built = _timed(lambda b=boxes, n=names: scene(b, n), 5)  # type: ignore[misc]
        target = TARGET if count == 10_000 else None
        rows += _rows(f"{count:,} boxes", made, links, FclScene(boxes), repeats, target)
        rows.append(_row(f"a scene of {count:,} boxes, built", built))
    mesh = _hills(225)
    made, built = _timed(lambda: scene(meshes=(mesh,)), 3)
    above = Boxes(links.centers + np.array([0.0, 0.0, 4.0]), links.rotations, links.half_extents)
    rows += _rows(
        f"a mesh of {len(mesh.faces):,} triangles", made, above, FclScene(meshes=(mesh,)), 20, None
    )
    points = _hills(174).vertices[:30_000]
    made, built = _timed(lambda: scene().with_cloud("lidar", points, _RADIUS), 10)
    peer = FclScene(points=points, radius=_RADIUS)
    rows += _rows(f"a cloud of {len(points):,} points", made, above, peer, 2, None)
    rows.append(_row(f"a cloud of {len(points):,} points, built", built, 100.0))
    return rows


def _rows(
    what: str, made: Scene, links: Boxes, peer: FclScene, repeats: int, target: float | None
) -> list[BenchRow]:
    """p50 and p95 of the query, the peer's median, and by how much they differ."""
    found, ours = _timed(lambda: closest(made, links, REACH), _QUERIES)
    distance, theirs = _timed(lambda: peer.all_pairs(links), repeats)
    low, high = (float(v) for v in np.percentile(ours, [5, 95]))
    peer_value = float(np.median(theirs))
    rows = [
        BenchRow(
            name=f"{LINKS} links against {what} p{p}",
            value=value,
            unit="ms",
            spread=(low, high),
            target=target if p == 95 else None,
            peer="python-fcl, every pair",
            peer_value=peer_value,
            ratio=peer_value / value,
        )
        for p, value in ((50, float(np.median(ours))), (95, high))
    ]
    least = found.least(LINKS)
    near = least <= REACH
    over = 1e3 * float(np.max(least[near] - distance[near], initial=0.0))
    name = f"{LINKS} links against {what}, at most farther than python-fcl"
    return [*rows, BenchRow(name=name, value=over, unit="mm", spread=(0.0, over), target=1e-2)]


def _row(name: str, times: Array, target: float | None = None) -> BenchRow:
    low, high = (float(v) for v in np.percentile(times, [5, 95]))
    value = float(np.median(times))
    return BenchRow(name=name, value=value, unit="ms", spread=(low, high), target=target)


def _timed(run: Callable[[], _T], count: int) -> tuple[_T, Array]:
    """What it returns, and its times after a first run [ms]."""
    result = run()
    times = np.empty(count)
    for k in range(count):
        start = time.perf_counter()
        result = run()
        times[k] = 1e3 * (time.perf_counter() - start)
    return result, times


def _boxes(rng: np.random.Generator, count: int, spread: float, size: float) -> Boxes:
    """Anywhere, turned anyhow, as dense whatever their number."""
    turns = rotation.from_quaternion(rng.normal(size=(count, 4)))
    centers = rng.uniform(-spread, spread, (count, 3))
    return Boxes(centers, turns, rng.uniform(0.02, size, (count, 3)))


def _hills(side: int) -> Surface:
    """Ground of 30 x 30 m with hills, about 2 side^2 triangles."""
    along = np.linspace(-15.0, 15.0, side)
    x, y = (grid.ravel() for grid in np.meshgrid(along, along, indexing="ij"))
    z = 0.4 * np.sin(x) * np.cos(0.7 * y)
    k = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate(
        [np.stack([k, k + side, k + 1], 1), np.stack([k + 1, k + side, k + side + 1], 1)]
    )
    return Surface("hills", np.stack([x, y, z], axis=1), faces)
