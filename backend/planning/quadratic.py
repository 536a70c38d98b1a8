"""Small convex quadratic programs by the dual active-set method.

D. Goldfarb, A. Idnani, *A numerically stable dual method for solving strictly convex quadratic
programs*, Mathematical Programming 27 (1983) 1-33: it starts at the unconstrained minimum and adds
the most violated constraint until none is left, so that it needs no feasible start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.planning import quadratic_kernel
from backend.spatial.types import Array, BoolArray


class Minimum(NamedTuple):
    """x: (n,); multipliers: (m,) of the constraints, >= 0; feasible: all constraints can be met."""

    x: Array
    multipliers: Array
    feasible: bool


def minimise(H: Array, g: Array, A: Array, b: Array) -> Minimum:
    """The x that minimises x^T H x / 2 + g^T x with A x >= b.

    H: (n, n) positive definite; g: (n,); A: (m, n); b: (m,). Where the constraints contradict each
    other x is where the search ended, and feasible is False.
    """
    rows = np.ascontiguousarray(A, dtype=np.float64)
    length = np.maximum(np.linalg.norm(rows, axis=1), 1e-12)
    x, u, ok = quadratic_kernel.minimise(
        np.ascontiguousarray(np.linalg.inv(H)), g, rows / length[:, None], b / length
    )
    return Minimum(x, u / length, bool(ok))


def minimise_softly(
    H: Array, g: Array, A: Array, b: Array, soft: BoolArray, price: float
) -> Minimum:
    """The same where the rows `soft` (m,) may all miss by one amount s, at price * s^2 / 2.

    Feasible when the other rows are. x: (n,).
    """
    n = len(g)
    H_s = np.zeros((n + 1, n + 1))
    H_s[:n, :n], H_s[n, n] = H, price
    A_s = np.zeros((len(A) + 1, n + 1))
    A_s[:-1, :n], A_s[:-1, n], A_s[-1, n] = A, soft.astype(float), 1.0
    found = minimise(H_s, np.append(g, 0.0), A_s, np.append(b, 0.0))
    return Minimum(found.x[:n], found.multipliers[:-1], found.feasible)
