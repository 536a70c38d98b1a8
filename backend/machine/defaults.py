"""What the sidecar states about a machine, and what is assumed when it does not.

Every assumption is written to `notes`, which become Machine.assumptions.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from backend.errors import InputError
from backend.machine import bodies, kinematics
from backend.machine.chain import root_poses
from backend.machine.meshes import triangles_of
from backend.machine.model import PARTS, ROLES, Antenna, Eye, Joint, Link, Machine, Tracks
from backend.machine.roles import marks_end
from backend.machine.sidecar import PointOnLink, SelfCollision, Sidecar, TracksTable
from backend.machine.urdf import Description, UrdfLink
from backend.spatial import transform
from backend.spatial.types import Array, frozen


def _point(stated: PointOnLink, index: dict[str, int], file: str, field: str) -> tuple[int, Array]:
    if stated.link not in index:
        raise InputError(
            f"{file}: field '{field}.link' = '{stated.link}' is not a link of the robot; its links "
            f"are {', '.join(index)}."
        )
    return index[stated.link], frozen(stated.position, (3,), field)


def end_point(
    robot: Description,
    links: tuple[Link, ...],
    joints: tuple[Joint, ...],
    side: Sidecar,
    file: str,
    robot_file: Path,
    notes: list[str],
) -> tuple[int, Array]:
    """(index of the link, position in it) of the bucket tip."""
    index = {link.name: i for i, link in enumerate(links)}
    if side.end_point is not None:
        return _point(side.end_point, index, file, "end_point")
    tool = PARTS[ROLES.index(joints[-1].role) + 1]
    for i in range(1, len(links)):
        if marks_end(robot.joints[i - 1]) and links[i].part == tool:
            notes.append(f"the bucket tip is the origin of link '{links[i].name}'")
            return i, frozen((0.0, 0.0, 0.0), (3,), "end_point")
    # The tool's farthest point from the bucket's axis, in the arm plane; across it, the middle.
    tool_link, bucket = (
        next(i for i, link in enumerate(links) if link.joint == k) for k in (len(joints) - 1, 3)
    )
    T_root = root_poses(links, np.zeros(len(joints)))
    T_bucket_root = transform.inverse(T_root[bucket])
    points = np.concatenate(
        [
            transform.apply(T_bucket_root @ T_root[i], triangles.reshape(-1, 3))
            for i, link in enumerate(links)
            if link.part == tool
            for triangles in _surface(robot.links[i], link, robot_file)
        ]
    )
    axis = links[bucket].axis
    across = points @ axis
    flat = points - across[:, None] * axis
    tip = flat[np.argmax(np.linalg.norm(flat, axis=1))] + 0.5 * (across.min() + across.max()) * axis
    T_tool_bucket = transform.inverse(T_bucket_root @ T_root[tool_link])
    notes.append("the bucket tip is the bucket's farthest point from its pivot")
    return tool_link, frozen(transform.apply(T_tool_bucket, tip[None])[0], (3,), "end_point")


def _surface(stated: UrdfLink, link: Link, robot_file: Path) -> list[Array]:
    if link.visuals:
        return [visual.vertices[visual.faces] for visual in link.visuals]
    return [triangles_of(c, robot_file.parent, str(robot_file)) for c in stated.collisions]


def eye(machine: Machine, stated: PointOnLink | None, file: str) -> Eye | None:
    """The eyes in the cab where the sidecar states them."""
    if stated is None:
        return None
    index = {link.name: i for i, link in enumerate(machine.links)}
    return Eye(*_point(stated, index, file, "eye"))


def antenna(machine: Machine, stated: PointOnLink | None, file: str, notes: list[str]) -> Antenna:
    """Where the antenna stands."""
    index = {link.name: i for i, link in enumerate(machine.links)}
    if stated is not None:
        return Antenna(*_point(stated, index, file, "gnss"))
    upper = next(i for i, link in enumerate(machine.links) if link.joint == 0)
    own = [b for b, i in enumerate(machine.body_links) if i == upper]
    top = float(machine.bodies.take(np.array(own)).corners()[..., 2].max()) if own else 0.0
    notes.append("the GNSS antenna is taken to stand on the swing axis, on top of the upper body")
    return Antenna(upper, frozen((0.0, 0.0, top), (3,), "antenna"))


def tracks(machine: Machine, stated: TracksTable | None, notes: list[str]) -> Tracks:
    """The tracks; without a table their sizes are those of their bodies."""
    if stated is not None:
        return Tracks(**stated.model_dump())
    placed = kinematics.body_boxes(
        machine, kinematics.link_poses(machine, rest_posture(machine, {}))
    )
    own = [b for b, i in enumerate(machine.body_links) if machine.links[i].part == "tracks"]
    corners = placed.take(np.array(own)).corners().reshape(-1, 3)
    length, width = (float(v) for v in np.ptp(corners[:, :2], axis=0))
    shoe = 0.2 * width
    notes.append("tracks: sizes from their bodies, 1 m/s and 0.5 m/s^2 are assumed")
    return Tracks(length, width - shoe, shoe, 1.0, 0.5)


def rest_posture(machine: Machine, stated_deg: dict[str, float]) -> Array:
    """q (n,) [rad]: as stated, else the middle of the range, 0 for continuous joints."""
    both = np.isfinite(machine.lower) & np.isfinite(machine.upper)
    q = np.zeros(len(machine.joints))
    q[both] = 0.5 * (machine.lower[both] + machine.upper[both])
    for k, joint in enumerate(machine.joints):
        if joint.role in stated_deg:
            q[k] = np.radians(stated_deg[joint.role])
    return q


def self_pairs(
    machine: Machine, stated: SelfCollision, file: str, notes: list[str]
) -> tuple[tuple[int, int], ...]:
    """Pairs of bodies that count as self-collision."""
    postures = stated.rest_deg or ({},)
    resting = [
        kinematics.body_boxes(
            machine,
            kinematics.link_poses(
                machine, rest_posture(machine, {str(role): angle for role, angle in p.items()})
            ),
        )
        for p in postures
    ]
    parts = tuple(machine.part_of_body(b) for b in range(len(machine.body_names)))
    counted, touching = bodies.self_pairs(machine.body_names, parts, stated.exclude, resting, file)
    for i, j in touching:
        notes.append(
            f"{machine.body_names[i]} and {machine.body_names[j]} touch at rest; the pair does not "
            f"count as self-collision"
        )
    return counted
