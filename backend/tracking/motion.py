"""The three motion models: constant velocity, constant turn, and stopping or random motion.

CV and CT as in Rasul 2021, Eqs. (2)-(5), in the Cartesian form in which they are consistent: the
velocity itself turns by the turn rate, the box's yaw along with it. Beyond the paper the turn rate
fades, as people turn by some angle and go on: a second ahead, a circle would lead astray. The third
model, asked for in
that paper's outlook, lets the velocity fade and change at random (Ornstein-Uhlenbeck), as people
do who stop, start and turn on the spot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array
from backend.tracking.motion_kernel import turned
from backend.tracking.records import (
    HEIGHT,
    LENGTH,
    PX,
    PY,
    PZ,
    STATE,
    TURN,
    VX,
    VY,
    VZ,
    WIDTH,
    YAW,
)

CV, CT, RANDOM = range(3)
MODELS = 3


@dataclass(frozen=True)
class Noise:
    """Spectral densities of white noise by model (CV, CT, RANDOM): acceleration [m^2/s^3], turn
    rate [rad^2/s^3]; of all: vertical acceleration, yaw [rad^2/s], size [m^2/s]. fade: time in
    which the third model's velocity falls to 1/e [s]; turned: the same of the second model's turn
    rate, as nobody walks in circles; stay: mean time in one model [s].
    """

    acceleration: tuple[float, float, float] = (0.1, 0.1, 2.0)
    turn: tuple[float, float, float] = (0.1, 4.0, 0.1)
    vertical: float = 0.05
    yaw: float = 0.5
    size: float = 0.01
    fade: float = 12.0
    turned: float = 0.4
    stay: float = 2.0


def moved(model: int, x: Array, dt: float, noise: Noise) -> Array:
    """States (..., 11) after dt [s]."""
    if model == CT:
        rows = np.ascontiguousarray(x, dtype=float).reshape(-1, STATE)
        return np.asarray(turned(rows, dt, noise.turned)).reshape(x.shape)
    out = x.copy()
    if model == RANDOM:
        kept = np.exp(-dt / noise.fade)
        way = -noise.fade * np.expm1(-dt / noise.fade)
        out[..., PX] += way * x[..., VX]
        out[..., PY] += way * x[..., VY]
        out[..., PZ] += way * x[..., VZ]
        for speed in (VX, VY, VZ, TURN):
            out[..., speed] *= kept
        return out
    out[..., PX] += dt * x[..., VX]
    out[..., PY] += dt * x[..., VY]
    out[..., PZ] += dt * x[..., VZ]
    return out


def jolts(dt: float, noise: Noise) -> Array:
    """(r, 11, 11) covariance that each model's noise adds in dt [s]."""
    Q = np.zeros((MODELS, STATE, STATE))
    acceleration = np.array(noise.acceleration)
    for p, v, density in ((PX, VX, acceleration), (PY, VY, acceleration), (PZ, VZ, noise.vertical)):
        Q[:, p, p] = density * (dt**3 / 3.0)
        Q[:, p, v] = Q[:, v, p] = density * (dt**2 / 2.0)
        Q[:, v, v] = density * dt
    Q[:, TURN, TURN] = np.array(noise.turn) * dt
    Q[:, YAW, YAW] = noise.yaw * dt
    for size in (LENGTH, WIDTH, HEIGHT):
        Q[:, size, size] = noise.size * dt
    return Q


def switching(dt: float, noise: Noise) -> Array:
    """(r, r) probability of each model (column) after dt in another (row): a Markov chain."""
    stays = np.exp(-dt / noise.stay)
    return np.asarray(np.full((MODELS, MODELS), (1.0 - stays) / MODELS) + stays * np.eye(MODELS))
