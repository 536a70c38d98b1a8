"""Where the pivots of boom, stick and bucket stand in every row of an image.

The swing turns the whole arm, so that its pivots are the same in the arm's plane whatever the
swing: they are computed once for an image.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.cspace.planar_arm import PlanarArm
from backend.spatial.types import AnyArray, Array

EXACT, OUTER, INNER = 0, 1, -1
"""Cells at their centres; all that is not surely free; only what is surely blocked."""

ROUNDING = 1e-9
"""[m], [rad]: certified bounds are moved outward by more than the kernels round."""

RUN = 16
"""Rows that are looked at together before each for itself."""


class Axis(NamedTuple):
    """Cells of a joint: n cells at start + i step [rad], as angles in the arm's plane; `half` of
    a cell [rad], 0 where the value is exact.
    """

    start: float
    step: float
    n: int
    half: float


class Level(NamedTuple):
    """The rows of one joint: for the boom 1, for the stick one for each cell of the boom, for the
    bucket one for each cell of boom and stick.

    x, z: (m,) pivots [m]; origin: (m,) angles of the first cells [rad]; margin: (m,) how far a
    pivot can be from there [m]; turn: how far the angle can be from its cell's [rad]; both below 0
    for INNER. step, cells: of the rows. widest: the largest margin; low, high: (runs, 2) bounds of
    the pivots of RUN rows.
    """

    x: Array
    z: Array
    origin: Array
    margin: Array
    turn: float
    step: float
    cells: int
    widest: float
    low: Array
    high: Array


def levels(arm: PlanarArm, axes: tuple[Axis, Axis, Axis], kind: int) -> tuple[Level, Level, Level]:
    """Boom, stick and bucket. axes: the cells of each."""
    boom, stick, bucket = axes
    l1, l2 = np.hypot(*arm.boom), np.hypot(*arm.stick)
    angle1: Array = boom.start + boom.step * np.arange(boom.n, dtype=float)
    angle2: Array = stick.start + stick.step * np.arange(stick.n, dtype=float)
    v1 = np.exp(1j * angle1) * complex(*arm.boom)
    v2 = (np.exp(1j * angle1)[:, None] * np.exp(1j * angle2)) * complex(*arm.stick)
    at0 = np.array([complex(*arm.pivot)])
    at1 = at0 + v1
    at2 = (at1[:, None] + v2).ravel()
    # The boom turns the stick's pivot about its own, and the bucket's; the stick that one too.
    margin1 = np.full(boom.n, l1 * boom.half)
    margin2 = ((np.abs(v1[:, None] + v2) + l2 * stick.half) * boom.half + l2 * stick.half).ravel()
    sum2 = (angle1[:, None] + angle2).ravel()
    half2 = boom.half + stick.half
    return (
        _level(at0, boom.start + np.zeros(1), np.zeros(1), boom.half, boom, kind),
        _level(at1, stick.start + angle1, margin1, half2, stick, kind),
        _level(at2, bucket.start + sum2, margin2, half2 + bucket.half, bucket, kind),
    )


def _level(at: AnyArray, origin: Array, margin: Array, turn: float, axis: Axis, kind: int) -> Level:
    x, z = at.real.copy(), at.imag.copy()
    margin = kind * (margin + ROUNDING)
    starts = np.arange(0, len(x), RUN)
    low = np.stack([np.minimum.reduceat(v, starts) for v in (x, z)], axis=1)
    high = np.stack([np.maximum.reduceat(v, starts) for v in (x, z)], axis=1)
    turn = kind * (turn + ROUNDING)
    return Level(
        x, z, origin, margin, turn, axis.step, axis.n, max(float(margin.max()), 0.0), low, high
    )
