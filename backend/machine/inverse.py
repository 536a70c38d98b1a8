"""Closed-form inverse kinematics of swing, boom, stick and bucket.

The bucket tip moves in a plane that turns with the swing and may stand a little off the swing axis
(ArmPlane.tip_lateral). Tilt and rotate joints, where there are any, stay at 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.model import Joint, Machine
from backend.machine.sun_map import from_sun_angles
from backend.spatial import transform
from backend.spatial.angles import wrap
from backend.spatial.types import Array, BoolArray


class Solution(NamedTuple):
    """q: (..., n) [rad], within the joints' turns; where not reachable, the nearest pose of the
    triangle. reachable: (...) the lengths allow it; within_limits: (...) q keeps the joint limits.
    """

    q: Array
    reachable: BoolArray
    within_limits: BoolArray


def inverse(machine: Machine, p_root: Array, attitude: Array | float, elbow: int = 1) -> Solution:
    """Joint values that put the bucket tip at p_root with the given bucket attitude.

    p_root: (..., 3) in the root frame [m], in front of the swing axis; attitude: (...) elevation of
    the line from bucket pivot to tip above the plane of swing [rad]; elbow: +1 stick pivot above
    the line from boom pivot to bucket pivot (the usual posture), -1 below it.
    """
    p = transform.apply(
        transform.inverse(machine.arm.T_root_swing), np.asarray(p_root, dtype=float)[..., None, :]
    )[..., 0, :]
    phi = np.asarray(attitude, dtype=float)
    l1, l2, l3, l4 = machine.sun.lengths

    # The tip is `forward` ahead of and tip_lateral beside the swing axis.
    square = p[..., 0] ** 2 + p[..., 1] ** 2 - machine.arm.tip_lateral**2
    forward = np.sqrt(np.maximum(square, 0.0))
    beside = np.arctan2(machine.arm.tip_lateral, forward)
    azimuth = np.arctan2(p[..., 1], p[..., 0]) - beside
    swing = machine.sun.azimuth_sign * (azimuth - machine.sun.azimuth_offset)

    # Bucket pivot seen from the boom pivot: Sun 2020, Eq. (17), (18), for any attitude phi.
    x = forward - l1 - l4 * np.cos(phi)
    z = p[..., 2] - machine.arm.pivot_height - l4 * np.sin(phi)
    # Law of cosines, Sun 2020, Eq. (20) and (19): stick = -elbow acos(c), boom = beta + elbow psi.
    c_stick = (x**2 + z**2 - l2**2 - l3**2) / (2.0 * l2 * l3)
    stick = -elbow * np.arccos(np.clip(c_stick, -1.0, 1.0))
    boom = np.arctan2(z, x) - np.arctan2(l3 * np.sin(stick), l2 + l3 * np.cos(stick))
    bucket = phi - boom - stick  # Sun 2020, Eq. (21)

    theta = np.stack(np.broadcast_arrays(boom, stick, bucket), axis=-1)
    q = np.zeros((*theta.shape[:-1], len(machine.joints)))
    q[..., 0] = swing
    q[..., 1:4] = from_sun_angles(machine, theta)
    for k, joint in enumerate(machine.joints[:4]):
        q[..., k] = _on_turn_of(joint, q[..., k])
    reachable = np.broadcast_to((square >= 0.0) & (np.abs(c_stick) <= 1.0), q.shape[:-1])
    slack = 1e-9
    inside = ((q >= machine.lower - slack) & (q <= machine.upper + slack)).all(axis=-1)
    return Solution(q, np.array(reachable), np.array(inside))


def _on_turn_of(joint: Joint, value: Array) -> Array:
    """The equal angle nearest to the middle of the joint's range; (-pi, pi] when continuous."""
    both = np.isfinite(joint.lower) and np.isfinite(joint.upper)
    middle = 0.5 * (joint.lower + joint.upper) if both else 0.0
    return np.asarray(middle + wrap(value - middle))
