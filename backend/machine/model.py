"""The description of one excavator, as every room reads it.

Frames: `root` is the URDF's root link, on the ground under the swing centre, x along the tracks.
Joint values are the URDF's own. Actuated joints come in the order of `ROLES`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from backend.machine.strokes import Stroke
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray

ROLES = ("swing", "boom", "stick", "bucket", "tilt", "rotate")
"""Joint roles in the order of every joint vector; the first four are always there."""

PARTS = ("tracks", "upper", "boom", "stick", "bucket", "tilt", "rotate")
"""PARTS[k] is what joint k-1 moves; fixed links belong to the part that carries them."""


@dataclass(frozen=True)
class Joint:
    """One actuated revolute joint. Angles [rad], rates [rad/s], accelerations [rad/s^2]."""

    role: str
    name: str  # the URDF's
    lower: float  # -inf when continuous
    upper: float  # +inf when continuous
    max_velocity: float
    max_acceleration: float
    max_torque: float = math.inf  # where none is stated [N m]

    @property
    def continuous(self) -> bool:
        return not np.isfinite(self.lower) and not np.isfinite(self.upper)


@dataclass(frozen=True)
class Visual:
    """A coloured triangle mesh in its link's frame. vertices: (n, 3) [m]; faces: (m, 3) indices."""

    vertices: Array
    faces: AnyArray
    color: tuple[int, int, int]


@dataclass(frozen=True)
class Inertia:
    """mass [kg]; com: (3,) in the link frame [m]; tensor: (3, 3) about the com [kg m^2]."""

    mass: float
    com: Array
    tensor: Array


@dataclass(frozen=True)
class Link:
    """A link; links are listed parents first.

    T_parent_joint: (4, 4) of the joint frame at joint value 0; axis: (3,) unit, in the joint frame.
    joint: index into Machine.joints, or -1 when rigidly attached.
    """

    name: str  # the URDF's
    part: str  # one of PARTS
    parent: int  # -1 for the root
    T_parent_joint: Array
    axis: Array
    joint: int
    inertia: Inertia | None
    visuals: tuple[Visual, ...] = ()


@dataclass(frozen=True)
class SunMap:
    """Joint values to the angles of Sun 2020, Fig. 2: positive raises, cumulative along the chain.

    lengths: (l1, l2, l3, l4) [m]: swing axis to boom pivot (horizontal), boom, stick, bucket.
    theta_k = sign_k * q_k + offset_k for boom, stick, bucket. azimuth_offset [rad]: the arm's
    azimuth in the upper body's frame (0 for most machines).
    """

    lengths: tuple[float, float, float, float]
    signs: tuple[float, float, float]
    offsets: tuple[float, float, float]
    azimuth_sign: float = 1.0
    azimuth_offset: float = 0.0


@dataclass(frozen=True)
class ArmPlane:
    """Where the arm's plane stands, for closed-form kinematics.

    T_root_swing: (4, 4) at the swing joint's origin: z along the swing axis upwards, x the root's x
    made perpendicular to it. pivot_height: boom pivot above that origin along z [m].
    tip_lateral: bucket tip left of the plane through the swing axis [m]; constant, as the axes of
    boom, stick and bucket are parallel.
    """

    T_root_swing: Array
    pivot_height: float
    tip_lateral: float


@dataclass(frozen=True)
class Antenna:
    """A GNSS antenna. link: index into Machine.links; position: (3,) in that link's frame [m]."""

    link: int
    position: Array


@dataclass(frozen=True)
class Eye:
    """Where the eyes of who sits in the cab are, looking along the arm's plane. link: index into
    Machine.links; position: (3,) in that link's frame [m].
    """

    link: int
    position: Array


@dataclass(frozen=True)
class LidarMount:
    """A LiDAR and where it is mounted. name: of the frame that its clouds are in; link: index into
    Machine.links; T_link_sensor: (4, 4), z is the axis it spins about; elevations: (b,) of its
    beams [rad].
    """

    name: str
    link: int
    T_link_sensor: Array
    elevations: Array


@dataclass(frozen=True)
class Tracks:
    """Travel of the tracks. length, gauge (centre to centre), shoe width [m]; speed [m/s]."""

    length: float
    gauge: float
    shoe: float
    max_speed: float
    max_acceleration: float


