"""Method C: the joint rates nearest to the wish under one linear constraint per close pair.

B. Faverjon, P. Tournassoud, *A local based approach for path planning of manipulators with a high
number of degrees of freedom*, ICRA 1987: the velocity damper n . J q' >= -xi (d - d_s)/(d_i - d_s).
Its slope xi/(d_i - d_s) is one number, `rate`, and the line goes on beyond d_i, so that nothing
jumps where a pair comes near. Motion along a limit costs nothing, and where a point is inside of
d_s the row asks for retreat.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.planning.quadratic import minimise, minimise_softly
from backend.planning.records import Settings
from backend.spatial.types import Array, IntArray

_PRICE = 1e6  # of missing a damper, against missing the wish
_BINDS = 1e-9


class Constrained(NamedTuple):
    """rates: (n,) [rad/s]; binding: rows of the dampers with a multiplier; kept: all rows hold."""

    rates: Array
    binding: IntArray
    kept: bool


def nearest_to_rates(wish: Array, max_velocity: Array) -> tuple[Array, Array]:
    """H (n, n), g (n,) of the distance to joint rates, each joint's in parts of its full speed."""
    weight = 1.0 / max_velocity**2
    return np.diag(weight), -weight * wish


def nearest_by_tool(wish: Array, J: Array, damping: float) -> tuple[Array, Array]:
    """H, g of |J (q' - wish)|^2 / 2 + damping^2 |q' - wish|^2 / 2: what the tool does counts, and
    where it may not follow, its way and turn give in together. J: (6, n); wish: (n,).
    """
    H = J.T @ J + damping**2 * np.eye(J.shape[1])
    return H, -H @ wish


def damper_bounds(distance: Array, settings: Settings, rate: float) -> Array:
    """(k,) least speeds of parting [m/s]: -rate (d - d_s), and at most `retreat` inside of d_s."""
    return np.minimum(-rate * (distance - settings.thresholds.lower), settings.retreat)


def approaching(gradient: Array, low: Array, high: Array) -> Array:
    """(k, n) the gradient without the joints that only part within their bounds, low <= 0 <= high.

    Rates that keep such rows keep them at any share of each joint as well.
    """
    return np.where(np.minimum(gradient * low, gradient * high) < 0.0, gradient, 0.0)


def constrain(
    H: Array, g: Array, gradient: Array, parting: Array, low: Array, high: Array
) -> Constrained:
    """The rates of least H, g with gradient q' >= parting and low <= q' <= high.

    gradient: (k, n) [m/rad]; parting: (k,) [m/s]; low, high: (n,) [rad/s]. Outside of d_s and with
    low <= 0 <= high, standing still keeps every row. Where the rows contradict each other they are
    missed by as little as may be, the same for each, and `kept` is False. A joint whose bounds
    leave it one rate has it, and the others are judged beside it.
    """
    given = low == high
    if given.any():
        free = ~given
        rates = np.array(low)
        left = parting - gradient[:, given] @ low[given]
        if not free.any():
            return Constrained(rates, np.zeros(0, dtype=np.int64), bool((left <= 0.0).all()))
        rest = constrain(
            H[np.ix_(free, free)],
            g[free] + H[np.ix_(free, given)] @ low[given],
            *(gradient[:, free], left, low[free], high[free]),
        )
        rates[free] = rest.rates
        return rest._replace(rates=rates)
    n = len(g)
    # Rows that no admissible rates can break are left out.
    worst = np.minimum(gradient * low, gradient * high).sum(axis=1)
    some = np.flatnonzero(worst < parting)
    A = np.concatenate([gradient[some], np.eye(n), -np.eye(n)])
    b = np.concatenate([parting[some], low, -high])
    found = minimise(H, g, A, b)
    kept = found.feasible
    if not kept:
        soft = np.arange(len(A)) < len(some)
        found = minimise_softly(H, g, A, b, soft, _PRICE * float(np.trace(H)))
    rates = np.clip(found.x, low, high)
    return Constrained(rates, some[found.multipliers[: len(some)] > _BINDS], kept)
