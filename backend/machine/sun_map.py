"""Joint values and the angles of Sun 2020: derived from the geometry, in both directions.

In the arm's plane a point has coordinates (forward, up): forward is horizontal, away from the swing
axis, up is the swing axis. A rotation about `forward x up` (to the right) raises.
"""

from __future__ import annotations

import numpy as np

from backend.errors import InputError
from backend.machine.chain import root_poses
from backend.machine.model import ArmPlane, Joint, Link, Machine, SunMap
from backend.spatial.angles import wrap
from backend.spatial.types import Array, frozen

_PARALLEL = 1e-3  # [rad] how far the arm's axes may be from parallel


def derive(
    links: tuple[Link, ...],
    joints: tuple[Joint, ...],
    end_link: int,
    end_point: Array,
    file: str,
) -> tuple[ArmPlane, SunMap]:
    """The arm's plane and the map to Sun's angles, from the geometry with all joints at 0.

    end_point: (3,) in the frame of links[end_link]. Raises InputError when boom, stick and bucket
    do not turn in one vertical plane.
    """
    T_root = root_poses(links, np.zeros(len(joints)))
    moved = {link.joint: i for i, link in enumerate(links) if link.joint >= 0}
    origins = [T_root[moved[k]][:3, 3] for k in range(4)]
    axes = [T_root[moved[k]][:3, :3] @ links[moved[k]].axis for k in range(4)]
    up = axes[0] if axes[0][2] >= 0.0 else -axes[0]
    _check_plane(up, axes, joints, file)
    T_swing = _level_frame(up, origins[0])
    tip = T_root[end_link][:3, :3] @ end_point + T_root[end_link][:3, 3]
    joint_mid = [_middle(joint) for joint in joints]

    forward = np.cross(axes[1], up)
    forward /= np.linalg.norm(forward)
    for _ in range(2):
        left = np.cross(up, forward)
        plane = np.stack([forward, up])
        points = np.array([plane @ (p - origins[0]) for p in (*origins[1:], tip)])
        signs = tuple(float(np.sign(-(axis @ left))) for axis in axes[1:4])
        steps = np.diff(points, axis=0)
        elevation = np.arctan2(steps[:, 1], steps[:, 0])
        offsets = np.diff(elevation, prepend=0.0)
        reference = np.array(signs) * joint_mid[1:4]
        offsets = wrap(offsets + reference) - reference
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        working = points[0, 0] + lengths @ np.cos(np.cumsum(offsets + reference))
        if working >= 0.0:
            break
        forward = -forward  # the arm works on the other side of the swing axis
    if lengths.min() < 1e-3:
        raise InputError(
            f"{file}: the pivots of boom, stick, bucket and the bucket tip must be apart; "
            f"their distances are {np.round(lengths, 4).tolist()} m."
        )
    offsets[np.abs(offsets) < 1e-12] = 0.0
    azimuth = float(np.arctan2(forward @ T_swing[:3, 1], forward @ T_swing[:3, 0]))
    sun = SunMap(
        lengths=tuple(round(float(v), 12) for v in (points[0, 0], *lengths)),  # type: ignore[arg-type]
        signs=signs,  # type: ignore[arg-type]
        offsets=tuple(float(o) for o in offsets),  # type: ignore[arg-type]
        azimuth_sign=float(np.sign(axes[0] @ up)),
        azimuth_offset=0.0 if abs(azimuth) < 1e-12 else azimuth,
    )
    height, beside = float(points[0, 1]), float(left @ (tip - origins[0]))
    return ArmPlane(frozen(T_swing, (4, 4), "T_root_swing"), height, beside), sun


def sun_angles(machine: Machine, q: Array) -> Array:
    """Sun's boom, stick and bucket angles (..., 3) [rad] of q (..., n); each relative to the link
    before it, positive raises; the bucket's elevation is their sum (Sun 2020, Fig. 2)."""
    arm = np.asarray(q, dtype=float)[..., 1:4]
    return np.asarray(arm * machine.sun.signs + machine.sun.offsets)


def from_sun_angles(machine: Machine, theta: Array) -> Array:
    """Joint values of boom, stick, bucket (..., 3) [rad] of Sun's angles (..., 3) [rad]."""
    relative = np.asarray(theta, dtype=float) - machine.sun.offsets
    return np.asarray(relative * machine.sun.signs)


def _middle(joint: Joint) -> float:
    both = np.isfinite(joint.lower) and np.isfinite(joint.upper)
    return 0.5 * (joint.lower + joint.upper) if both else 0.0


def _level_frame(up: Array, origin: Array) -> Array:
    x = np.array([1.0, 0.0, 0.0])
    x = x - (x @ up) * up
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(up, x), up], axis=1)
    T[:3, 3] = origin
    return T


def _check_plane(up: Array, axes: list[Array], joints: tuple[Joint, ...], file: str) -> None:
    if up[2] < 0.5:
        raise InputError(
            f"{file}: joint '{joints[0].name}': a swing axis must point up or down in the root "
            f"frame, not along {np.round(axes[0], 3).tolist()}."
        )
    if abs(axes[1] @ up) > _PARALLEL:
        raise InputError(
            f"{file}: joint '{joints[1].name}': the boom's axis must be perpendicular to the swing "
            f"axis; it is {np.round(axes[1], 3).tolist()} in the root frame."
        )
    for k in (2, 3):
        if np.linalg.norm(np.cross(axes[k], axes[1])) > _PARALLEL:
            raise InputError(
                f"{file}: joint '{joints[k].name}': the axes of boom, stick and bucket must be "
                f"parallel; '{joints[1].name}' has {np.round(axes[1], 3).tolist()}, this has "
                f"{np.round(axes[k], 3).tolist()} in the root frame."
            )