@dataclass(frozen=True)
class Machine:
    """One excavator. Bodies are oriented boxes, each in the frame of its link."""

    name: str  # of the model: "mini", "zx200"
    title: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    bodies: Boxes
    body_names: tuple[str, ...]  # "boom/0": part and running number
    body_links: tuple[int, ...]
    end_link: int
    end_point: Array  # (3,) bucket tip in the frame of links[end_link] [m]
    sun: SunMap
    arm: ArmPlane
    antenna: Antenna
    heading_of: str  # "tracks" or "upper": what the heading sensor turns with
    heading_offset: float  # sensor heading minus the body's heading [rad]
    tracks: Tracks
    masses_trusted: bool
    payload: float  # rated [kg]
    self_pairs: tuple[tuple[int, int], ...]  # body indices that count as self-collision
    max_reach: float  # from the swing axis, joint limits ignored (Sun) [m]
    assumptions: tuple[str, ...] = field(default=())
    eye: Eye | None = None  # where the sidecar says it
    lidars: tuple[LidarMount, ...] = ()
    strokes: tuple[Stroke, ...] = ()  # of the cylinders that the sidecar describes

    # Arrays that are made once, here and below, are left writable: a copy in another process is,
    # and kernels are compiled for either kind. Nobody may write to them.

    @cached_property
    def lower(self) -> Array:
        """(n,) [rad], -inf for continuous joints."""
        return np.array([j.lower for j in self.joints])

    @cached_property
    def upper(self) -> Array:
        """(n,) [rad], +inf for continuous joints."""
        return np.array([j.upper for j in self.joints])

    @cached_property
    def max_velocity(self) -> Array:
        """(n,) [rad/s]."""
        return np.array([j.max_velocity for j in self.joints])

    @cached_property
    def max_acceleration(self) -> Array:
        """(n,) [rad/s^2]."""
        return np.array([j.max_acceleration for j in self.joints])

    @cached_property
    def max_torque(self) -> Array:
        """(n,) [N m], infinite where none is stated."""
        return np.array([j.max_torque for j in self.joints])

    @cached_property
    def link_matrices(self) -> Array:
        """(3, L, 4, 4): T_parent_link(q) = M[0] + sin(q) M[1] + (1 - cos(q)) M[2], Rodrigues."""
        M = np.zeros((3, len(self.links), 4, 4))
        for i, link in enumerate(self.links):
            x, y, z = link.axis
            K = np.zeros((4, 4))
            K[:3, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
            M[:, i] = link.T_parent_joint, link.T_parent_joint @ K, link.T_parent_joint @ K @ K
        return M

    @cached_property
    def bounding_radius(self) -> float:
        """Radius about the swing centre that contains every body in every posture [m]."""
        swing = next(i for i, link in enumerate(self.links) if link.joint == 0)
        corners = np.linalg.norm(self.bodies.corners(), axis=2).max(axis=1)
        T_swing_root = np.linalg.norm(self.arm.T_root_swing[:3, 3])
        radius = 0.0
        for corner, link in zip(corners, self.body_links, strict=True):
            chain, i = float(corner), link
            while i >= 0 and i != swing:
                chain += float(np.linalg.norm(self.links[i].T_parent_joint[:3, 3]))
                i = self.links[i].parent
            # Links below the swing joint are reached through the root instead.
            radius = max(radius, chain + (float(T_swing_root) if i < 0 else 0.0))
        return radius

    @cached_property
    def body_arrays(self) -> tuple[Array, Array, Array]:
        """Centers, rotations and half extents of the bodies, writable as kernels want them."""
        boxes = self.bodies
        return boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()

    @cached_property
    def body_link_index(self) -> IntArray:
        """(n,) body_links as an index array."""
        return np.array(self.body_links, dtype=np.int64)

    @cached_property
    def link_parents(self) -> IntArray:
        """(L,) each link's parent, -1 for the root."""
        return np.array([link.parent for link in self.links], dtype=np.int64)

    @cached_property
    def link_joints(self) -> IntArray:
        """(L,) the joint that moves each link, -1 where it is fixed to its parent."""
        return np.array([link.joint for link in self.links], dtype=np.int64)

    @cached_property
    def body_corners(self) -> Array:
        """(bodies, 8, 3) in the frames of their links [m]."""
        return self.bodies.corners()

    @cached_property
    def stretched_levers(self) -> Array:
        """(bodies, n) how far from each joint's axis a point of each body can be in any posture, 0
        where the joint does not move the body [m].
        """
        levers = np.zeros((len(self.body_links), len(self.joints)))
        size = np.linalg.norm(self.body_corners, axis=2).max(axis=1, initial=0.0)
        for body, first in enumerate(self.body_links):
            length, i = float(size[body]) + 1e-9, first
            while i >= 0:
                link = self.links[i]
                if link.joint >= 0:
                    levers[body, link.joint] = length
                length += float(np.linalg.norm(link.T_parent_joint[:3, 3]))
                i = link.parent
        return levers

    @cached_property
    def joint_links(self) -> IntArray:
        """(n,) the link that each joint moves first."""
        return np.array(
            [
                next(i for i, link in enumerate(self.links) if link.joint == k)
                for k in range(len(self.joints))
            ],
            dtype=np.int64,
        )

    @cached_property
    def joint_axes(self) -> Array:
        """(n, 3) unit vectors of the joints' axes in the frames of `joint_links`."""
        axes = np.array([self.links[k].axis for k in self.joint_links], dtype=float)
        return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))

    @cached_property
    def body_joints(self) -> BoolArray:
        """(bodies, n) whether a joint moves a body."""
        moved = np.zeros((len(self.body_links), len(self.joints)), dtype=bool)
        for body, link in enumerate(self.body_links):
            i = link
            while i >= 0:
                if self.links[i].joint >= 0:
                    moved[body, self.links[i].joint] = True
                i = self.links[i].parent
        return moved

    @cached_property
    def self_pair_index(self) -> IntArray:
        """(p, 2) self_pairs as an index array."""
        return np.array(self.self_pairs, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def self_pair_joints(self) -> BoolArray:
        """(p, n) the joints that move the bodies of a pair against each other: carry only one."""
        pairs = self.self_pair_index
        return np.asarray(self.body_joints[pairs[:, 0]] != self.body_joints[pairs[:, 1]])

    @cached_property
    def self_pair_levers(self) -> Array:
        """(p, n) how far the bodies of a pair come nearer per joint rate, at most [m]."""
        far, pairs = self.stretched_levers, self.self_pair_index
        return np.where(self.self_pair_joints, far[pairs[:, 0]] + far[pairs[:, 1]], 0.0)

    @cached_property
    def body_parts(self) -> AnyArray:
        """(n,) the part of each body."""
        return np.array([self.links[link].part for link in self.body_links])

    def part_of_body(self, index: int) -> str:
        return self.links[self.body_links[index]].part
