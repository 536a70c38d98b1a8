"""Time along a curve: TOPP-RA, and the same problem for CasADi and IPOPT."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from backend.errors import InputError
from backend.planning.trajectory.curve import Curve
from backend.planning.trajectory.rows import Rows
from backend.spatial.types import Array

_FLOOR = 1e-10


class Timed(NamedTuple):
    """t, s, speed: (N + 1,) along the curve; u: (N,) s'' of each interval."""

    t: Array
    s: Array
    speed: Array
    u: Array

    def sampled(self, curve: Curve, t: Array) -> tuple[Array, Array, Array]:
        """Joint values, rates and accelerations (m, n) at times t (m,)."""
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.u) - 1)
        tau = t - self.t[k]
        s = self.s[k] + self.speed[k] * tau + 0.5 * self.u[k] * tau**2
        v = np.maximum(self.speed[k] + self.u[k] * tau, 0.0)
        first = curve.at(s, 1)
        acceleration = first * self.u[k][:, None] + curve.at(s, 2) * (v**2)[:, None]
        return curve.at(s), first * v[:, None], acceleration

    def slowed(self, factor: float) -> Timed:
        """All of it `factor` times as long."""
        return Timed(self.t * factor, self.s, self.speed / factor, self.u / factor**2)

    def times(self, step: float) -> Array:
        """Every `step` [s], and the end."""
        end = float(self.t[-1])
        return np.append(np.arange(0.0, end - 1e-6, step), end)


def timed(rows: Rows, x: Array) -> Timed:
    """Of squared speeds x (N + 1,), 0 at both ends; each interval at one s''."""
    speed, ds = np.sqrt(np.maximum(x, 0.0)), np.diff(rows.s)
    t = np.concatenate([[0.0], np.cumsum(2.0 * ds / np.maximum(speed[1:] + speed[:-1], _FLOOR))])
    return Timed(t, rows.s, speed, np.diff(x) / (2.0 * ds))


def toppra_timing(rows: Rows) -> Timed | None:
    """Time-optimal by reachability analysis (Pham and Pham 2018), at rest at both ends; None when
    no timing keeps the rows.
    """
    # Loads slowly, and tells by its logger what is told by None here.
    import toppra
    from toppra import algorithm, constraint
    from toppra.algorithm.reachabilitybased import reachability_algorithm

    reachability_algorithm.logger.disabled = True

    class Given(constraint.LinearConstraint):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.identical = True
            self.dof = 1

        def compute_constraint_params(self, path: object, gridpoints: Array) -> tuple[object, ...]:
            m = rows.a.shape[1]
            bound = np.stack([np.zeros_like(rows.most), rows.most], axis=1)
            return rows.a, rows.b, -rows.c, np.eye(m), np.zeros(m), None, bound

    line = toppra.SplineInterpolator([0.0, float(rows.s[-1])], [[0.0], [1.0]])
    solver = algorithm.TOPPRA([Given()], line, gridpoints=rows.s, solver_wrapper="seidel")
    _, speed, _ = solver.compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all() or (speed[1:-1] <= 0.0).any():
        return None
    return timed(rows, np.asarray(speed) ** 2)


def casadi_timing(rows: Rows) -> Timed | None:
    """The same problem as one convex program, by IPOPT. Raises InputError without CasADi."""
    try:
        import casadi
    except ImportError as error:
        raise InputError(
            "method casadi: CasADi is not installed; allowed are the other methods, or install "
            "the extra planning."
        ) from error
    count = len(rows.s)
    x, ds = casadi.SX.sym("x", count), np.diff(rows.s)
    u = (x[1:] - x[:-1]) / (2.0 * ds)
    speed = casadi.sqrt(x + _FLOOR)
    duration = casadi.sum1(2.0 * ds / (speed[1:] + speed[:-1]))
    g = [
        rows.a[:-1, k] * u + rows.b[:-1, k] * x[:-1] - rows.c[:-1, k]
        for k in range(rows.a.shape[1])
    ]
    quiet: Any = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "ipopt.max_iter": 500}
    problem: Any = {"x": x, "f": duration, "g": casadi.vertcat(*g)}
    solver = casadi.nlpsol("timing", "ipopt", problem, quiet)
    upper = rows.most.copy()
    upper[[0, -1]] = 0.0
    start = 0.05 * np.minimum(rows.most, 1.0)
    found = solver(x0=start, lbx=np.zeros(count), ubx=upper, lbg=-np.inf, ubg=0.0)
    if not solver.stats()["success"]:
        return None
    return timed(rows, np.asarray(found["x"]).ravel())
