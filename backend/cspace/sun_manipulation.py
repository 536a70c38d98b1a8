"""Sun 2020, Section 3.2: swing, reach and joints with B's end-point on A, Eqs. (12)-(28).

Azimuths are counter-clockwise from grid east. Sun's space S^2 of (14) is [0, 2 pi) x [0, d_B).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.cspace.sun import SunPose, d_double_prime, d_prime, inverse_kinematics
from backend.cspace.sun_driving import length_samples, offset_points
from backend.spatial.angles import wrap
from backend.spatial.types import Array, BoolArray

ROUNDING = 1e-12  # [rad], so that a query at the first or last sample counts as on the curve


def contact_vectors(a: SunPose, b: SunPose, s: Array, offset: float = 0.0) -> Array:
    """(k, 2) [m] from B's centre to points of A's arm, Sun 2020, step 2 after Eq. (11).

    s: (k,) along A's arm [m]; offset: 0 for the centre line, +eta or -eta for its sides [m].
    """
    return np.asarray(a.position - b.position + offset_points(a.yaw, s, offset))


def co_theta(vectors: Array) -> Array:
    """CO(theta_B) (...) in (-pi, pi] [rad] of contact vectors (..., 2) [m]. Sun 2020, Eq. (12).

    The paper prints atan of the quotient; only the two-argument form keeps the quadrant.
    """
    return np.asarray(np.arctan2(vectors[..., 1], vectors[..., 0]))


def co_d(vectors: Array, theta: Array) -> Array:
    """CO(d_B) (...) [m] of contact vectors (..., 2) [m] at theta (...) [rad]. Sun 2020, Eq. (13).

    Of the two printed quotients the one with the larger divisor.
    """
    c, s = np.cos(theta), np.sin(theta)
    by_x = np.abs(c) >= np.abs(s)
    return np.asarray(np.where(by_x, vectors[..., 0], vectors[..., 1]) / np.where(by_x, c, s))


def theta_d(a: SunPose, b: SunPose, eta: float, n: int, reach: float) -> tuple[Array, Array]:
    """(theta, d), each (k,), of CO_theta,d for B beside A. Sun 2020, Eq. (15).

    eta [m]; n + 1 samples of A's centre line from 0 to d_A - eta, as behind Fig. 10 (its sides at
    +-eta are not used). Only those within reach [m] of B's centre are kept, so 0 <= k <= n + 1, and
    both are empty when none is. theta [rad] rises, starts in [0, 2 pi) and runs on beyond 2 pi
    rather than jump.
    """
    vectors = contact_vectors(a, b, length_samples(max(a.d - eta, 0.0), n))
    theta = np.unwrap(co_theta(vectors))  # seen from B the line turns by less than pi
    d = co_d(vectors, theta)
    keep = d <= reach
    theta, d = theta[keep], d[keep]
    order = np.argsort(theta, kind="stable")
    theta, d = theta[order], d[order]
    if len(theta):
        theta = theta - theta[0] + full_turn(float(theta[0]))
    return theta, d


def contact_length(theta: Array, d: Array, azimuth: Array | float) -> Array:
    """Length (...) [m] at which B, pointing to azimuth (...) [rad], meets the curve theta, d (k,).

    theta [rad], d [m] of `theta_d`; inf outside the curve's angles. Between samples A's arm is
    straight, so the ray is cut with the chord, which is exact for the centre line.
    """
    azimuth = np.asarray(azimuth, dtype=float)
    if len(theta) == 0:
        return np.full(azimuth.shape, np.inf)
    middle, half = (theta[0] + theta[-1]) / 2.0, (theta[-1] - theta[0]) / 2.0
    t = wrap(azimuth - middle) + middle
    inside = np.abs(t - middle) <= half + ROUNDING
    if half < ROUNDING:  # A's arm points at B's centre
        return np.where(inside, d.min(), np.inf)
    if half > np.pi / 2.0 - ROUNDING:  # A's arm lies across B's centre
        return np.zeros(azimuth.shape)
    j = np.clip(np.searchsorted(theta, t, side="right") - 1, 0, max(len(theta) - 2, 0))
    k = np.minimum(j + 1, len(theta) - 1)
    # s u = p0 + lambda (p1 - p0), crossed with (p1 - p0).
    area = d[j] * d[k] * np.sin(theta[k] - theta[j])
    slope = d[k] * np.sin(theta[k] - t) - d[j] * np.sin(theta[j] - t)
    along = np.abs(slope) < ROUNDING  # two samples at one place, or a ray along the chord
    cut = np.where(along, np.minimum(d[j], d[k]), area / np.where(along, 1.0, slope))
    return np.asarray(np.where(inside, cut, np.inf))


def in_obstacle(theta: Array, d: Array, azimuth: Array | float, length: Array | float) -> BoolArray:
    """Whether the state (azimuth, length) (...) is in the obstacle image of S^2 (Figs. 9 and 21).

    theta, d: (k,) of `theta_d`; azimuth [rad], any turn; length [m]. The paper's image is all that
    lies beyond the curve: the arm crosses A from the contact outwards. The curve belongs to it.
    """
    return np.asarray(np.asarray(length, dtype=float) >= contact_length(theta, d, azimuth))


@dataclass(frozen=True)
class JointSets:
    """The sets of Sun 2020, Eqs. (22)-(28). Row i has beta_i, column j the j-th contact.

    theta: (k,) [rad]; beta: (m+1,) [rad]; d2: (k,) d'' [m]; boom, stick, bucket: (m+1, k) [rad],
    NaN where boom and stick cannot reach (JSON has no NaN: write null).
    """

    theta: Array
    beta: Array
    d2: Array
    boom: Array
    stick: Array
    bucket: Array

    @property
    def co3(self) -> Array:
        """CO_theta^3: (m+1, k, 3) boom, stick, bucket [rad]. Sun 2020, Eq. (27)."""
        return np.stack([self.boom, self.stick, self.bucket], axis=-1)

    @property
    def co4(self) -> Array:
        """CO_theta^4: (m+1, k, 4) swing azimuth, boom, stick, bucket [rad]. Sun 2020, Eq. (28)."""
        swing = np.broadcast_to(self.theta, self.boom.shape)
        return np.stack([swing, self.boom, self.stick, self.bucket], axis=-1)


def beta_samples(m: int) -> Array:
    """(m+1,) from 0 to pi/2, both included [rad]. Sun 2020, Eq. (22)."""
    if m < 1:
        raise ValueError(f"m must be at least 1, not {m}")
    return np.linspace(0.0, np.pi / 2.0, m + 1)


def set_points(beta: Array, d2: Array) -> tuple[Array, Array]:
    """x'', z'' (m+1, k) [m] from the boom's pivot. Sun 2020, Eq. (23).

    beta: (m+1,) [rad]; d2: (k,) d'' [m], taken as the distance from the pivot at every beta.
    """
    return np.outer(np.cos(beta), d2), np.outer(np.sin(beta), d2)


def joint_sets(theta: Array, d: Array, b: SunPose, eta: float, m: int, elbow: int = 1) -> JointSets:
    """The joint angles of B that reach the contacts theta [rad], d [m], each (k,). (22)-(26).

    eta [m], m as in the paper; elbow +1 up, -1 down. B's pitch enters by (17) and (24).
    """
    d2 = d_double_prime(d_prime(d, float(b.lengths[0]), b.pitch), float(b.lengths[3]), eta)
    beta = beta_samples(m)
    x, z = set_points(beta, d2)
    boom, stick, bucket = inverse_kinematics(b.lengths, x, z, b.pitch, elbow)  # Eqs. (24)-(26)
    return JointSets(theta, beta, d2, boom, stick, bucket)


def in_free_joints(co: Array, q: Array) -> bool:
    """Whether q (k,) [rad] is in the complement of CO_theta^3 or CO_theta^4, co (m+1, n, k) [rad].

    The sets are samples of a surface that has no inside: q belongs to the set when every joint is
    within the local sampling step of one sample. With k = 4 the swing comes first and is
    compared on the circle. Raises ValueError when k is not 3 or 4, or not the same for both.

    A member is a posture that reaches A's line at some swing with a level bucket; contact is
    decided in S^2 and by the distances, not here.
    """
    if co.shape[-1] not in (3, 4) or np.shape(q) != co.shape[-1:]:
        raise ValueError(f"q and co must both have 3 or 4 joints, not {np.shape(q)}, {co.shape}")
    gap = np.abs(co - np.asarray(q, dtype=float))
    if co.shape[-1] == 4:
        gap[..., 0] = np.abs(wrap(gap[..., 0]))
    reached = gap <= sampling_step(co) + ROUNDING  # cells without solution are NaN: never reached
    return not bool(reached.all(axis=-1).any())


def sampling_step(co: Array) -> Array:
    """(m+1, n, k) [rad]: largest change to a neighbour along i, plus the same along j.

    co: (m+1, n, k) [rad]; neighbours without a solution count as no change.
    """
    steps = np.zeros_like(co)
    for axis in (0, 1):
        change = np.nan_to_num(np.abs(np.diff(co, axis=axis)), nan=0.0)
        pad = [(0, 0)] * 3
        pad[axis] = (1, 1)
        padded = np.pad(change, pad)
        ahead = np.delete(padded, 0, axis=axis)
        behind = np.delete(padded, -1, axis=axis)
        steps += np.maximum(ahead, behind)
    return steps


def full_turn(angle: float) -> float:
    """The angle in [0, 2 pi) [rad]."""
    turned = float(angle % (2.0 * np.pi))
    return turned if turned < 2.0 * np.pi else 0.0  # -1e-20 rounds up to a whole turn
