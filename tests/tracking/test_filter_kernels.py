"""The compiled filter against the same sums written plainly."""

from __future__ import annotations

import numpy as np
import plain_filter as plain
import pytest
from numpy.testing import assert_allclose

from backend.tracking import imm
from backend.tracking.imm_kernels import mix
from backend.tracking.motion import CT, MODELS, Noise, moved, switching
from backend.tracking.records import MEASURED, PX, PY, PZ, STATE, Detections, Settings
from backend.tracking.update import sight, updated
from backend.tracking.update_kernels import compare

NOISE = Noise()
CLOSE = {"rtol": 1e-12, "atol": 1e-12}


def modes(seed: int, n: int = 4) -> imm.Modes:
    """Tracks whose models agree about as well as they do in life."""
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(n, 1, STATE)) + rng.normal(scale=0.2, size=(n, MODELS, STATE))
    root = rng.normal(scale=0.2, size=(n, MODELS, STATE, STATE))
    mode = rng.random((n, MODELS)) + 0.01
    cov = root @ np.swapaxes(root, 2, 3) + 0.05 * np.eye(STATE)
    return imm.Modes(mean, cov, mode / mode.sum(axis=1, keepdims=True))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dt", [0.013, 0.1, 0.25])
def test_mixing_and_prediction(seed: int, dt: float) -> None:
    start = modes(seed)
    change = switching(dt, NOISE)
    for found, expected in zip(
        imm.foretold(start, dt, NOISE),
        plain.predicted(plain.mixed(start, change), dt, NOISE),
        strict=True,
    ):
        assert_allclose(found, expected, **CLOSE)
    for found, expected in zip(imm.mixture(start), plain.mixture(start), strict=True):
        assert_allclose(found, expected, **CLOSE)


def test_the_turn_where_it_is_nearly_none() -> None:
    x = np.random.default_rng(3).normal(size=(5, 7, STATE))
    x[0, :, 7] = [0.0, 1e-9, -1e-7, 2e-6, -1e-5, 9.0, -9.0]
    assert_allclose(moved(CT, x, 0.3, NOISE), plain.turned(x, 0.3, NOISE), **CLOSE)


@pytest.mark.parametrize("measured", [(PX, PY), (PX, PY, PZ), MEASURED])
@pytest.mark.parametrize("count", [1, 5])
def test_comparison_and_update(measured: tuple[int, ...], count: int) -> None:
    rng = np.random.default_rng(count)
    start = modes(7)
    values = start.mean[0, 0, list(measured)] + rng.normal(scale=0.3, size=(count, len(measured)))
    seen = Detections(0.0, values, measured, rng.uniform(0.05, 0.3, len(measured)))
    expected = plain.compared(start, seen)
    found = compare(start.mean, start.cov, values, seen.noise, np.array(measured))
    for one, other in zip(found, expected, strict=True):
        assert_allclose(one, other, **CLOSE)
    share = rng.dirichlet(np.ones(count + 1), 4)[:, :count]
    after = updated(start, sight(start, seen, Settings()), share)
    for one, other in zip(after, plain.updated(start, *expected[:4], share), strict=True):
        assert_allclose(one, other, **CLOSE)


def test_nobody_is_left_as_nobody() -> None:
    none = modes(1, 0)
    assert imm.mixture(none)[0].shape == (0, STATE)
    assert imm.foretold(none, 0.1, NOISE).cov.shape == (0, MODELS, STATE, STATE)


def test_a_model_that_nothing_leads_to_is_no_number_for_nobody() -> None:
    start = modes(2)
    mean, cov, prior = mix(*start, np.array([[1.0, 0.0]] * MODELS))
    assert_allclose(prior, [[1.0, 0.0]] * 4, atol=1e-15)
    assert np.isfinite(mean).all()
    assert np.isfinite(cov).all()


def test_a_covariance_without_a_root_is_no_end() -> None:
    """What a plain Cholesky factor would raise an error for, in the middle of a drive."""
    start = modes(5)
    start.cov[:, CT] = 0.0
    after = imm.predicted(start, 0.1, NOISE)
    assert_allclose(after.mean[:, CT], moved(CT, start.mean[:, CT], 0.1, NOISE), **CLOSE)
