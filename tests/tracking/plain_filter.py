"""The tracker's sums written plainly, all tracks and models at once: an oracle of the kernels."""

from __future__ import annotations

import numpy as np

from backend.spatial.angles import wrap
from backend.tracking.imm import Modes
from backend.tracking.motion import CT, CV, RANDOM, Noise, jolts, moved
from backend.tracking.records import PX, PY, PZ, STATE, TURN, VX, VY, VZ, YAW, Detections

MEAN = np.full(2 * STATE + 1, 0.5 / STATE)
MEAN[0] = 0.0
COV = MEAN.copy()
COV[0] = 2.0


def turned(x: np.ndarray, dt: float, noise: Noise) -> np.ndarray:
    """The constant turn of states (..., 11)."""
    out = x.copy()
    out[..., PZ] += dt * x[..., VZ]
    left = np.exp(-dt / noise.turned)
    angle = noise.turned * (1.0 - left) * x[..., TURN]
    small = np.abs(angle) < 1e-6
    safe = np.where(small, 1.0, angle)
    ahead = dt * np.where(small, 1.0 - angle**2 / 6.0, np.sin(safe) / safe)
    aside = dt * np.where(small, 0.5 * angle, (1.0 - np.cos(safe)) / safe)
    sine, cosine = np.sin(angle), np.cos(angle)
    vx, vy = x[..., VX], x[..., VY]
    out[..., PX] += ahead * vx - aside * vy
    out[..., PY] += aside * vx + ahead * vy
    out[..., VX] = cosine * vx - sine * vy
    out[..., VY] = sine * vx + cosine * vy
    out[..., YAW] += angle
    out[..., TURN] *= left
    return out


def mixed(modes: Modes, change: np.ndarray) -> Modes:
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


def unscented(
    mean: np.ndarray, cov: np.ndarray, dt: float, noise: Noise
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 11), (n, 11, 11) of the turning model through sigma points."""
    first = [VX, VY, TURN]  # the root begins with what turns
    order = np.array(first + [k for k in range(STATE) if k not in first])
    root = np.empty_like(cov)
    root[:, order] = np.linalg.cholesky(STATE * cov[:, order][:, :, order])  # (n, 11, 11)
    columns = np.swapaxes(root, 1, 2)
    points = np.concatenate(
        [mean[:, None], mean[:, None] + columns, mean[:, None] - columns], axis=1
    )
    there = turned(points, dt, noise)
    out = np.einsum("s,nsx->nx", MEAN, there)
    off = there - out[:, None]
    spread = np.einsum("s,nsx,nsy->nxy", COV, off, off)
    return out, 0.5 * (spread + np.swapaxes(spread, 1, 2))


def mixture(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """(n, 11), (n, 11, 11) mean and covariance of all models together."""
    mean = np.einsum("nr,nrx->nx", modes.mode, modes.mean)
    first = modes.mean[:, :1, YAW]
    turned = wrap(modes.mean[..., YAW] - first)
    mean[:, YAW] = first[:, 0] + (modes.mode * turned).sum(axis=1)
    off = modes.mean - mean[:, None]
    off[..., YAW] = wrap(off[..., YAW])
    cov = np.einsum("nr,nrxy->nxy", modes.mode, modes.cov)
    return mean, cov + np.einsum("nr,nrx,nry->nxy", modes.mode, off, off)


def compared(modes: Modes, seen: Detections) -> tuple[np.ndarray, ...]:
    """off, gain, S, likelihood, squared distance, log det S."""
    h = list(seen.measured)
    d = len(h)
    off = seen.values[None, None] - modes.mean[:, :, None, h]
    if YAW in h:
        at = h.index(YAW)
        off[..., at] = (off[..., at] + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    PH = modes.cov[..., h]  # (n, r, 11, d)
    S = PH[:, :, h] + np.diag(seen.noise**2)
    inverse = np.linalg.inv(S)
    squared = np.einsum("nrkx,nrxy,nrky->nrk", off, inverse, off)
    log_det = np.linalg.slogdet(S)[1]
    likelihood = np.exp(-0.5 * (squared + log_det[..., None] + d * np.log(2.0 * np.pi)))
    return off, PH @ inverse, S, likelihood, squared, log_det


def updated(
    modes: Modes,
    off: np.ndarray,
    K: np.ndarray,
    S: np.ndarray,
    likelihood: np.ndarray,
    share: np.ndarray,
) -> Modes:
    none = 1.0 - share.sum(axis=1)
    weight = modes.mode[:, :, None] * likelihood  # (n, r, k)
    total = np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
    joint = share[:, None] * weight / total  # of model and detection
    missed = none[:, None] * modes.mode
    mode = joint.sum(axis=2) + missed
    mode = np.maximum(mode, 1e-6)
    mode /= mode.sum(axis=1, keepdims=True)
    beta = joint / np.maximum(joint.sum(axis=2) + missed, 1e-300)[..., None]
    some = beta.sum(axis=2)  # (n, r) probability of having been detected, by model
    shift = np.einsum("nrk,nrkx->nrx", beta, off)
    mean = modes.mean + np.einsum("nrsx,nrx->nrs", K, shift)
    spread = np.einsum("nrk,nrkx,nrky->nrxy", beta, off, off)
    spread -= np.einsum("nrx,nry->nrxy", shift, shift)
    middle = spread - some[..., None, None] * S
    cov = modes.cov + K @ middle @ np.swapaxes(K, 2, 3)
    return Modes(mean, 0.5 * (cov + np.swapaxes(cov, 2, 3)), mode)
