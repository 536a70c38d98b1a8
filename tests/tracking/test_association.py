"""Association probabilities against an enumeration of every joint assignment."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.tracking.association import LARGEST_EXACT, associate, clusters, marginals, propagated


def enumerated(ratio: np.ndarray) -> np.ndarray:
    """Every way to give each track one detection or none."""
    n, m = ratio.shape
    total, out = 0.0, np.zeros((n, m))
    for choice in itertools.product(range(-1, m), repeat=n):
        taken = [j for j in choice if j >= 0]
        if len(set(taken)) < len(taken):
            continue
        weight = float(np.prod([ratio[i, j] for i, j in enumerate(choice) if j >= 0]))
        total += weight
        for i, j in enumerate(choice):
            if j >= 0:
                out[i, j] += weight
    return out / total


def ratios(rng: np.random.Generator, n: int, m: int, gated: float = 0.7) -> np.ndarray:
    return np.exp(rng.uniform(-6.0, 12.0, (n, m))) * (rng.random((n, m)) < gated)


@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 4), (3, 3), (2, 5), (5, 2), (4, 4)])
def test_small_clusters_equal_enumeration(n: int, m: int) -> None:
    rng = np.random.default_rng(n * 10 + m)
    for _ in range(30):
        ratio = ratios(rng, n, m)
        np.testing.assert_allclose(associate(ratio).share, enumerated(ratio), rtol=0, atol=1e-12)


def test_largest_exact_cluster_equals_enumeration() -> None:
    rng = np.random.default_rng(4)
    ratio = ratios(rng, 6, 6, gated=1.0)
    np.testing.assert_allclose(marginals(ratio), enumerated(ratio), rtol=0, atol=1e-12)
    tall = ratios(rng, LARGEST_EXACT, 3, gated=1.0)
    np.testing.assert_allclose(marginals(tall), enumerated(tall), rtol=0, atol=1e-12)


def test_overwhelming_ratios_do_not_overflow() -> None:
    share = marginals(np.full((LARGEST_EXACT, LARGEST_EXACT), 1e120))
    np.testing.assert_allclose(share, 1.0 / LARGEST_EXACT, atol=1e-12)


@given(st.integers(0, 10_000), st.integers(1, 6), st.integers(1, 6))
def test_nobody_has_more_than_one(seed: int, n: int, m: int) -> None:
    share = associate(ratios(np.random.default_rng(seed), n, m)).share
    assert (share >= 0.0).all()
    assert (share.sum(axis=0) <= 1.0 + 1e-12).all()
    assert (share.sum(axis=1) <= 1.0 + 1e-12).all()


def test_belief_propagation_is_near_and_exact_without_loops() -> None:
    rng = np.random.default_rng(7)
    chain = ratios(rng, 4, 4, gated=1.0) * (np.eye(4) + np.eye(4, k=1) > 0)
    np.testing.assert_allclose(propagated(chain), enumerated(chain), atol=1e-6)
    off = []
    for _ in range(50):
        ratio = ratios(rng, 5, 5, gated=1.0)
        off.append(np.abs(propagated(ratio) - enumerated(ratio)).max())
    # Everybody contends for everything here, the worst case: measured 0.11 and 0.38.
    assert np.mean(off) < 0.15
    assert max(off) < 0.5


def test_a_crowd_is_approximated_and_told_so() -> None:
    rng = np.random.default_rng(8)
    found = associate(ratios(rng, 20, 25, gated=1.0))
    assert found.approximated
    assert np.isfinite(found.share).all()
    assert not associate(ratios(rng, 3, 25)).approximated


def test_clusters_part_what_shares_no_gate() -> None:
    gated = np.zeros((4, 5), dtype=bool)
    gated[0, 0] = gated[2, 0] = gated[2, 3] = gated[1, 4] = True
    found = [(list(t), list(d)) for t, d in clusters(gated)]
    assert found == [([0, 2], [0, 3]), ([1], [4])]
