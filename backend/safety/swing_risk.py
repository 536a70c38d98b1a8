"""How soon and how near a swing comes to somebody: time to collision, warning index, level.

Rasul 2021, Sections 4.1-4.3 (Eqs. (28)-(35)), with the relations that its print lost: both
directions of the swing count, acceleration ends at the greatest swing speed, and an object's own
motion about the swing axis counts. What cannot be computed is an emergency.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from backend.spatial.angles import wrap
from backend.spatial.types import Array, BoolArray, IntArray

_LARGEST = 1e9
"""What is not smaller than this is no place, speed or length on a site: it is not known."""


class Risk(IntEnum):
    """SAFE, WARNING: slow down and sound, EMERGENCY: stop the dangerous direction."""

    SAFE = 0
    WARNING = 1
    EMERGENCY = 2


@dataclass(frozen=True)
class Boundaries:
    """The levels' boundaries on the TTC-x plane (Rasul 2021, Fig. 8, where only "stop at x = 1" and
    "brake when TTC < 1 s" are printed): emergency where x or TTC [s] is at most the first, warning
    where it is at most the second.
    """

    index: tuple[float, float] = (1.0, 2.0)
    ttc: tuple[float, float] = (1.0, 3.0)


@dataclass(frozen=True)
class Swing:
    """The swing of one machine: angle of the body about its axis [rad], rate [rad/s], acceleration
    [rad/s^2], fastest rate [rad/s] and strongest deceleration [rad/s^2] that it can have.
    """

    angle: float
    rate: float
    acceleration: float
    fastest: float
    deceleration: float

    @property
    def known(self) -> bool:
        """Whether all of it is a number: without, nothing is safe."""
        return bool(_sane(np.array([*vars(self).values()])).all())


def time_to_collision(swing: Swing, place: Array, velocity: Array, clearance: Array) -> Array:
    """(k,) [s] until the swung body's middle line comes within `clearance` of the objects; 0 where
    it is within now, infinite where it never comes.

    place, velocity: (k, 2) about the swing axis [m, m/s]; clearance: (k,) half the body's width and
    the object's radius, along the circle through the object [m].
    """
    place, velocity = np.asarray(place, dtype=float), np.asarray(velocity, dtype=float)
    clearance = np.asarray(clearance, dtype=float)
    if not swing.known:
        return np.zeros(len(place))
    known = _sane(place).all(axis=1) & _sane(velocity).all(axis=1) & _sane(clearance)
    place, velocity = np.where(known[:, None], place, 0.0), np.where(known[:, None], velocity, 0.0)
    far = np.maximum(np.linalg.norm(place, axis=1), 1e-9)
    turning = (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0]) / far**2
    wide = np.where(known, clearance, 0.0) / far
    delta = np.arctan2(place[:, 1], place[:, 0]) - swing.angle
    best = np.full(len(place), np.inf)
    for side in (1.0, -1.0):
        gap = np.mod(side * delta, 2.0 * np.pi) - wide
        w, a = side * (swing.rate - turning), side * swing.acceleration
        best = np.minimum(best, reached(gap, w, a, speeding(swing)))
    overlapping = np.abs(wrap(delta)) <= wide
    return np.where(overlapping | ~known, 0.0, best)


def warning_index(
    swing: Swing, place: Array, radius: Array, clearance: Array, uncertainty: float, keep: float
) -> Array:
    """(k,) x = (c - c_sm) / c_br: how many braking distances are left beyond the safety clearance.

    c: arc between body and object; c_br: arc that the swing needs to stop; c_sm: arc of the
    object's radius (k,), of `uncertainty` of sensors and control, and of `keep` [m]. Infinite while
    nothing needs to brake and more than the safety clearance is left, minus infinite within it.
    """
    place, radius = np.asarray(place, dtype=float), np.asarray(radius, dtype=float)
    clearance = np.asarray(clearance, dtype=float)
    if not (swing.known and _sane(np.array([uncertainty, keep])).all()):
        return np.full(len(place), -np.inf)
    known = _sane(place).all(axis=1) & _sane(radius) & _sane(clearance)
    place = np.where(known[:, None], place, 0.0)
    far = np.maximum(np.linalg.norm(place, axis=1), 1e-9)
    delta = wrap(np.arctan2(place[:, 1], place[:, 0]) - swing.angle)
    c = far * np.abs(delta) - np.where(known, clearance, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        braking = np.float64(swing.rate**2) * far / (2.0 * swing.deceleration)
    sine = (np.where(known, radius, 0.0) + uncertainty + keep) / far
    safety = np.where(sine < 1.0, far * np.arcsin(np.minimum(sine, 1.0)), np.inf)
    left = c - safety
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.where(braking > 0.0, left / braking, np.where(left > 0.0, np.inf, -np.inf))
    return np.where(np.isnan(x) | ~known, -np.inf, x)


def risk(ttc: Array, index: Array, boundaries: Boundaries | None = None) -> IntArray:
    """(k,) `Risk` of each; not a number is an emergency."""
    b = boundaries or Boundaries()
    emergency = ~((index > b.index[0]) & (ttc > b.ttc[0]))
    warning = ~((index > b.index[1]) & (ttc > b.ttc[1]))
    return np.where(emergency, Risk.EMERGENCY, np.where(warning, Risk.WARNING, Risk.SAFE))


def _sane(values: Array) -> BoolArray:
    """Whether each is a number, and one of this world."""
    return np.asarray(np.abs(values) < _LARGEST)


def speeding(swing: Swing) -> float:
    """t_m: how long the swing can accelerate as it does now [s]."""
    a = swing.acceleration
    if a == 0.0:
        return np.inf
    return float(max((np.sign(a) * swing.fastest - swing.rate) / a, 0.0))


def reached(gap: Array, w: Array, a: float, speeding: float) -> Array:
    """(k,) least t >= 0 at which w t + a t^2 / 2, at constant speed from `speeding` on, is gap."""
    if a == 0.0 or speeding == 0.0:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(w > 0.0, np.maximum(gap, 0.0) / w, np.inf)
    root = w**2 + 2.0 * a * gap
    with np.errstate(divide="ignore", invalid="ignore"):
        # The root that keeps its digits whatever the sign of w.
        q = w + np.where(w >= 0.0, 1.0, -1.0) * np.sqrt(np.maximum(root, 0.0))
        both = np.stack([2.0 * gap / q, -q / a])
    both = np.where((both >= 0.0) & np.isfinite(both) & (root >= 0.0), both, np.inf)
    soon = both.min(axis=0)
    at_full = w + a * speeding
    done = w * speeding + 0.5 * a * speeding**2
    with np.errstate(divide="ignore", invalid="ignore"):
        late = np.where(at_full > 0.0, speeding + (gap - done) / at_full, np.inf)
    late = np.where(late >= speeding, late, np.inf)
    return np.where(soon <= speeding, soon, late)
