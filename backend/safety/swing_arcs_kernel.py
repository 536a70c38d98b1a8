"""The compiled sums of `swing_arcs`: from each sample of a body to each object along the circle."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array

_TURN = 2.0 * np.pi
_LARGEST = 1e9  # [m]


@njit(cache=True)
def gaps(
    at: Array,
    angle: Array,
    low: Array,
    high: Array,
    spacing: Array,
    objects: tuple[Array, Array, Array, Array, Array],
    turned: float,
    headroom: float,
) -> tuple[Array, Array, Array]:
    """(b, k) angles that b bodies can turn in the negative and in the positive direction until one
    of their samples comes within reach of k objects, infinite where none ever does, and (b, k) the
    lesser of both, negative where one is within reach [rad]. What is no number of this world is
    within reach.

    at, angle: (b, p) of the samples; low, high, spacing: (b,) [m]; objects: (k,) distance from the
    axis, direction, reach beyond `spacing`, low and high; turned: how far the bodies turned [rad].
    """
    far, place, reach, bottom, top = objects
    b, p = at.shape
    k = len(far)
    back, ahead = np.full((b, k), np.inf), np.full((b, k), np.inf)
    nearest = np.full((b, k), np.inf)
    for i in range(b):
        for j in range(k):
            within = reach[j] + spacing[i]
            sane = far[j] + abs(place[j]) + abs(within) < _LARGEST
            if not (sane and np.isfinite(top[j] - bottom[j] + high[i] - low[i])):
                back[i, j] = ahead[i, j] = nearest[i, j] = -np.inf
                continue
            if low[i] >= top[j] + headroom or high[i] <= bottom[j] - headroom:
                continue
            for s in range(p):
                r = at[i, s]
                if abs(r - far[j]) > within:
                    continue
                # Half the angle within which a sample is nearer than `within`: law of cosines.
                cosine = (r**2 + far[j] ** 2 - within**2) / (2.0 * r * far[j])
                wide = np.arccos(min(max(cosine, -1.0), 1.0))
                delta = (place[j] - angle[i, s] - turned) % _TURN
                other = (-delta) % _TURN
                ahead[i, j] = min(ahead[i, j], delta - wide)
                back[i, j] = min(back[i, j], other - wide)
                nearest[i, j] = min(nearest[i, j], min(delta, other) - wide)
    return back, ahead, nearest
