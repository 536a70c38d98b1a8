"""The arm of Sun 2020: posture, forward kinematics (2), (3) and inverse kinematics (17)-(21).

Sun et al., "Creation of One Excavator as an Obstacle in C-Space for Collision Avoidance during
Remote Control of the Two Excavators Using Pose Sensors", Remote Sensing 12 (2020) 1122, Section 3.
Below, "Sun 2020" is this paper. A is the machine taken as an obstacle, B the one that avoids it;
every function takes either machine in either place.

The arm is a chain of four segments in a vertical plane: l1 from the swing axis to the boom's pivot,
then boom l2, stick l3, bucket l4. Angles raise when positive and add up along the chain (Fig. 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array, frozen


@dataclass(frozen=True)
class SunPose:
    """What Sun 2020 needs to know of one machine.

    position: (2,) of the swing centre, east and north in the site frame [m];
    yaw: azimuth of the arm, counter-clockwise from grid east [rad];
    pitch: of the first segment, positive raises the boom's pivot [rad];
    boom, stick, bucket: relative joint angles of Fig. 2 [rad]; lengths: (4,) l1..l4 [m], of
    which l1 is negative when the boom's pivot is behind the swing axis. Raises ValueError on wrong
    shapes, values that are not finite and l2..l4 <= 0.
    """

    position: Array
    yaw: float
    pitch: float
    boom: float
    stick: float
    bucket: float
    lengths: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position, (2,), "position"))
        object.__setattr__(self, "lengths", frozen(self.lengths, (4,), "lengths"))
        if (self.lengths[1:] <= 0).any():
            raise ValueError("lengths l2, l3 and l4 must be greater than 0")
        if not np.isfinite([self.yaw, self.pitch, self.boom, self.stick, self.bucket]).all():
            raise ValueError("yaw, pitch, boom, stick and bucket must be finite numbers")

    @property
    def angles(self) -> Array:
        """(4,) pitch, boom, stick, bucket [rad]."""
        return np.array([self.pitch, self.boom, self.stick, self.bucket])

    @property
    def d(self) -> float:
        """Swing axis to end-point, projected on the ground [m]. Sun 2020, Eq. (3)."""
        return float(projected_length(self.lengths, self.angles))


def end_point(lengths: Array, angles: Array) -> tuple[Array, Array]:
    """(x, z) (...) [m] of the end-point in the arm's plane, x away from the swing axis, z up.

    lengths: (4,) [m]; angles: (..., 4) pitch, boom, stick, bucket [rad].
    Sun 2020, below Eq. (2); the text repeats the last joint's index there, the sum is the chain's.
    """
    phi = np.cumsum(np.asarray(angles, dtype=float), axis=-1)
    return np.asarray(np.cos(phi) @ lengths), np.asarray(np.sin(phi) @ lengths)


def forward_kinematics(lengths: Array, angles: Array) -> Array:
    """T_base_end (..., 4, 4): x along the bucket, z up when the arm is level. Sun 2020, Eq. (2).

    lengths: (4,) [m]; angles: (..., 4) [rad]. Eq. (2) prints its sines with the opposite sign, a
    rotation that lowers the bucket while its own z_A rises; here both raise.
    """
    x, z = end_point(lengths, angles)
    phi = np.sum(np.asarray(angles, dtype=float), axis=-1)
    T = np.zeros((*x.shape, 4, 4))
    T[..., 0, 0] = T[..., 2, 2] = np.cos(phi)
    T[..., 0, 2], T[..., 2, 0] = -np.sin(phi), np.sin(phi)
    T[..., 1, 1] = T[..., 3, 3] = 1.0
    T[..., 0, 3], T[..., 2, 3] = x, z
    return T


def projected_length(lengths: Array, angles: Array) -> Array:
    """d (...) [m], never negative. Sun 2020, Eq. (3). lengths: (4,) [m]; angles: (..., 4) [rad]."""
    return np.abs(end_point(lengths, angles)[0])


def d_prime(d: Array | float, l1: float, pitch: float) -> Array:
    """d' (...) [m]: d without the first segment. Sun 2020, Eq. (17).

    d: (...) [m]; l1 [m]; pitch [rad].
    """
    return np.asarray(np.asarray(d, dtype=float) - l1 * np.cos(pitch))


def d_double_prime(d1: Array | float, l4: float, eta: float = 0.0) -> Array:
    """d'' (...) [m]: d' without the bucket, which the solution holds level. Sun 2020, Eq. (18).

    d1: (...) d' [m]; l4, eta [m]. Fig. 24 was computed with the bucket shortened by eta, so eta is
    subtracted from l4. The absolute value is the paper's: for a contact closer than the bucket is
    long it mirrors the point to the front of the boom's pivot.
    """
    return np.asarray(np.abs(np.asarray(d1, dtype=float) - (l4 - eta)))


def inverse_kinematics(
    lengths: Array, x: Array, z: Array, pitch: float = 0.0, elbow: int = 1
) -> tuple[Array, Array, Array]:
    """(boom, stick, bucket) (...) [rad] that put the bucket's pivot at (x, z). Sun 2020, (19)-(21).

    lengths: (4,) [m]; x, z: (...) x'', z'' from the boom's pivot [m]; pitch [rad]; elbow: +1 is up
    (boom above the line to the pivot, stick folds down), -1 down. NaN where boom and stick cannot
    reach. The equations leave the bucket parallel to the base (phi_B = 0).
    """
    if elbow not in (1, -1):
        raise ValueError(f"elbow must be 1 (up) or -1 (down), not {elbow}")
    _, l2, l3, _ = lengths
    r2 = np.asarray(x, dtype=float) ** 2 + np.asarray(z, dtype=float) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        psi = np.arccos((r2 + l2**2 - l3**2) / (2.0 * l2 * np.sqrt(r2)))  # below Eq. (19)
        c2 = (r2 - l2**2 - l3**2) / (2.0 * l2 * l3)  # below Eq. (20)
        s2 = -elbow * np.sqrt(1.0 - c2**2)
    beta = np.arctan2(z, x)
    boom = beta + elbow * psi - pitch  # Eq. (19)
    stick = np.where(np.isnan(psi), np.nan, np.arctan2(s2, c2))  # Eq. (20)
    return np.asarray(boom), np.asarray(stick), np.asarray(-boom - stick)  # Eq. (21)
