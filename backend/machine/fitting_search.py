"""Best-first splitting of triangles into pieces, each with its tightest box."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from backend.machine.fitting_clip import clip
from backend.machine.fitting_field import Field, distance_field
from backend.spatial.rotation import about_axis
from backend.spatial.types import Array


@dataclass(frozen=True)
class Piece:
    """A box {p: low <= R^T p <= high} and the triangles (n, 3, 3) it was made for."""

    triangles: Array
    R: Array
    low: Array
    high: Array
    score: float


def search(
    triangles: Array, max_boxes: int, max_excess: float, progress: Callable[[float], None]
) -> list[Piece]:
    field = distance_field(triangles)
    pieces = [best_box(triangles, field)]
    while len(pieces) < max_boxes:
        progress(len(pieces) / max_boxes)
        worst = max(range(len(pieces)), key=lambda k: pieces[k].score)
        if pieces[worst].score <= max_excess:
            break
        pair = best_split(pieces[worst], field)
        if pair is None:
            break
        pieces[worst : worst + 1] = pair
    progress(1.0)
    return pieces


def best_split(piece: Piece, field: Field) -> list[Piece] | None:
    best, best_score = None, np.inf
    for axis in range(3):
        n = piece.R[:, axis]
        for share in np.linspace(0.1, 0.9, 9):
            c = piece.low[axis] + share * (piece.high[axis] - piece.low[axis])
            a, b = clip(piece.triangles, n, c), clip(piece.triangles, -n, -c)
            if not len(a) or not len(b):
                continue
            pair = [best_box(a, field), best_box(b, field)]
            score = max(p.score for p in pair) + 0.1 * sum(p.score for p in pair)
            if score < best_score:
                best, best_score = pair, score
    return best


def best_box(triangles: Array, field: Field) -> Piece:
    points = triangles.reshape(-1, 3)
    best = None
    for R in _rotations(points):
        local = points @ R
        low, high = local.min(axis=0), local.max(axis=0)
        score = field.excess(R, low, high) + 0.01 * float(np.prod(high - low))
        if best is None or score < best.score:
            best = Piece(triangles, R, low, high, score)
    assert best is not None
    return best


def _rotations(points: Array) -> list[Array]:
    """Identity, principal axes, and about each axis the two angles of least rectangle."""
    found = [np.eye(3)]
    centered = points - points.mean(axis=0)
    V = np.linalg.svd(centered.T @ centered)[0]
    V[:, 2] *= np.sign(np.linalg.det(V))
    found.append(V)
    angles = np.radians(np.arange(0.0, 90.0, 3.0))
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(angles), np.sin(angles)
        along = points[:, [u]] * c + points[:, [v]] * s
        across = -points[:, [u]] * s + points[:, [v]] * c
        areas = np.ptp(along, axis=0) * np.ptp(across, axis=0)
        k = int(np.argmin(areas))
        found.append(about_axis(np.eye(3)[axis], float(angles[k])))
    return found
