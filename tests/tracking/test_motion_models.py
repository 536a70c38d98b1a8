"""The motion models and their sigma points against closed forms and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.spatial.angles import wrap
from backend.tracking.imm import Modes, ahead, mixed, mixture, predicted, unscented
from backend.tracking.motion import CT, CV, MODELS, RANDOM, Noise, jolts, moved, switching
from backend.tracking.records import PX, PY, STATE, TURN, VX, VY, YAW

NOISE = Noise()
CIRCLE = Noise(turned=1e9)  # a turn rate that does not fade


def state(**given: float) -> np.ndarray:
    x = np.zeros(STATE)
    names = {"px": PX, "py": PY, "vx": VX, "vy": VY, "yaw": YAW, "turn": TURN}
    for name, value in given.items():
        x[names[name]] = value
    return x


def modes(rng: np.random.Generator, n: int = 3) -> Modes:
    mean = rng.normal(size=(n, MODELS, STATE))
    root = rng.normal(scale=0.3, size=(n, MODELS, STATE, STATE))
    mode = rng.random((n, MODELS)) + 0.1
    cov = root @ np.swapaxes(root, 2, 3) + 0.01 * np.eye(STATE)
    return Modes(mean, cov, mode / mode.sum(axis=1, keepdims=True))


@given(st.floats(-3.0, 3.0), st.floats(0.01, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_constant_turn_is_a_circle(turn: float, dt: float, vx: float, vy: float) -> None:
    end = moved(CT, state(vx=vx, vy=vy, turn=turn), dt, CIRCLE)
    fine, steps = np.zeros(2), 4000
    for k in range(steps):
        angle = turn * dt * (k + 0.5) / steps
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        fine += rotation @ [vx, vy] * dt / steps
    np.testing.assert_allclose(end[[PX, PY]], fine, atol=1e-5)
    assert np.hypot(end[VX], end[VY]) == pytest.approx(np.hypot(vx, vy))
    assert end[YAW] == pytest.approx(turn * dt)


def test_a_turn_that_ends_straight_is_smooth() -> None:
    straight = moved(CV, state(vx=1.0, vy=0.5), 0.4, NOISE)
    for turn in (0.0, 1e-9, 1e-7, 2e-6):
        np.testing.assert_allclose(
            moved(CT, state(vx=1.0, vy=0.5, turn=turn), 0.4, NOISE), straight, atol=1e-5
        )


def test_a_turn_fades() -> None:
    end = moved(CT, state(vx=1.0, turn=1.5), 20.0 * NOISE.turned, NOISE)
    assert end[YAW] == pytest.approx(1.5 * NOISE.turned)
    assert abs(end[TURN]) < 1e-8
    assert np.hypot(end[VX], end[VY]) == pytest.approx(1.0)


def test_random_motion_fades() -> None:
    far = moved(RANDOM, state(vx=1.0), 50.0 * NOISE.fade, NOISE)
    assert far[PX] == pytest.approx(NOISE.fade)
    assert abs(far[VX]) < 1e-12
    twice = moved(RANDOM, moved(RANDOM, state(vx=1.0, turn=0.5), 0.3, NOISE), 0.3, NOISE)
    np.testing.assert_allclose(twice, moved(RANDOM, state(vx=1.0, turn=0.5), 0.6, NOISE))


def test_noise_of_two_halves_is_that_of_the_whole() -> None:
    half, whole = jolts(0.1, NOISE), jolts(0.2, NOISE)
    F = moved(CV, np.eye(STATE), 0.1, NOISE).T
    np.testing.assert_allclose(F @ half[CV] @ F.T + half[CV], whole[CV], atol=1e-12)


def test_switching_is_a_markov_chain() -> None:
    once = switching(0.1, NOISE)
    np.testing.assert_allclose(once.sum(axis=1), 1.0)
    np.testing.assert_allclose(once @ once, switching(0.2, NOISE))


def test_sigma_points_of_a_linear_motion_are_exact() -> None:
    """Without a turn rate, known for certain, the turning model is linear."""
    rng = np.random.default_rng(1)
    start = modes(rng, 1)
    mean, cov = start.mean[:, CT].copy(), start.cov[:, CT].copy()
    mean[:, TURN] = cov[:, TURN] = cov[:, :, TURN] = 0.0
    cov[:, TURN, TURN] = 1e-18
    found, spread = unscented(mean, cov, 0.3, NOISE)
    F = moved(CV, np.eye(STATE), 0.3, NOISE).T
    np.testing.assert_allclose(found, mean @ F.T, atol=1e-8)
    np.testing.assert_allclose(spread, F @ cov @ F.T, atol=1e-6)


def test_sigma_points_of_a_turn_agree_with_samples() -> None:
    rng = np.random.default_rng(2)
    mean = state(vx=1.2, vy=0.3, turn=0.4)
    deviation = np.full(STATE, 0.1)
    cov = np.diag(deviation**2)
    found, spread = unscented(mean[None], cov[None], 1.0, NOISE)
    many = moved(CT, rng.multivariate_normal(mean, cov, 200_000), 1.0, NOISE)
    np.testing.assert_allclose(found[0], many.mean(axis=0), atol=5e-3)
    np.testing.assert_allclose(spread[0], np.cov(many.T), atol=5e-3)


def test_mixing_keeps_mean_and_covariance_of_the_mixture() -> None:
    rng = np.random.default_rng(3)
    before = modes(rng)
    after = mixed(before, switching(0.5, NOISE))
    for a, b in zip(mixture(before), mixture(after), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)


def test_mixing_as_printed_with_the_right_indices() -> None:
    """mu(i|j) = p_ij mu_i / sum_i p_ij mu_i, one by one."""
    before = modes(np.random.default_rng(4), 1)
    change = switching(0.4, NOISE)
    after = mixed(before, change)
    for j in range(MODELS):
        w = change[:, j] * before.mode[0]
        assert after.mode[0, j] == pytest.approx(w.sum())
        w /= w.sum()
        x = sum(w[i] * before.mean[0, i] for i in range(MODELS))
        np.testing.assert_allclose(after.mean[0, j], x)
        P = sum(
            w[i] * (before.cov[0, i] + np.outer(before.mean[0, i] - x, before.mean[0, i] - x))
            for i in range(MODELS)
        )
        np.testing.assert_allclose(after.cov[0, j], P)


def test_yaw_is_mixed_across_half_a_turn() -> None:
    one = modes(np.random.default_rng(5), 1)
    one.mean[0, :, YAW] = [np.pi - 0.1, -np.pi + 0.1, np.pi - 0.1]
    mean, cov = mixture(one)
    assert abs(wrap(mean[0, YAW] - np.pi)) < 0.2
    assert cov[0, YAW, YAW] < one.cov[0, :, YAW, YAW].max() + 0.1


def test_covariances_stay_positive_and_grow_ahead() -> None:
    start = modes(np.random.default_rng(6))
    near = mixture(predicted(start, 0.1, NOISE))[1]
    far = ahead(start, 1.0, NOISE)[1]
    for cov in (near, far):
        assert (np.linalg.eigvalsh(cov) > 0.0).all()
    assert (far[:, PX, PX] > near[:, PX, PX]).all()
