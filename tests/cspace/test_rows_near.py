"""Rows that are left out before any arc: never one in which a body meets something."""

from __future__ import annotations

import numpy as np
import pytest
from test_exact_rows import BODIES, bodies

from backend.cspace.exact_levels import EXACT, INNER, OUTER, RUN, Level, levels
from backend.cspace.rows_near import near_rows, near_runs, swept_of
from backend.cspace.rows_vector import LEVER_X, MARGIN, ORIGIN, SIZE, X, Z
from backend.spatial.types import Array, BoolArray

COUNT = 9 * 13
"""Rows of the bucket."""
LINKS = np.array([[0.1, 0.9], [1.7, 0.0], [0.0, 0.95]])


def axes(rng: np.random.Generator, kind: int) -> Array:
    """Cells of all joints; the bucket turns either way, by little or almost all around."""
    out = np.zeros((4, 4))
    for joint, cells in enumerate((8, 9, 13, 20)):
        span = rng.uniform(0.3, 6.0 if joint == 3 else 2.0)
        step = rng.choice([-1.0, 1.0]) * span / cells
        out[joint] = rng.uniform(-3, 3), step, cells, 0.0 if kind == EXACT else 0.5 * abs(step)
    return out


@pytest.mark.parametrize("kind", [EXACT, OUTER, INNER])
def test_no_row_is_left_out_in_which_a_body_meets_a_rectangle(kind: int) -> None:
    rng = np.random.default_rng(7)
    wanted = left_out = 0
    for _ in range(40):
        body = bodies(rng)._replace(group=np.full(BODIES, 2, np.int64))
        level = levels(LINKS, axes(rng, kind), kind)
        swept, bucket = swept_of(body, level), level[2]
        low = rng.uniform(-2.5, 2.5, 2)
        high = low + rng.uniform(0.05, 1.0, 2)
        around = (*low, *high)
        runs = bucket.runs.shape[1]
        some, found = np.empty(max(runs, RUN), np.uint8), np.empty(runs, np.int64)
        done = rng.random(runs * RUN) < 0.2
        d, place = np.zeros(9 * SIZE), np.empty(SIZE, np.int64)
        for b in range(BODIES):
            near, at = near_runs(bucket.runs, around, body.reach[b] + bucket.widest, some, found), 0
            given: list[int] = []
            while at < near:
                n, at = near_rows(
                    bucket.rows, found, near, at, around, body.reach[b], tuple(swept[b]),
                    kind != EXACT, done, d, place, some,
                )  # fmt: skip
                rows = place[:n]
                given += rows.tolist()
                values = [X, Z, ORIGIN, *((MARGIN, LEVER_X) if kind != EXACT else ())]
                for row, begin in enumerate(values):
                    np.testing.assert_array_equal(d[begin : begin + n], bucket.rows[row, rows])
            assert len(set(given)) == len(given)
            assert max(given, default=0) < COUNT
            assert not done[given].any()
            radius, bearing = body.radius[b, : body.sides[b]], body.bearing[b, : body.sides[b]]
            corners = np.stack([radius * np.cos(bearing), radius * np.sin(bearing)], axis=1)
            meets = met(corners, bucket, low, high)
            assert set(np.flatnonzero(meets & ~done[:COUNT])) <= set(given)
            wanted += int(meets.sum())
            left_out += COUNT - len(given)
    assert wanted > 2000
    assert left_out > 5000


def met(body: Array, level: Level, low: Array, high: Array) -> BoolArray:
    """(m,) whether a point of the body (v, 2) is in the rectangle at an angle of a row."""
    share = np.linspace(0.0, 1.0, 12)
    points = np.array([a * p + (1.0 - a) * q for p in body for q in body for a in share])
    more = max(level.turn, 0.0)
    angle = np.linspace(-more, more, 3)[:, None] + level.step * np.arange(level.cells)
    px, pz, origin = level.rows[:3, :COUNT, None]
    angle = origin + angle.ravel()
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x = px[..., None] + c * points[:, 0] - s * points[:, 1]
    z = pz[..., None] + s * points[:, 0] + c * points[:, 1]
    inside = (x >= low[0]) & (x <= high[0]) & (z >= low[1]) & (z <= high[1])
    return np.asarray(inside.any(axis=(1, 2)))
