"""A C2 curve along a polyline of joint values: a clamped cubic B-spline, checked anew."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from backend.machine.model import Machine
from backend.planning.trajectory.sweep import Sweep
from backend.spatial.types import Array

SPACINGS = (1.2, 0.6, 0.3, 0.15, 0.08, 0.04, 0.02, 0.01)
"""Of control points along the way, tried in turn: time at full speed [s]."""
_SAGITTA = 2e-3  # [m] that a point may leave the chords that are checked


@dataclass(frozen=True)
class Curve:
    """q(s) for s in 0..length; spline of (n,) values, twice continuously differentiable."""

    spline: BSpline
    length: float

    def at(self, s: Array, order: int = 0) -> Array:
        """(..., n) of the order-th derivative at s (...)."""
        held = (self.spline, self._first, self._second)[order]
        return np.asarray(held(np.clip(s, 0.0, self.length)))

    @property
    def spans(self) -> int:
        """Polynomial pieces."""
        return len(self.spline.c) - 3

    @cached_property
    def _first(self) -> BSpline:
        return self.spline.derivative(1)

    @cached_property
    def _second(self) -> BSpline:
        return self.spline.derivative(2)

    @cached_property
    def most_bent(self) -> Array:
        """(n,) upper bound of |q''|: control points bound a B-spline."""
        return np.asarray(np.abs(np.asarray(self._second.c)).max(axis=0))


def curve_along(points: Array, weights: Array, spacing: float) -> Curve:
    """Control points at the knots' averages (Greville) along the polyline (m, n): straight legs are
    reproduced at constant speed, corners are rounded within `spacing` of them.

    weights: (n,) [s/rad] make the length of a leg the largest weighted change of a joint.
    """
    legs = np.maximum(np.abs(np.diff(points, axis=0) * weights).max(axis=1), 1e-9)
    along = np.concatenate([[0.0], np.cumsum(legs)])
    length = float(along[-1])
    count = max(6, int(np.ceil(length / spacing)))
    inner = np.linspace(0.0, length, count + 1)
    knots = np.concatenate([np.zeros(3), inner, np.full(3, length)])
    greville = (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0
    control = np.stack([np.interp(greville, along, column) for column in points.T], axis=1)
    return Curve(BSpline(knots, control, 3), length)


def free_curve(machine: Machine, points: Array, weights: Array, sweep: Sweep) -> Curve | None:
    """The roundest curve along the free polyline (m, n) that is free, too, and within the joints'
    ends; None when none is.

    Free means checked along chords from which the curve departs by at most 2 mm, each certified.
    """
    moved = np.asarray(machine.body_joints.any(axis=1))
    levers = np.where(moved[:, None], machine.stretched_levers, 0.0)
    lever = levers.max(axis=0)
    for spacing in SPACINGS:
        curve = curve_along(points, weights, spacing)
        # A chord over h departs by at most h^2/8 |q''|.
        bend = float(lever @ curve.most_bent)
        h = np.sqrt(8.0 * _SAGITTA / max(bend, 1e-12))
        count = max(24, int(np.ceil(curve.length / h)))
        q = curve.at(np.linspace(0.0, curve.length, count + 1))
        inside = (q >= machine.lower - 1e-6).all() and (q <= machine.upper + 1e-6).all()
        if inside and sweep.blocked(q) is None:
            return curve
    return None
