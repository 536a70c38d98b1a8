"""Rows in batches against the plain form of one row."""

from __future__ import annotations

import numpy as np
import pytest

from backend.cspace import rows
from backend.cspace.exact_levels import Level
from backend.cspace.planar_arm import Profiles, _profiles, hull
from backend.cspace.rows_batch import (
    Sizes,
    cells_of,
    new_batch,
    set_body,
    set_polygon,
    touched_rows,
)
from backend.cspace.rows_vector import BLOCKED, DOUBT, MARGIN, ORIGIN, SIZE, WORD, X, Z

BODIES = 6


def bodies(rng: np.random.Generator) -> Profiles:
    """Outlines around the pivot, beside it, and as thin as a plate."""
    prisms = []
    for k in range(BODIES):
        size = np.array([0.6, 0.03 if k % 3 == 0 else 0.4])
        middle = np.zeros(2) if k < 2 else rng.uniform(-0.5, 0.5, 2)
        prisms.append((hull(middle + rng.uniform(-1, 1, (6, 2)) * size), np.array([-1.0, 1.0])))
    return _profiles(prisms, np.zeros(BODIES, np.int64), np.zeros((3, 2)))


def polygon(rng: np.random.Generator, size: float) -> rows.Polygons:
    p = hull(rng.uniform(-0.3, 0.3, 2) + rng.uniform(-1, 1, (9, 2)) * size)
    edge = np.roll(p, -1, axis=0) - p
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    one = np.zeros(1, np.int64)
    return rows.Polygons(
        one, one, one + len(p), p[None, :, 0].copy(), p[None, :, 1].copy(),
        normal[None, :, 0].copy(), normal[None, :, 1].copy(), (normal @ p.T).max(axis=1)[None],
        np.arctan2(normal[:, 1], normal[:, 0])[None], p.min(axis=0)[None], p.max(axis=0)[None],
    )  # fmt: skip


@pytest.mark.parametrize(("margin", "turn"), [(0.0, 0.0), (0.04, 0.05), (-0.04, -0.05)])
@pytest.mark.parametrize(("step", "cells"), [(0.047, 64), (-0.031, 100), (0.0981, 64)])
def test_batch_is_the_same_as_row_by_row(
    margin: float, turn: float, step: float, cells: int
) -> None:
    rng = np.random.default_rng(3)
    words = (cells + 63) // 64
    full = np.packbits(np.arange(64 * words) < cells, bitorder="little").view(np.uint64)
    # Pivots that can be off by `margin` any way: what bends is all of it.
    none, kind = np.zeros((0, 0)), int(np.sign(margin))
    level = Level(
        kind, none, none, margin, 0.0, 0.0, 0.0, 0.0, np.inf, turn, step, cells
    )  # fmt: skip
    compared = blocked = 0
    for case in range(60):
        body, p = bodies(rng), polygon(rng, (0.05, 0.3, 0.9)[case % 3])
        b, count = case % BODIES, (SIZE, 5)[case % 2]
        batch = new_batch(words, max(p.x.shape[1], body.radius.shape[1]), 0)
        set_body(batch, body, b)
        set_polygon(batch, p, 0)
        x, z = rng.uniform(-1.2, 1.2, (2, count))
        origin = rng.uniform(-4, 4, count)
        margins = margin * rng.uniform(0.5, 1.0, count)
        for begin, values in ((X, x), (Z, z), (ORIGIN, origin), (MARGIN, margins)):
            batch.d[begin : begin + count] = values
        batch.place[:count] = np.arange(count)
        sizes = Sizes(
            int(body.sides[b]), float(body.depth[b]), float(body.reach[b]), int(p.sides[0]), words
        )
        known = np.zeros((count, words), np.uint64)
        left = touched_rows(sizes, cells_of(level), batch, count, full, known)
        found = np.zeros((count, words), np.uint64)
        bits = np.array([batch.w[k * WORD + BLOCKED :][:left] for k in range(words)])
        found[batch.place[:left]] = bits.T & full
        sure = np.ones(count, dtype=bool)
        sure[batch.place[:left]] = batch.s[DOUBT : DOUBT + left] >= 0.0
        for r in np.flatnonzero(sure):
            row = np.zeros(words, np.uint64)
            rows.touched(
                body, b, p, 0, x[r], z[r], origin[r], step, cells, margins[r], turn, batch.room[:2],
                batch.polar, row,
            )  # fmt: skip
            # A batch shortens the meeting of arcs, a single row each arc: never more is free.
            assert not (row & full & ~found[r]).any()
            if turn >= 0.0:
                np.testing.assert_array_equal(found[r], row & full)
            compared += 1
            blocked += bool(found[r].any())
    assert compared > 3900
    assert blocked > 300
