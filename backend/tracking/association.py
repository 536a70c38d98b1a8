"""Which detection is whose: probabilities over all ways to assign each to one track at most.

Joint probabilistic data association (Fortmann, Bar-Shalom and Scheffe 1983). Tracks and detections
that share no gate are apart from each other and are solved by themselves (`clusters`). Small
clusters are exact, by a sum over subsets of the smaller side; in larger ones belief propagation
(Williams and Lau 2014) approximates, so that a crowd costs little more than a few people.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from backend.spatial.types import Array, BoolArray, IntArray
from backend.tracking.association_kernel import exact, parts, passed, shares

LARGEST_EXACT = 8
"""Clusters in which both tracks and detections are more than this are approximated."""


class Association(NamedTuple):
    """share: (n, m) probability that track i made detection j; approximated: whether a cluster was
    too large for an exact sum.
    """

    share: Array
    approximated: bool


def associate(ratio: Array, largest_exact: int = LARGEST_EXACT) -> Association:
    """Marginal probabilities of all joint assignments.

    ratio: (n, m), how much likelier detection j is as track i's than as clutter, relative to track
    i not being seen: P_D p_ij / (lambda (1 - P_D)); 0 outside of the gate. An assignment's weight
    is the product of the ratios of its pairs.
    """
    share, approximated = shares(np.ascontiguousarray(ratio, dtype=float), largest_exact)
    return Association(share, bool(approximated))


def marginals(ratio: Array) -> Array:
    """(n, m) exact; the time grows with 2^min(n, m)."""
    if ratio.shape[1] <= ratio.shape[0]:
        return np.asarray(exact(np.ascontiguousarray(ratio)))
    return np.asarray(exact(np.ascontiguousarray(ratio.T))).T


def propagated(ratio: Array) -> Array:
    """(n, m) by loopy belief propagation, which always converges here (Williams and Lau 2014)."""
    return np.asarray(passed(np.ascontiguousarray(ratio, dtype=float)))


def clusters(gated: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
    """(tracks, detections) that are connected by gates, each at least one. gated: (n, m)."""
    of_track, of_detection, count = parts(np.ascontiguousarray(gated))
    for c in range(count):
        yield np.flatnonzero(of_track == c), np.flatnonzero(of_detection == c)
