"""A machine's bodies about its swing axis, as vectors in the arm's plane.

In that plane every corner of a body is a sum of vectors of fixed lengths, each at the sum of the
joint angles up to its own (Sun 2020, Fig. 2; Rasul 2021, Eq. (26)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backend.machine.chain import root_poses
from backend.machine.model import PARTS, Machine
from backend.machine.outline_kernel import convex_hull
from backend.spatial.identity import ByIdentity
from backend.spatial.rotation import about_axis
from backend.spatial.types import Array, IntArray

_ARM = 3  # boom, stick, bucket
_ROUNDING = 1e-9  # [m]
_STEP = np.pi / 16  # of an arc that a polygon stands around


@dataclass(frozen=True)
class Extent:
    """Groups, g of them, are the boom, the stick, the bucket, and, where they exist, what is tilted
    and rotated under it, swept over all its tilts and rotations.

    pivots: (3, 2) length and angle [m, rad] of the vectors to the pivots of boom, stick and bucket,
    each from the one before, the first from the swing joint's origin; vectors: (m, 2) likewise of
    the groups' hulls, from their own pivots; starts: (g + 1,) where each group's vectors begin;
    chain: (g,) which sum of joint angles turns a group, 0 boom, 1 boom and stick, 2 all three;
    lateral: (g, 2) to the right (negative) and left of the plane [m]; slack: what groups count as
    larger on every side [m]; body: radius of tracks and upper body, tail: of the upper body [m];
    height: of both, from the swing joint's origin, up or down [m]; lower, upper:
    (4,) of swing, boom, stick and bucket [rad]; signs: (3,) which way boom, stick and bucket raise.
    """

    pivots: Array
    vectors: Array
    starts: IntArray
    chain: IntArray
    lateral: Array
    slack: float
    body: float
    tail: float
    height: float
    lower: Array
    upper: Array
    signs: Array


def extent_of(machine: Machine) -> Extent:
    """Computed once for each machine."""
    return _extent(ByIdentity(machine))


@lru_cache(maxsize=64)
def _extent(key: ByIdentity[Machine]) -> Extent:
    machine = key.value
    T_root = root_poses(machine.links, np.zeros(len(machine.joints)))
    x, y, up = machine.arm.T_root_swing[:3, :3].T
    azimuth = machine.sun.azimuth_offset
    forward = np.cos(azimuth) * x + np.sin(azimuth) * y
    axes = np.stack([forward, up, np.cross(up, forward)])
    origin = machine.arm.T_root_swing[:3, 3]
    corners = np.array(
        [
            box @ T_root[link][:3, :3].T + T_root[link][:3, 3]
            for box, link in zip(machine.body_corners, machine.body_links, strict=True)
        ]
    )
    joint = np.array([PARTS.index(machine.links[link].part) - 1 for link in machine.body_links])
    still = (corners[joint <= 0] - origin) @ axes.T
    radius = np.hypot(still[..., 0], still[..., 2]).max(axis=1)
    pivots = np.array([axes @ (T_root[i][:3, 3] - origin) for i in machine.joint_links[1:4]])
    slack = _ROUNDING + machine.bounding_radius * _crooked(machine, T_root, up)
    groups = [(k, corners[joint == k].reshape(-1, 3)) for k in range(1, _ARM + 1)]
    groups.append((_ARM, _swept(machine, T_root, corners, joint)))
    vectors, starts, chain, lateral = [], [0], [], []
    for k, points in groups:
        if not len(points):
            continue
        placed = (points - origin) @ axes.T
        flat = placed[:, :2] - pivots[k - 1, :2]
        hull = convex_hull(flat, np.lexsort((flat[:, 1], flat[:, 0])))
        vectors.append(hull)
        starts.append(starts[-1] + len(hull))
        chain.append(k - 1)
        lateral.append((placed[:, 2].min(), placed[:, 2].max()))
    return Extent(
        _polar(np.diff(pivots[:, :2], axis=0, prepend=0.0)),
        _polar(np.concatenate(vectors)),
        np.array(starts),
        np.array(chain),
        np.array(lateral),
        slack,
        float(radius.max()) + slack,
        float(radius[joint[joint <= 0] == 0].max()) + slack,
        float(np.abs(still[..., 1]).max()) + slack,
        machine.lower[: _ARM + 1],
        machine.upper[: _ARM + 1],
        np.array(machine.sun.signs),
    )


def _polar(vectors: Array) -> Array:
    return np.stack(
        [np.hypot(vectors[:, 0], vectors[:, 1]), np.arctan2(vectors[:, 1], vectors[:, 0])], axis=1
    )


def _swept(machine: Machine, T_root: list[Array], corners: Array, joint: IntArray) -> Array:
    """(p, 3) points whose hull contains all bodies beyond the bucket, however they are tilted and
    rotated, in the root frame with all other joints at 0 [m].
    """
    points = np.zeros((0, 3))
    for k in range(len(machine.joints) - 1, _ARM, -1):
        points = np.concatenate([points, corners[joint == k].reshape(-1, 3)])
        one, T = machine.joints[k], T_root[machine.joint_links[k]]
        low, high = (-np.pi, np.pi) if one.continuous else (one.lower, one.upper)
        count = int(np.ceil((high - low) / _STEP))
        half = 0.5 * (high - low) / count
        # Two neighbours' tangents meet at a middle, that much farther from the axis.
        angles = np.concatenate([[low, high], low + half * (2.0 * np.arange(count) + 1.0)])
        wide = np.where(np.arange(count + 2) < 2, 1.0, 1.0 / np.cos(half))
        axis = T[:3, :3] @ machine.joint_axes[k]
        off = points - T[:3, 3]
        along = (off @ axis)[:, None] * axis
        turned = np.einsum("sij,pj->spi", about_axis(axis, angles), off - along)
        points = (T[:3, 3] + along + wide[:, None, None] * turned).reshape(-1, 3)
    return points


def _crooked(machine: Machine, T_root: list[Array], up: Array) -> float:
    """How far the arm's axes are from one plane's [rad]; a description may be off a little."""
    boom, stick, bucket = (
        T_root[machine.joint_links[k]][:3, :3] @ machine.joint_axes[k] for k in range(1, _ARM + 1)
    )
    apart = sum(float(np.linalg.norm(np.cross(boom, axis))) for axis in (stick, bucket))
    return abs(float(boom @ up)) + apart
