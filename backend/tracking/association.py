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
from backend.tracking.association_kernel import exact

LARGEST_EXACT = 8
"""Clusters in which both tracks and detections are more than this are approximated."""
CONVERGED = 1e-9
MOST_ROUNDS = 200


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
    share, approximated = np.zeros(ratio.shape), False
    for tracks, detections in clusters(np.asarray(ratio > 0.0)):
        part = ratio[np.ix_(tracks, detections)]
        if part.size == 1:
            found = part / (1.0 + part)
        elif min(part.shape) <= largest_exact:
            found = marginals(part)
        else:
            found, approximated = propagated(part), True
        share[np.ix_(tracks, detections)] = found
    return Association(share, approximated)


def marginals(ratio: Array) -> Array:
    """(n, m) exact; the time grows with 2^min(n, m)."""
    if ratio.shape[1] <= ratio.shape[0]:
        return np.asarray(exact(np.ascontiguousarray(ratio)))
    return np.asarray(exact(np.ascontiguousarray(ratio.T))).T


def propagated(ratio: Array) -> Array:
    """(n, m) by loopy belief propagation, which always converges here (Williams and Lau 2014)."""
    to_track = np.ones(ratio.shape)
    for _ in range(MOST_ROUNDS):
        weighted = ratio * to_track
        to_detection = ratio / (1.0 + weighted.sum(axis=1, keepdims=True) - weighted)
        others = to_detection.sum(axis=0, keepdims=True) - to_detection
        before, to_track = to_track, 1.0 / (1.0 + np.maximum(others, 0.0))
        if np.abs(to_track - before).max() < CONVERGED:
            break
    weighted = ratio * to_track
    return np.asarray(weighted / (1.0 + weighted.sum(axis=1, keepdims=True)))


def clusters(gated: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
    """(tracks, detections) that are connected by gates, each at least one. gated: (n, m)."""
    left = np.asarray(gated.any(axis=1))
    while left.any():
        tracks: BoolArray = np.zeros(len(gated), dtype=bool)
        tracks[np.argmax(left)] = True
        while True:
            detections = gated[tracks].any(axis=0)
            more = np.asarray(gated[:, detections].any(axis=1))
            if (more == tracks).all():
                break
            tracks = more
        left[tracks] = False
        yield np.flatnonzero(tracks), np.flatnonzero(detections)
