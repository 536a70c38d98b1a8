"""The interacting multiple models of a track: mixing, prediction by sigma points, the mixture.

Mixing weights mu(i|j) = p_ij mu_i / sum_i p_ij mu_i (Blom and Bar-Shalom 1988; Rasul 2021,
Eqs. (11)-(13), whose sums run over the models i). Sigma points with the weights of Wan and van der
Merwe 2000: lambda = a^2 (n + k) - n.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.spatial.angles import wrap
from backend.spatial.types import Array
from backend.tracking.motion import CT, CV, MODELS, RANDOM, Noise, jolts, moved, switching
from backend.tracking.records import STATE, YAW

ALPHA, BETA, KAPPA = 1.0, 2.0, 0.0
_SPREAD = ALPHA**2 * (STATE + KAPPA)  # n + lambda
_MEAN = np.full(2 * STATE + 1, 0.5 / _SPREAD)
_MEAN[0] = (_SPREAD - STATE) / _SPREAD
_COV = _MEAN.copy()
_COV[0] += 1.0 - ALPHA**2 + BETA


class Modes(NamedTuple):
    """mean: (n, r, 11); cov: (n, r, 11, 11); mode: (n, r)."""

    mean: Array
    cov: Array
    mode: Array


def mixed(modes: Modes, change: Array) -> Modes:
    """Each model's prior from all models' posteriors. change: (r, r), see `motion.switching`."""
    joint = modes.mode[:, :, None] * change  # (n, i, j)
    prior = joint.sum(axis=1)
    weight = joint / np.maximum(prior[:, None, :], 1e-300)
    mean = np.einsum("nij,nix->njx", weight, modes.mean)
    first = modes.mean[:, :1, YAW]
    turned = wrap(modes.mean[..., YAW] - first)
    mean[..., YAW] = first + np.einsum("nij,ni->nj", weight, turned)
    off = modes.mean[:, :, None] - mean[:, None]  # (n, i, j, 11)
    off[..., YAW] = wrap(off[..., YAW])
    cov = np.einsum("nij,nixy->njxy", weight, modes.cov)
    cov += np.einsum("nij,nijx,nijy->njxy", weight, off, off)
    return Modes(mean, cov, prior)


def predicted(modes: Modes, dt: float, noise: Noise) -> Modes:
    """Each model's own prediction by dt [s], noise included; probabilities as they are.

    Two models are linear: sigma points would only repeat their exact result.
    """
    mean, cov = modes.mean.copy(), modes.cov.copy()
    for model in (CV, RANDOM):
        F = moved(model, np.eye(STATE), dt, noise).T
        mean[:, model] = modes.mean[:, model] @ F.T
        cov[:, model] = F @ modes.cov[:, model] @ F.T
    mean[:, CT], cov[:, CT] = unscented(modes.mean[:, CT], modes.cov[:, CT], dt, noise)
    return Modes(mean, cov + jolts(dt, noise), modes.mode)


def unscented(mean: Array, cov: Array, dt: float, noise: Noise) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) of the turning model through sigma points."""
    root = np.linalg.cholesky(_SPREAD * cov)  # (n, 11, 11)
    columns = np.swapaxes(root, 1, 2)
    points = np.concatenate(
        [mean[:, None], mean[:, None] + columns, mean[:, None] - columns], axis=1
    )
    there = moved(CT, points, dt, noise)
    out = np.einsum("s,nsx->nx", _MEAN, there)
    off = there - out[:, None]
    spread = np.einsum("s,nsx,nsy->nxy", _COV, off, off)
    return out, 0.5 * (spread + np.swapaxes(spread, 1, 2))


def mixture(modes: Modes) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) mean and covariance of all models together."""
    mean = np.einsum("nr,nrx->nx", modes.mode, modes.mean)
    first = modes.mean[:, :1, YAW]
    turned = wrap(modes.mean[..., YAW] - first)
    mean[:, YAW] = first[:, 0] + (modes.mode * turned).sum(axis=1)
    off = modes.mean - mean[:, None]
    off[..., YAW] = wrap(off[..., YAW])
    cov = np.einsum("nr,nrxy->nxy", modes.mode, modes.cov)
    return mean, cov + np.einsum("nr,nrx,nry->nxy", modes.mode, off, off)


def ahead(modes: Modes, horizon: float, noise: Noise, steps: int = 4) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) where tracks will be after `horizon` [s], models changing on the way."""
    dt = horizon / steps
    change = switching(dt, noise)
    for _ in range(steps):
        modes = predicted(mixed(modes, change), dt, noise)
    return mixture(modes)


def born(place: Array, measured: tuple[int, ...], noise: Array, speed: float) -> Modes:
    """Modes of tracks seen for the first time. place: (k, d) measured values; speed [m/s]."""
    k = len(place)
    mean, cov = np.zeros((k, STATE)), np.zeros((STATE, STATE))
    deviations = np.array([1.0, 1.0, speed, speed, 1.0, 0.1, np.pi / 2, 0.5, 0.5, 0.5, 0.5])
    deviations[list(measured)] = noise
    mean[:, list(measured)] = place
    cov[np.diag_indices(STATE)] = deviations**2
    return Modes(
        np.repeat(mean[:, None], MODELS, axis=1),
        np.broadcast_to(cov, (k, MODELS, STATE, STATE)).copy(),
        np.full((k, MODELS), 1.0 / MODELS),
    )
