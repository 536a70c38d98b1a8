"""The end point's motion by steepest descent of penalties: Yamashita and Kikuuwe 2025, (14)-(26).

A reference to compare with. Corrected: (15) lacks P_0; (26f), (26g) need the transposes of D and of
its square; (26h)-(26j) are -sum X^2 / (2 T |X|); "otherwise" in (24af) is +inf; the height of an
obstacle belongs to the lower bound of z; r is held to its goal after k_F from above, too. D is a
sum over what came before and is never built. With these gradients the step printed is far too wide,
so that WIDTH is a thirtieth of it; the weight of the time, as printed, leaves t_F where it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from backend.spatial.types import Array

STEPS = 5000
"""Q of (26c)."""
PRINTED_WIDTH = 8e-4
WIDTH = PRINTED_WIDTH / 30.0
"""beta_1,0 of (26b)."""
PERIOD = 0.05
"""T [s], not given."""
_AFTER = 1.2  # N T, times the first t_F; N = 3000 in the paper
_EVERY = 5  # n_ite of (24af), (24ag)
_ALIKE = 1e-4  # epsilon of (26p), not given
W_A, W_TF, W_AT, W_VT, W_PT = 0.1, 0.001, 15.0, 15.0, 4.0
_BETA_2 = 1e-4

Critical = Callable[[Array, Array], tuple[Array, Array]]
"""Omega_c (N,) [rad/s] and a_cz (N,) [m/s^2] of places and accelerations (N, 3)."""
Inside = Callable[[Array], tuple[Array, Array]]
"""Of places (N, 3): r (N,) at which the arm there enters an obstacle, inf outside of all, and the
height z (N,) of its top, -inf outside of all [m]."""


class Problem(NamedTuple):
    """Columns are theta [rad], r and z [m]; theta counts from 0 at the start towards the goal.

    start, goal: (3,); speed, acceleration: (3,) highest; reach: least and greatest r; top: greatest
    z; lift: h_l above the line from start to goal half-way [m].
    """

    start: Array
    goal: Array
    speed: Array
    acceleration: Array
    reach: tuple[float, float]
    top: float
    lift: float
    critical: Critical
    inside: Inside


class Iteration(NamedTuple):
    """After one step: its number, t_F [s], and J_A, J_AT, J_VT, J_PT of (20), (24b)-(24d)."""

    number: int
    duration: float
    effort: float
    acceleration: float
    speed: float
    place: float


class Descent(NamedTuple):
    """place, speed, acceleration: (N, 3) at t (N,) [s]; duration: t_F; steps: that were taken."""

    t: Array
    place: Array
    speed: Array
    acceleration: Array
    duration: float
    steps: int

    def done(self) -> Descent:
        """Up to the first sample after t_F, which is held to the goal."""
        kept = int(self.duration / PERIOD) + 2
        cut = (self.t[:kept], self.place[:kept], self.speed[:kept], self.acceleration[:kept])
        return Descent(*cut, self.duration, self.steps)


class Held(NamedTuple):
    """What one step takes as given: k_F; Omega_c and a_cz (N,); whether obstacles are avoided
    towards the machine, and whether upwards.
    """

    last: int
    omega: Array
    lifted: Array
    radial: bool
    upward: bool


def initial(problem: Problem) -> Descent:
    """(26a): every coordinate by its own trapezoid, as fast as its limits allow."""
    wide = np.abs(problem.goal - problem.start)
    asked = list(zip(wide, problem.speed, problem.acceleration, strict=True))
    duration = max(sum(_trapezoid(*each)) for each in asked)
    t: Array = PERIOD * np.arange(max(8.0, np.ceil(_AFTER * duration / PERIOD)))
    V = np.stack([_speed(*each, t) for each in asked], axis=1)
    V *= (problem.goal - problem.start) / np.maximum(PERIOD * V.sum(axis=0), 1e-300)
    A = np.concatenate([np.diff(V, axis=0), np.zeros((1, 3))]) / PERIOD
    return Descent(t, problem.start + before(V), V, A, duration, 0)


def descent(
    problem: Problem,
    told: Callable[[Iteration], None] | None = None,
    width: float = WIDTH,
    steps: int = STEPS,
) -> Descent:
    """(26) from the trapezoids on; told: is called after every step."""
    t, P, V, A, duration, _ = initial(problem)
    radial = _sinks_deeper(problem, P)
    omega, lifted = problem.critical(P, A)
    history = np.full((6, 3), np.inf)
    q = 0
    for q in range(1, steps + 1):
        both = q % _EVERY == 0
        if both:
            omega, lifted = problem.critical(P, A)
        held = Held(int(duration / PERIOD), omega, lifted, radial or both, both or not radial)
        f_A, f_t, norms = slope(A, beyond(problem, A, V, P, held), held.last)
        A = A - width * (1.0 - (q - 1) / steps) * f_A
        duration = min(duration - _BETA_2 * f_t, float(t[-3]))
        V = before(A)
        P = problem.start + before(V)
        if told is not None:
            told(Iteration(q, duration, 0.5 * float((A**2).sum()), *map(float, norms)))
        history = np.concatenate([history[1:], norms[None]])
        if q > 5 and (np.abs(np.diff(history, axis=0)) <= _ALIKE * history[:-1]).all():
            break
    return Descent(t, P, V, A, duration, q)


def beyond(
    problem: Problem, A: Array, V: Array, P: Array, held: Held
) -> tuple[Array, Array, Array]:
    """A_P, V_P, P_P of (24e)-(24g), each (N, 3), with the limits of (24h)-(24ag)."""
    count = len(A)
    moving = (np.arange(count) <= held.last)[:, None]
    most = np.broadcast_to(problem.acceleration, A.shape).copy()
    most[:, 2] = np.minimum(most[:, 2], held.lifted)
    A_P = _over(A, np.where(moving, -problem.acceleration, 0.0), np.where(moving, most, 0.0))
    most = np.broadcast_to(problem.speed, V.shape).copy()
    most[:, 0] = np.minimum(most[:, 0], held.omega)
    V_P = _over(V, np.where(moving, -problem.speed, 0.0), np.where(moving, most, 0.0))
    entry, height = problem.inside(P)
    share = np.minimum(np.arange(count) / max(held.last, 1), 1.0)
    floor = problem.start[2] + share * (problem.goal[2] - problem.start[2])
    floor = floor + problem.lift * (1.0 - np.abs(2.0 * share - 1.0))  # (25)
    least, most = np.empty_like(P), np.empty_like(P)
    least[:, 0], most[:, 0] = 0.0, problem.goal[0]
    least[:, 1], most[:, 1] = problem.reach
    least[:, 2], most[:, 2] = floor, problem.top
    if held.radial:
        most[:, 1] = np.minimum(most[:, 1], entry)
    if held.upward:
        least[:, 2] = np.maximum(least[:, 2], height)
    P_P = _over(P, np.where(moving, least, problem.goal), np.where(moving, most, problem.goal))
    return A_P, V_P, P_P


def slope(A: Array, over: tuple[Array, Array, Array], last: int) -> tuple[Array, float, Array]:
    """(N, 3) and number: derivatives of J_p by A and t_F, (26d)-(26l); (3,): J_AT, J_VT, J_PT."""
    norms = np.array([np.linalg.norm(X) for X in over])
    f_A, f_V, f_P = (X / max(float(norm), 1e-300) for X, norm in zip(over, norms, strict=True))
    by_A = W_A * A + W_AT * f_A + after(W_VT * f_V + after(W_PT * f_P))
    row = [float((X[last + 1 : last + 2] ** 2).sum()) / (2.0 * PERIOD) for X in over]
    f_t = -np.array(row) / np.maximum(norms, 1e-300)
    return by_A, W_TF + float(np.array([W_AT, W_VT, W_PT]) @ f_t), norms


def before(X: Array) -> Array:
    """D X of (16): T times the sum of the rows before each."""
    out = np.zeros_like(X)
    np.cumsum(X[:-1], axis=0, out=out[1:])
    return np.asarray(PERIOD * out)


def after(X: Array) -> Array:
    """D^T X: T times the sum of the rows after each."""
    return before(X[::-1])[::-1]


def _sinks_deeper(problem: Problem, P: Array) -> bool:
    """Whether P (N, 3) lies deeper in obstacles from above than from the machine (h_max > d_max):
    then it gives way towards the machine.
    """
    entry, height = problem.inside(P)
    hit = np.isfinite(entry)
    deep = (height - P[:, 2])[hit].max(initial=0.0)
    return bool(deep > (P[:, 1] - entry)[hit].max(initial=0.0))


def _over(X: Array, least: Array, most: Array) -> Array:
    return np.asarray(np.maximum(X - most, 0.0) + np.minimum(X - least, 0.0))


def _trapezoid(distance: float, speed: float, acceleration: float) -> tuple[float, float]:
    """How long a trapezoid over `distance` rises, and until when from then it does not fall [s]."""
    rise = min(speed / acceleration, float(np.sqrt(distance / acceleration)))
    return rise, distance / max(acceleration * rise, 1e-300)


def _speed(distance: float, speed: float, acceleration: float, t: Array) -> Array:
    rise, kept = _trapezoid(distance, speed, acceleration)
    return np.asarray(acceleration * np.clip(np.minimum(t, rise + kept - t), 0.0, rise))
