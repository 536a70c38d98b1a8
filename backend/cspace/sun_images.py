"""All of Sun's sets for one ordered pair, with the state they belong to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.cspace.sun import SunPose
from backend.cspace.sun_driving import co_xy, warning_zone, zone_distance
from backend.cspace.sun_manipulation import (
    JointSets,
    full_turn,
    in_free_joints,
    in_obstacle,
    joint_sets,
    theta_d,
)
from backend.spatial.types import Array


@dataclass(frozen=True)
class SunState:
    """B now. theta: arm azimuth in [0, 2 pi) [rad]; d [m]; boom, stick, bucket [rad].

    collides: in the obstacle image of S^2. in_zone: its centre is in the warning zone;
    zone_distance: how far outside that zone, negative inside [m]. in_joint_set: a sample of
    CO_theta^3 is at hand (a projection over all swings, so this alone is no contact).
    """

    theta: float
    d: float
    boom: float
    stick: float
    bucket: float
    collides: bool
    in_zone: bool
    zone_distance: float
    in_joint_set: bool


@dataclass(frozen=True)
class SunImage:
    """Obstacles that A is to B ("B must avoid A"), Sun 2020, Eqs. (10)-(28).

    eta [m], m, n: the paper's parameters; b_max_reach [m] radius of B's largest workspace (the
    current one has radius current.d). zone: (k, 2) outline of the warning zone, site frame [m];
    x, y: (2, m+1, n+1) of Eq. (10), site frame [m]; theta [rad], d [m]: (k,) of Eq. (15), empty out
    of reach; joints: (m+1, k) sets of Eqs. (22)-(28).
    """

    a: SunPose
    b: SunPose
    eta: float
    m: int
    n: int
    b_max_reach: float
    zone: Array
    x: Array
    y: Array
    theta: Array
    d: Array
    joints: JointSets
    current: SunState


def sun_image(
    a: SunPose, b: SunPose, b_max_reach: float, eta: float, m: int, n: int, elbow: int = 1
) -> SunImage:
    """Every set of Sun 2020 for B beside A. b_max_reach, eta [m]; m, n >= 1; elbow +1 up, -1 down.

    For "A must avoid B" swap the machines. Raises ValueError on m, n < 1 or a negative eta.
    """
    theta, d = theta_d(a, b, eta, n, b_max_reach)
    joints = joint_sets(theta, d, b, eta, m, elbow)
    x, y = co_xy(a, b, eta, m, n)
    # The verdict uses the whole line, so that no gap opens between the last sample kept and reach.
    whole = theta_d(a, b, eta, n, np.inf)
    gap = float(zone_distance(a, b.d, eta, b.position))
    q = np.array([b.boom, b.stick, b.bucket])
    current = SunState(
        theta=full_turn(b.yaw),
        d=b.d,
        boom=float(b.boom),
        stick=float(b.stick),
        bucket=float(b.bucket),
        collides=bool(in_obstacle(*whole, b.yaw, b.d)),
        in_zone=gap <= 0.0,
        zone_distance=gap,
        in_joint_set=len(theta) > 0 and not in_free_joints(joints.co3, q),
    )
    zone = warning_zone(a, b.d, eta)
    arrays = (zone, x, y, theta, d, joints.beta, joints.d2)
    for array in (*arrays, joints.boom, joints.stick, joints.bucket):
        array.setflags(write=False)
    return SunImage(a, b, eta, m, n, b_max_reach, zone, x, y, theta, d, joints, current)
