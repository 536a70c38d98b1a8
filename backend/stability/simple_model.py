"""Two masses: the limits of Yamashita and Kikuuwe 2025, Eqs. (4), (5), (7)-(9), corrected.

Trajectory Generation for Tip-Over Prevention and Collision Avoidance of Automatic Excavators. The
non-moving part (tracks and upper body, M) stands with its centre of mass at height H; the moving
part (arm and load, m) is a point r_TB from there. Level ground; the upper body's own turning is
left out. These limits are shown; what is allowed comes from all links (`zmp`, `capacity`).

Corrected: in (5) the centripetal force has no z component; (7) is a limit only where the moving
part is outside of the edge, and none (inf) elsewhere; (8), (9) as printed halve twice, have r_TB,x
for r_TB,*, H for H + r_TB,z and a wrong sign below the bar, and lie seven times too high for a
13 t machine that reaches out by 5 m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array
from backend.stability.dynamics import centres
from backend.stability.masses import GRAVITY, MassModel
from backend.stability.polygon import Polygon


@dataclass(frozen=True)
class TwoMasses:
    """M, m: (...) non-moving and moving mass [kg]; H: (...) height of the non-moving part's centre
    [m]; r_TB: (..., 3) from there to the moving part's [m]; half: (..., 2) from the non-moving
    part's centre to the edge on the moving part's side, along x and y [m]: L/2 for one in the
    middle.
    """

    M: Array
    m: Array
    H: Array
    r_TB: Array
    half: Array


def two_masses(model: MassModel, support: Polygon, q: Array) -> TwoMasses:
    """The machine at q (..., n) [rad] as two masses; arm and load are what the swing only carries.

    The edges are those of the box around the support polygon: exact for a rectangle.
    """
    at = centres(model, q)
    moving = model.carried
    M, m = model.masses[~moving].sum(), model.masses[moving].sum()
    still = np.tensordot(model.masses[~moving], at[~moving], 1) / M
    r_TB = np.tensordot(model.masses[moving], at[moving], 1) / m - still
    low, high = support.vertices.min(axis=0), support.vertices.max(axis=0)
    half = np.where(r_TB[..., :2] >= 0.0, high - still[..., :2], still[..., :2] - low)
    batch = r_TB.shape[:-1]
    return TwoMasses(np.full(batch, M), np.full(batch, m), still[..., 2], r_TB, half)


def zmp_of_two(
    two: TwoMasses, a_z: Array | float = 0.0, omega: Array | float = 0.0, a_r: Array | float = 0.0
) -> Array:
    """(..., 2) from the non-moving part's centre [m]: Eqs. (4) and (5), corrected.

    a_z, a_r: (...) upward and outward acceleration of the moving part [m/s^2]; omega: (...) of the
    swing [rad/s].
    """
    m, r = two.m, two.r_TB
    f_z = m * a_z
    inwards = m * (a_r / _distance(two) - np.square(omega))
    f = inwards[..., None] * r[..., :2]
    weight = (two.M + m) * GRAVITY + f_z
    lever = two.H + r[..., 2]
    moment = (m * GRAVITY + f_z)[..., None] * r[..., :2] - lever[..., None] * f
    return np.asarray(moment / weight[..., None])


def critical_lift(two: TwoMasses) -> Array:
    """a_cz (..., 2): upward acceleration that tips over an edge along x, y [m/s^2]; Eq. (7).

    inf where the moving part is inside of that edge; 0 where the machine tips at rest.
    """
    r, half, M, m = _per_axis(two)
    outside = r > half
    with np.errstate(divide="ignore", invalid="ignore"):
        a = GRAVITY * (half * (M + m) - m * r) / (m * (r - half))
    return np.asarray(np.where(outside, np.maximum(a, 0.0), np.inf))


def critical_swing(two: TwoMasses, a_z: Array | float = 0.0, a_r: Array | float = 0.0) -> Array:
    """Omega_c (..., 2): swing rate that tips over an edge along x, y [rad/s]; Eqs. (8), (9).

    a_z, a_r: as in `zmp_of_two`. inf where no rate does; 0 where the machine tips at any.
    """
    r, half, M, m = _per_axis(two)
    a_z, a_r = np.asarray(a_z, dtype=float)[..., None], np.asarray(a_r, dtype=float)[..., None]
    lever = (two.H + two.r_TB[..., 2])[..., None]
    left = GRAVITY * (half * (1.0 + M / m) - r) + a_z * (half - r)
    left = left + a_r * lever * r / _distance(two)[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.maximum(left, 0.0) / (lever * r)
    never = np.where(left >= 0.0, np.inf, 0.0)
    return np.asarray(np.where(lever * r > 0.0, np.sqrt(np.maximum(square, 0.0)), never))


def _per_axis(two: TwoMasses) -> tuple[Array, Array, Array, Array]:
    return np.abs(two.r_TB[..., :2]), two.half, two.M[..., None], two.m[..., None]


def _distance(two: TwoMasses) -> Array:
    """rho (...) of the moving part from the non-moving part's centre, never 0 [m]."""
    return np.asarray(np.maximum(np.hypot(two.r_TB[..., 0], two.r_TB[..., 1]), 1e-12))
