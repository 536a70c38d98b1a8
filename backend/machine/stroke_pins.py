"""The sidecar's cylinders as strokes: their pins in the plane across the joint that they move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.errors import InputError
from backend.machine.chain import root_poses
from backend.machine.cylinders import Cylinder
from backend.machine.model import Joint, Link
from backend.machine.strokes import FourBar, Stroke, length_and_slope
from backend.spatial import transform
from backend.spatial.types import Array

SUFFIX = "_cylinder"
SAMPLES = 257
LEAST_SLOPE = 0.01  # [m/rad]: with less, 1 mm is more than 0.1 rad
PARALLEL = 1e-3  # sine of the most between hinge and joint axis of a four-bar
ALSO = {"stick": ("arm",)}


def strokes_of(
    links: tuple[Link, ...],
    joints: tuple[Joint, ...],
    cylinders: tuple[tuple[Cylinder, int], ...],
    side_file: str,
) -> tuple[Stroke, ...]:
    """The strokes of cylinders with the joints that move them (`sweeps.cylinders_of`).

    Where the linkage does not close, or the length turns round or all but stands still (0.01 m/rad)
    inside the joint's range, one stroke has two joint angles, or none: a cylinder that states
    bodies is then no stroke, and raises InputError only with `closed_length`; one that states only
    its pins always does.
    """
    T_root = root_poses(links, np.zeros(len(joints)))
    strokes: list[Stroke] = []
    for cylinder, joint in cylinders:
        stroke = _placed(cylinder, joint, links, joints[joint], T_root, side_file)
        if stroke is not None:
            where = f"{side_file}: cylinder {cylinder.name}"
            try:
                strokes.append(_tabulated(stroke, joints[joint], cylinder.closed_length, where))
            except InputError:
                if not cylinder.has_bodies or cylinder.closed_length is not None:
                    raise
    return tuple(strokes)


def _placed(
    cylinder: Cylinder,
    joint: int,
    links: tuple[Link, ...],
    moves: Joint,
    T_root: list[Array],
    side_file: str,
) -> Stroke | None:
    index = {link.name: i for i, link in enumerate(links)}
    child = next(i for i, link in enumerate(links) if link.joint == joint)
    barrel, rod = index[cylinder.barrel_link], index[cylinder.rod_link]
    barrel_moves = _is_moved(links, barrel, joint)
    if barrel_moves == _is_moved(links, rod, joint):
        return None  # only what carries its bodies is beyond the joint
    axis = np.asarray(links[child].axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    # At joint value 0 the child's frame is the joint's, seen from either side.
    T_joint = transform.inverse(T_root[child])
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across = across / np.linalg.norm(across)
    left = np.cross(axis, across)

    def placed(link: int, point: Array) -> tuple[complex, float]:
        p = T_joint @ T_root[link] @ np.append(point, 1.0)
        return complex(p[:3] @ across, p[:3] @ left), float(p[:3] @ axis)

    foot, foot_along = placed(barrel, cylinder.barrel_pivot)
    linkage, four_bar = cylinder.linkage, None
    if linkage is None:
        assert cylinder.rod_pivot is not None
        pin, head_along = placed(rod, cylinder.rod_pivot)
    else:
        T = T_joint @ T_root[index[cylinder.carried_by]]
        same = float(axis @ T[:3, :3] @ cylinder.hinge)
        if np.sqrt(max(0.0, 1.0 - same * same)) > PARALLEL:
            raise InputError(
                f"{side_file}: cylinder {cylinder.name}: hinge is not parallel to the axis of "
                f"{moves.name}; allowed is its direction or the opposite."
            )
        pin, _ = placed(rod, linkage.tie_pivot)
        pivot, head_along = placed(barrel, linkage.rocker_pivot)
        side = linkage.side * (1 if same > 0.0 else -1)
        four_bar = FourBar(pivot, linkage.rocker_length, linkage.tie_length, side)
    return Stroke(
        names=_names(cylinder, moves),
        joint=joint,
        foot=foot,
        pin=pin,
        turn=-1 if barrel_moves else 1,
        lateral=head_along - foot_along,
        four_bar=four_bar,
        closed_length=0.0,
    )


def _tabulated(stroke: Stroke, moves: Joint, closed: float | None, where: str) -> Stroke:
    """With the lengths over the joint's range. closed: as in `Cylinder.closed_length`."""
    q = np.linspace(moves.lower, moves.upper, SAMPLES)
    lengths, slopes = length_and_slope(stroke, q)
    if not (np.isfinite(lengths).all() and np.isfinite(slopes).all()):
        at = float(q[~(np.isfinite(lengths) & np.isfinite(slopes))][0])
        raise InputError(
            f"{where}: rocker and tie do not meet at {np.degrees(at):.1f} deg of "
            f"{moves.name}; they must over its whole range."
        )
    grows = 1.0 if slopes[SAMPLES // 2] > 0.0 else -1.0
    wrong = np.flatnonzero(grows * slopes < LEAST_SLOPE)
    if len(wrong):
        at = float(q[wrong[np.argmin(np.abs(slopes[wrong]))]])
        raise InputError(
            f"{where}: its length turns round or stands still at {np.degrees(at):.1f} deg "
            f"of {moves.name}; allowed is one that only grows or only shrinks between the joint's "
            f"limits, by at least {LEAST_SLOPE} m/rad."
        )
    order = slice(None) if grows > 0.0 else slice(None, None, -1)
    return replace(
        stroke,
        closed_length=float(lengths.min()) if closed is None else closed,
        angles=tuple(q[order].tolist()),
        lengths=tuple(lengths[order].tolist()),
    )


def _names(cylinder: Cylinder, moves: Joint) -> tuple[str, ...]:
    stems = moves.role, *ALSO.get(moves.role, ()), moves.name.removesuffix("_joint")
    names = [*(f"{stem}{SUFFIX}" for stem in stems)]
    names.append(f"{cylinder.name.removesuffix(SUFFIX)}{SUFFIX}")
    return tuple(dict.fromkeys(names))


def _is_moved(links: tuple[Link, ...], link: int, joint: int) -> bool:
    while link >= 0:
        if links[link].joint == joint:
            return True
        link = links[link].parent
    return False
