"""How fast each joint may be so that neither moving nor braking tips the machine over.

A joint that moves at a rate v, one way, is tried alone on top of what the others do: it starts and
it brakes with what its drive can do, min(a, |v| / lag), now, after the delay, and where it comes to
a stand; meanwhile the others keep their rates or brake with it. All links count (`zmp`), not two
masses. Directions that bring the ZMP home keep a creeping speed whatever happens: nobody is trapped
with a machine about to tip.
"""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine
from backend.spatial.types import Array, BoolArray
from backend.stability.dynamics import down, rest_wrench, wrench_of
from backend.stability.masses import MassModel
from backend.stability.polygon import Polygon
from backend.stability.zmp import moments_of, share, zmp_of

CREEP = 0.1
"""Fraction of full speed that is always left to motions that bring the ZMP home."""
LEVELS = np.array([0.0, 0.15, 0.3, 0.5, 0.75, 1.0])
"""Fractions of full speed that are tried, beside the least at which a drive gives all it can;
between them the worst moment is taken as straight.
"""
_NUDGE = 1e-3  # of a joint, to see which way the ZMP goes [rad]


def allowed_fractions(
    machine: Machine,
    model: MassModel,
    support: Polygon,
    q: Array,
    rates: Array,
    delay: float,
    lag: float = 0.0,
    T_site_root: Array | None = None,
) -> Array:
    """(n, 2) fraction of full speed, 0..1, per joint and direction (negative, positive).

    support: already shrunk by the share that is to be kept; q, rates: (n,) [rad, rad/s]; delay:
    from asking for a stop to the first braking [s]; lag: of the velocity loops [s], 0 where a drive
    gives its full acceleration at once; T_site_root: (4, 4), level when None.
    """
    levels = _levels(machine, lag)
    worst = _worst(machine, model, support, q, rates, delay, lag, T_site_root, levels)
    # Up to the first level that fails, and from the one before it along a straight line.
    count = levels.shape[1]
    failed = np.concatenate([worst < 0.0, np.ones((*worst.shape[:2], 1), bool)], axis=2)
    first = failed.argmax(axis=2)
    before, after = np.maximum(first - 1, 0), np.minimum(first, count - 1)
    m0 = np.take_along_axis(worst, before[..., None], 2)[..., 0]
    m1 = np.take_along_axis(worst, after[..., None], 2)[..., 0]
    part = np.clip(m0 / np.where(m0 > m1, m0 - m1, np.inf), 0.0, 1.0)
    low, high = np.take_along_axis(levels, before, 1), np.take_along_axis(levels, after, 1)
    found = np.where(first == 0, 0.0, np.where(first == count, 1.0, low + (high - low) * part))
    home = brings_home(model, support, q, T_site_root)
    return np.asarray(np.where(home, np.maximum(found, CREEP), found))


def travel_fraction(
    machine: Machine,
    model: MassModel,
    support: Polygon,
    q: Array,
    rates: Array,
    lag: float = 0.0,
    T_site_root: Array | None = None,
) -> float:
    """Fraction of the tracks' full speed that they may start towards and brake from, either way.

    The arguments are those of `allowed_fractions`. A creeping speed is left: the slope may be what
    tips the machine, and driving off it the way out.
    """
    a, v = machine.tracks.max_acceleration, machine.tracks.max_speed
    pulls = _drive(np.outer(LEVELS[1:], [-v, v]), np.array(a), lag)
    shake = pulls[..., None] * np.array([1.0, 0.0, 0.0])
    g = down(T_site_root) - shake
    least = _moments(model, support, q, rates, np.zeros(len(q)), g).min(axis=(1, 2))
    good = np.logical_and.accumulate(least >= 0.0)
    return float(max(CREEP, np.where(good, LEVELS[1:], 0.0).max()))


def brings_home(
    model: MassModel, support: Polygon, q: Array, T_site_root: Array | None = None
) -> BoolArray:
    """(n, 2) whether a joint's motion, one way, moves the resting machine's ZMP from its edge."""
    q = np.asarray(q, dtype=float)
    n = len(q)
    nudge = _NUDGE * np.eye(n)
    tried = np.concatenate([q[None], q - nudge, q + nudge])
    left = share(zmp_of(rest_wrench(model, tried, T_site_root)), support)
    return np.asarray((left[1:] > left[0] + 1e-9).reshape(2, n).T)


def _levels(machine: Machine, lag: float) -> Array:
    """(n, levels) ascending, of each joint."""
    all_out = np.minimum(machine.max_acceleration * lag / machine.max_velocity, 1.0)
    each = np.tile(LEVELS, (len(machine.joints), 1))
    return np.sort(np.concatenate([each, all_out[:, None]], axis=1), axis=1)


def _worst(
    machine: Machine,
    model: MassModel,
    support: Polygon,
    q: Array,
    rates: Array,
    delay: float,
    lag: float,
    T_site_root: Array | None,
    levels: Array,
) -> Array:
    """(n, 2, levels) least moment of any edge [N m] with that joint at that level, that way."""
    n, count = levels.shape
    full, hardest = machine.max_velocity, machine.max_acceleration
    way = np.array([-1.0, 1.0])
    v = np.broadcast_to(np.asarray(rates, dtype=float), (n, 2, count, n)).copy()
    own = np.zeros_like(v)
    braking = -_drive(v, hardest, lag)
    for k in range(n):
        v[k, :, :, k] = way[:, None] * levels[k] * full[k]
        own[k, :, :, k] = _drive(v[k, :, :, k], hardest[k], lag)
        braking[k, :, :, k] = 0.0
    waited = np.clip(q + v * delay, machine.lower, machine.upper)
    stood = np.clip(waited + 0.5 * v * np.abs(v) / hardest, machine.lower, machine.upper)
    postures = np.stack([np.broadcast_to(q, v.shape), waited, stood])
    moving = np.stack([v, v, np.zeros_like(v)])
    nothing, still = np.zeros(3), np.zeros_like(moving)
    base = _moments(model, support, postures, moving, still, down(T_site_root))
    from_own = _moments(model, support, postures, still, own, nothing)
    from_others = _moments(model, support, postures, still, braking, nothing)
    least = base - np.abs(from_own) + np.minimum(from_others, 0.0)
    return np.asarray(least.min(axis=(0, -1)))


def _moments(
    model: MassModel, support: Polygon, q: Array, qd: Array, qdd: Array, g: Array
) -> Array:
    return moments_of(wrench_of(model, q, qd, qdd, g), support)


def _drive(v: Array, hardest: Array, lag: float) -> Array:
    """What a drive gives towards v: all it can, or less where its loop is slow [rad/s^2]."""
    if lag <= 0.0:
        return np.asarray(np.sign(v) * hardest)
    return np.asarray(np.sign(v) * np.minimum(hardest, np.abs(v) / lag))
