"""What detections say of tracks: gates, likelihoods, and each model's probabilistic update.

Detections measure some numbers of the state as they are, so that each model's update is a Kalman
filter's. A box's yaw is known up to half a turn. Every detection counts with the probability that
it is the track's, and what its hypotheses are apart widens the covariance (PDA, Bar-Shalom and Tse
1975); each model's probability follows from how well it foretold them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from backend.spatial.types import Array, BoolArray
from backend.tracking.imm import Modes
from backend.tracking.records import HEIGHT, LENGTH, PZ, WIDTH, YAW, Detections, Settings
from backend.tracking.update_kernels import compare, update

_BETWEEN = {PZ: 4.0, YAW: np.pi, LENGTH: 3.0, WIDTH: 3.0, HEIGHT: 3.0}
"""Within which the numbers of a false detection lie: clutter is spread evenly over it [m, rad]."""


class Sight(NamedTuple):
    """n tracks, r models, k detections of d numbers. off: (n, r, k, d) detection less foretold;
    gain: (n, r, 11, d); S: (n, r, d, d) covariance of the foretold detection; likelihood:
    (n, r, k); gated: (n, k) whether a detection may be the track's.
    """

    off: Array
    gain: Array
    S: Array
    likelihood: Array
    gated: BoolArray


def sight(modes: Modes, seen: Detections, settings: Settings) -> Sight:
    """How each model's prediction agrees with each detection; the gate is that of the model whose
    S has the largest determinant.
    """
    h = np.array(seen.measured)
    arrays = (modes.mean, modes.cov, seen.values, seen.noise)
    plain = [np.ascontiguousarray(values, dtype=float) for values in arrays]
    off, gain, S, likelihood, squared, log_det = compare(*plain, h)
    nearest = squared[np.arange(len(squared)), log_det.argmax(axis=1)]
    return Sight(off, gain, S, likelihood, nearest <= _gate(len(h), settings.gate))


def ratios(modes: Modes, found: Sight, seen: Detections, settings: Settings) -> Array:
    """(n, k) see `association.associate`; 0 outside of the gate."""
    density = settings.clutter
    for number in seen.measured[2:]:
        density /= _BETWEEN[number]
    mixed = np.einsum("nr,nrk->nk", modes.mode, found.likelihood)
    least = settings.detected / (density * (1.0 - settings.detected))
    return np.where(found.gated, np.maximum(least * mixed, 1e-300), 0.0)


def updated(modes: Modes, found: Sight, share: Array) -> Modes:
    """Modes after the detections. share: (n, k) probability that a detection is the track's."""
    arrays = (modes.mean, modes.cov, modes.mode)
    plain = [np.ascontiguousarray(values, dtype=float) for values in arrays]
    return Modes(*update(*plain, found[:4], np.ascontiguousarray(share, dtype=float)))


@lru_cache(maxsize=32)
def _gate(d: int, share: float) -> float:
    return float(chdtri(d, 1.0 - share))
