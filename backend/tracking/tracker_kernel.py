"""The compiled bookkeeping of `tracker`: who is confirmed, coasts, or is given up."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray, IntArray
from backend.tracking.imm_kernels import mix
from backend.tracking.records import PX, PY, PZ

SEEN = 0.5
"""Probability above which a track counts as detected, or a detection as somebody's."""
_SAME = 0.15  # tracks whose means are nearer than this are one [m]
_TENTATIVE, _CONFIRMED, _COASTING = 0, 1, 2  # as `records.Status`


@njit(cache=True, nogil=True)
def age(
    modes: tuple[Array, Array, Array],
    tracks: tuple[IntArray, IntArray, IntArray, Array, IntArray],
    share: Array,
    time: float,
    confirm: tuple[int, int],
    longest: tuple[float, float, float],
) -> tuple[IntArray, IntArray, IntArray, Array, BoolArray, BoolArray, Array]:
    """(n,) status, scans, seen, last_seen, whether a track goes on, whether it is told as lost, and
    (n, 3) places.

    modes: after the scan; tracks: status, scans, seen, last_seen and id before it; share: (n, k);
    time: of the scan [s]; confirm: of how many scans how many must have seen it; longest: coasting,
    coasting while tentative [s], standard deviation of a place [m].
    """
    status, scans, seen, last, number = tracks
    n = len(status)
    to_status, to_scans, to_seen, to_last = status.copy(), scans + 1, seen.copy(), last.copy()
    kept, lost, places = np.ones(n, np.bool_), np.zeros(n, np.bool_), np.empty((n, 3))
    mixed, spread, _ = mix(modes[0], modes[1], modes[2], np.ones((modes[0].shape[1], 1)))
    for i in range(n):
        hit = share[i].sum() > SEEN
        if hit:
            to_seen[i] += 1
            to_last[i] = time
        if status[i] != _TENTATIVE or to_seen[i] >= confirm[0]:
            to_status[i] = _CONFIRMED if hit else _COASTING
        for x, axis in enumerate((PX, PY, PZ)):
            places[i, x] = mixed[i, 0, axis]
    for i in range(n):
        tentative = to_status[i] == _TENTATIVE
        twice = False
        for j in range(n):
            if tentative and number[i] > number[j]:
                x, y = places[i, 0] - places[j, 0], places[i, 1] - places[j, 1]
                twice = twice or np.hypot(x, y) < _SAME
        too_long = time - to_last[i] > (longest[1] if tentative else longest[0]) + 1e-9
        unsure = tentative and to_scans[i] >= confirm[1]
        variance = max(spread[i, 0, PX, PX], spread[i, 0, PY, PY])
        gone = too_long or unsure or np.sqrt(variance) > longest[2]
        kept[i] = not (gone or twice)
        lost[i] = gone and not tentative and not twice
    return to_status, to_scans, to_seen, to_last, kept, lost, places
