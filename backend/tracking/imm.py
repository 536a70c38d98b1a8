"""The interacting multiple models of a track: mixing, prediction by sigma points, the mixture.

Mixing weights mu(i|j) = p_ij mu_i / sum_i p_ij mu_i (Blom and Bar-Shalom 1988; Rasul 2021,
Eqs. (11)-(13), whose sums run over the models i). Sigma points with the weights of Wan and van der
Merwe 2000: lambda = a^2 (n + k) - n.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from backend.spatial.types import Array, BoolArray
from backend.tracking.imm_kernels import advance, ahead_each, forward, mix, unscent
from backend.tracking.motion import CV, MODELS, RANDOM, Noise, jolts, moved, switching
from backend.tracking.records import STATE

ALPHA, BETA, KAPPA = 1.0, 2.0, 0.0
_SPREAD = ALPHA**2 * (STATE + KAPPA)  # n + lambda
_MEAN = np.full(2 * STATE + 1, 0.5 / _SPREAD)
_MEAN[0] = (_SPREAD - STATE) / _SPREAD
_COV = _MEAN.copy()
_COV[0] += 1.0 - ALPHA**2 + BETA
_POINTS = _MEAN, _COV, _SPREAD
_ALL = np.ones((MODELS, 1))
STEPS_AHEAD = 4
"""In which a prediction is made, models changing from one to the next."""


class Modes(NamedTuple):
    """mean: (n, r, 11); cov: (n, r, 11, 11); mode: (n, r)."""

    mean: Array
    cov: Array
    mode: Array


class _Step(NamedTuple):
    """F: of the linear models, (r, 11, 11); Q: noise, (r, 11, 11); change: (r, r)."""

    F: Array
    Q: Array
    change: Array


@lru_cache(maxsize=64)
def _step(dt: float, noise: Noise) -> _Step:
    """What a prediction by dt needs; scans come at few different intervals."""
    F = np.zeros((MODELS, STATE, STATE))
    for model in (CV, RANDOM):
        F[model] = moved(model, np.eye(STATE), dt, noise).T
    return _Step(F, jolts(dt, noise), switching(dt, noise))


def mixed(modes: Modes, change: Array) -> Modes:
    """Each model's prior from all models' posteriors. change: (r, r), see `motion.switching`."""
    return Modes(*mix(*_plain(modes), change))


def predicted(modes: Modes, dt: float, noise: Noise) -> Modes:
    """Each model's own prediction by dt [s], noise included; probabilities as they are.

    Two models are linear: sigma points would only repeat their exact result.
    """
    step = _step(dt, noise)
    mean, cov = (np.array(values, dtype=float, order="C") for values in modes[:2])
    forward(mean, cov, step.F, step.Q, _POINTS, dt, noise.turned)
    return Modes(mean, cov, modes.mode)


def foretold(modes: Modes, dt: float, noise: Noise, steps: int = 1) -> Modes:
    """Mixed and predicted by dt [s], `steps` times."""
    step = _step(dt, noise)
    ready = tuple(_plain(modes))
    found = advance(ready, step.change, step.F, step.Q, _POINTS, dt, noise.turned, steps)
    return Modes(*found)


def unscented(mean: Array, cov: Array, dt: float, noise: Noise) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) of the turning model through sigma points."""
    mean, cov = np.ascontiguousarray(mean), np.ascontiguousarray(cov)
    return unscent(mean, cov, *_POINTS, dt, noise.turned)  # type: ignore[no-any-return]


def mixture(modes: Modes) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) mean and covariance of all models together."""
    mean, cov, _ = mix(*_plain(modes), _ALL)
    return mean[:, 0], cov[:, 0]


def _plain(modes: Modes) -> Modes:
    """In memory as the kernels want them."""
    return Modes(*(np.ascontiguousarray(values, dtype=float) for values in modes))


def ahead(
    modes: Modes, horizon: float, noise: Noise, steps: int = STEPS_AHEAD
) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) where tracks will be after `horizon` [s], models changing on the way."""
    return mixture(foretold(modes, horizon / steps, noise, steps))


def ahead_of(modes: Modes, once: BoolArray, horizon: float, noise: Noise) -> tuple[Array, Array]:
    """As `ahead`; of those who were seen `once` (n,) in one step."""
    one, many = _step(horizon, noise), _step(horizon / STEPS_AHEAD, noise)
    return ahead_each(  # type: ignore[no-any-return]
        tuple(_plain(modes)),
        once,
        (one.change, one.F, one.Q, horizon),
        (many.change, many.F, many.Q, horizon / STEPS_AHEAD),
        STEPS_AHEAD,
        _POINTS,
        noise.turned,
    )


def born(place: Array, measured: tuple[int, ...], noise: Array, speed: float) -> Modes:
    """Modes of tracks seen for the first time. place: (k, d) measured values; speed [m/s]."""
    k = len(place)
    mean = np.zeros((k, MODELS, STATE))
    mean[:, :, measured] = place[:, None]
    cov = np.empty((k, MODELS, STATE, STATE))
    cov[:] = _first(measured, tuple(noise.tolist()), speed)
    return Modes(mean, cov, np.full((k, MODELS), 1.0 / MODELS))


@lru_cache(maxsize=64)
def _first(measured: tuple[int, ...], noise: tuple[float, ...], speed: float) -> Array:
    """(11, 11) of who is seen for the first time."""
    deviations = np.array([1.0, 1.0, speed, speed, 1.0, 0.1, np.pi / 2, 0.5, 0.5, 0.5, 0.5])
    deviations[list(measured)] = noise
    return np.diag(deviations**2)
