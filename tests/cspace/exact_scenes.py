"""Machines, obstacles and judges for the exact images."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import coal
import numpy as np
import pytest

from backend.machine import fitting, load
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.machine.sidecar import BodiesTable, Sidecar, read_sidecar
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

# "askew" has its boxes turned out of the arm's plane, and beside it.
SHARED = Path(__file__).resolve().parents[3] / "shared" / "data" / "zx200"
NAMES = ("mini", "ex13", "askew", *(["zx200"] if SHARED.is_dir() else []))


@lru_cache
def machine_named(name: str) -> Machine:
    if name == "zx200":
        return _zx200_of_boxes()
    if name != "askew":
        return load_machine(name)
    mini = load_machine("mini")
    rng = np.random.default_rng(5)
    turns = rotation.about_axis(np.array([0.6, 0.0, 0.8]), rng.uniform(-0.6, 0.6, len(mini.bodies)))
    own = mini.bodies
    shifted = own.centers + np.array([0.0, 0.03, 0.0])
    return replace(mini, bodies=Boxes(shifted, own.rotations @ turns, own.half_extents))


def _zx200_of_boxes() -> Machine:
    """The ZX200 with one box a link: a scene as coarse as the others."""

    def one_box(triangles: np.ndarray, *_: object) -> Boxes:
        points = triangles.reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        return Boxes((low + high)[None] / 2, np.eye(3)[None], (high - low)[None] / 2)

    def without_boxes(path: Path) -> Sidecar:
        return read_sidecar(path).model_copy(update={"bodies": BodiesTable()})

    with pytest.MonkeyPatch.context() as patch, TemporaryDirectory() as cache:
        patch.setenv("XDG_CACHE_HOME", cache)
        patch.setattr(fitting, "fit_boxes", one_box)
        patch.setattr(load, "read_sidecar", without_boxes)
        return load_machine("zx200.xacro", base_folder=SHARED)


def scene(machine: Machine, seed: int, count: int = 7) -> Boxes:
    """Boxes of all sizes around the machine, in its root frame; its base is on a slope."""
    rng = np.random.default_rng(seed)
    reach = machine.max_reach
    bearing, away = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.45, 1.0, count) * reach
    centers = np.stack(
        [away * np.cos(bearing), away * np.sin(bearing), rng.uniform(-0.1, 0.6, count) * reach], 1
    )
    level = rotation.from_attitude(rng.uniform(-3, 3, count))
    tilted = rotation.about_axis(np.array([0.6, 0.8, 0.0]), rng.uniform(-0.5, 0.5, count))
    half = rng.uniform(0.01, 0.12, (count, 3)) * reach
    R_root_site = rotation.from_attitude(0.0, 0.2, -0.15).T
    T = transform.make(R_root_site, np.zeros(3))
    return Boxes(transform.apply(T, centers), R_root_site @ level @ tilted, half)


def overlapping(a: Boxes, b: Boxes) -> np.ndarray:
    """(k,) whether a[k] and b[k] touch: their corners projected on the 15 axes."""
    A, B = np.swapaxes(a.rotations, 1, 2), np.swapaxes(b.rotations, 1, 2)
    crossed = np.cross(A[:, :, None], B[:, None]).reshape(-1, 9, 3)
    axes = np.concatenate([A, B, crossed], axis=1)
    length = np.linalg.norm(axes, axis=2, keepdims=True)
    # Parallel edges give no axis of their own; a face normal stands in.
    axes = np.where(length > 1e-7, axes / np.maximum(length, 1e-7), A[:, :1])
    on_a = axes @ np.swapaxes(a.corners(), 1, 2)
    on_b = axes @ np.swapaxes(b.corners(), 1, 2)
    gap = np.maximum(on_a.min(axis=2) - on_b.max(axis=2), on_b.min(axis=2) - on_a.max(axis=2))
    return np.asarray(gap.max(axis=1) <= 0.0)


def judged(
    machine: Machine, q: np.ndarray, obstacles: Boxes, inflation: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """(touches an obstacle, touches itself) of q (k, n) by `overlapping`."""
    T = link_poses(machine, q)[:, machine.body_link_index]
    own = machine.bodies.inflated(inflation)
    n, m = len(own), len(obstacles)
    centers = (T[..., :3, :3] @ own.centers[..., None])[..., 0] + T[..., :3, 3]
    rotations = T[..., :3, :3] @ own.rotations
    size = np.linalg.norm(own.half_extents, axis=1)
    hits = np.zeros((2, len(q)), dtype=bool)

    def mark(row: int, c, i, other_c, other_R, other_h) -> None:  # type: ignore[no-untyped-def]
        near = np.linalg.norm(centers[c, i] - other_c, axis=1) <= size[i] + np.linalg.norm(
            other_h, axis=1
        )
        c, i = c[near], i[near]
        a = Boxes(centers[c, i], rotations[c, i], own.half_extents[i])
        b = Boxes(other_c[near], other_R[near], other_h[near])
        hits[row, c[overlapping(a, b)]] = True

    for start in range(0, len(q), 2000):
        k = np.arange(start, min(start + 2000, len(q)))
        c, i, j = (g.ravel() for g in np.meshgrid(k, np.arange(n), np.arange(m), indexing="ij"))
        mark(0, c, i, obstacles.centers[j], obstacles.rotations[j], obstacles.half_extents[j])
        if machine.self_pairs:
            pairs = np.array(machine.self_pairs)
            c, p = (g.ravel() for g in np.meshgrid(k, np.arange(len(pairs)), indexing="ij"))
            i, j = pairs[p, 0], pairs[p, 1]
            mark(1, c, i, centers[c, j], rotations[c, j], own.half_extents[j])
    return hits[0], hits[1]


def coal_touches(machine: Machine, q: np.ndarray, obstacles: Boxes) -> np.ndarray:
    """(k,) whether any body at q (k, n) touches an obstacle, by coal."""
    shapes = [
        (coal.Box(*(2.0 * h)), coal.Transform3s(R, c))
        for c, R, h in zip(
            obstacles.centers, obstacles.rotations, obstacles.half_extents, strict=True
        )
    ]
    out = np.zeros(len(q), dtype=bool)
    for k, values in enumerate(q):
        own = body_boxes(machine, link_poses(machine, values))
        for c, R, h in zip(own.centers, own.rotations, own.half_extents, strict=True):
            a, at = coal.Box(*(2.0 * h)), coal.Transform3s(R, c)
            for b, there in shapes:
                request, result = coal.CollisionRequest(), coal.CollisionResult()
                out[k] = out[k] or bool(coal.collide(a, at, b, there, request, result))
    return out
