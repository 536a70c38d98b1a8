"""How the sensors sit on one machine, and the limits of fusion: all that stays the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.fusion.samples import Fix
from backend.machine.model import Machine
from backend.spatial.types import Array


@dataclass(frozen=True)
class FusionConfig:
    """Limits and defaults. Times [s], lengths [m], angles [rad]."""

    joints_stale: float = 0.200
    gnss_stale: float = 0.300  # or 3 periods where that is longer
    gnss_stale_most: float = 1.0  # however slow the receiver is
    attitude_stale: float = 0.300
    max_extrapolation: float = 0.100
    step_hold: float = 1.0  # how long a stepped clock keeps the pose UNKNOWN
    sigma_limit: float = 0.5  # a position known worse than this is UNKNOWN
    sigma_joints: float = 0.003  # JointState carries no covariance
    sigma_stroke: float = 0.0005  # of a cylinder's sensor, in metres
    sigma_heading: float = 0.0035  # when the sensor states no variance
    sigma_tilt: float = 0.005  # when the IMU states no variance
    default_sigma: Mapping[Fix, float] = field(
        default_factory=lambda: {
            Fix.RTK_FIXED: 0.02,
            Fix.RTK_FLOAT: 0.30,
            Fix.SBAS: 1.0,
            Fix.SINGLE: 2.5,
        }
    )
    least_sigma: Mapping[Fix, float] = field(  # what a receiver may claim at best
        default_factory=lambda: {
            Fix.RTK_FIXED: 0.005,
            Fix.RTK_FLOAT: 0.10,
            Fix.SBAS: 0.30,
            Fix.SINGLE: 1.0,
        }
    )


@dataclass(frozen=True)
class Hop:
    """From one moving part to the next: fixed R (3, 3), p (3,), then a turn about `axis` (3,).

    joint: index into the joint vector; -1 with a zero axis where the chain ends without turning.
    """

    R: Array
    p: Array
    axis: Array
    joint: int


@dataclass(frozen=True)
class Swept:
    """A vector in the root frame that may turn with the swing: level + cos(q) even + sin(q) odd."""

    level: Array
    even: Array
    odd: Array

    def at(self, swing: Array) -> Array:
        """(k, 3) at swing angles (k,) [rad]."""
        c, s = np.cos(swing)[:, None], np.sin(swing)[:, None]
        return np.asarray(self.level + c * self.even + s * self.odd)


@dataclass(frozen=True)
class Imu:
    """An IMU's link: the joint that moves its part (-1: tracks), R_part_link (3, 3) fixed."""

    joint: int
    R_part_link: Array


@dataclass(frozen=True)
class Rig:
    """One machine's sensors. columns: joint index by URDF name and by role; cylinders:
    (name in a JointState, index into Machine.strokes, joint that it moves); imus: by link name.
    """

    name: str
    machine: Machine
    frame: SiteFrame
    config: FusionConfig
    columns: tuple[tuple[str, int], ...]
    continuous: tuple[bool, ...]
    low: tuple[float, ...]  # plausible joint values [rad]
    high: tuple[float, ...]
    max_velocity: tuple[float, ...]
    imus: Mapping[str, Imu]
    arm: tuple[Hop, ...]  # root to the last actuated part
    antenna: Swept  # position in the root frame [m]
    forward: Swept  # the heading sensor's axis in the root frame
    cylinders: tuple[tuple[str, int, int], ...] = ()


JOINT_TOLERANCE = 0.5  # sensors read a little beyond the stated limits [rad]
MOST_TURNS = 1000.0  # a continuous joint beyond this is nonsense [rad]


def make_rig(
    name: str, machine: Machine, frame: SiteFrame, config: FusionConfig | None = None
) -> Rig:
    """The rig of the site's machine `name`."""
    columns = {joint.name: k for k, joint in enumerate(machine.joints)}
    for k, joint in enumerate(machine.joints):
        columns.setdefault(joint.role, k)
    cylinders: dict[str, tuple[str, int, int]] = {}
    for k, stroke in enumerate(machine.strokes):
        for cylinder in stroke.names:
            cylinders.setdefault(cylinder, (cylinder, k, stroke.joint))
    finite = [
        (
            max(joint.lower - JOINT_TOLERANCE, -MOST_TURNS),
            min(joint.upper + JOINT_TOLERANCE, MOST_TURNS),
        )
        for joint in machine.joints
    ]
    return Rig(
        name=name,
        machine=machine,
        frame=frame,
        config=config or FusionConfig(),
        columns=tuple(columns.items()),
        continuous=tuple(joint.continuous for joint in machine.joints),
        low=tuple(low for low, _ in finite),
        high=tuple(high for _, high in finite),
        max_velocity=tuple(joint.max_velocity for joint in machine.joints),
        imus=_imus(machine),
        arm=hops(machine, _moved_by(machine, len(machine.joints) - 1), np.zeros(3)),
        antenna=_antenna(machine),
        forward=_forward(machine),
        cylinders=tuple(cylinders.values()),
    )


def hops(machine: Machine, link: int, point: Array) -> tuple[Hop, ...]:
    """The way from the root to `point` (3,) on a link, rigid links merged [m]."""
    path = []
    while link >= 0:
        path.append(machine.links[link])
        link = machine.links[link].parent
    found = []
    R, p = np.eye(3), np.zeros(3)
    for step in reversed(path):
        p = p + R @ step.T_parent_joint[:3, 3]
        R = R @ step.T_parent_joint[:3, :3]
        if step.joint >= 0:
            found.append(Hop(R, p, np.asarray(step.axis, dtype=float), step.joint))
            R, p = np.eye(3), np.zeros(3)
    found.append(Hop(R, p + R @ np.asarray(point, dtype=float), np.zeros(3), -1))
    return tuple(found)


def _antenna(machine: Machine) -> Swept:
    """Raises InputError for an antenna on the arm: its lever would depend on every joint."""
    way = hops(machine, machine.antenna.link, machine.antenna.position)
    moving = [hop for hop in way if hop.joint >= 0]
    if not moving:
        return Swept(way[0].p, np.zeros(3), np.zeros(3))
    if len(moving) > 1 or moving[0].joint != 0:
        link = machine.links[machine.antenna.link].name
        raise InputError(
            f'machine "{machine.name}": the GNSS antenna sits on "{link}"; allowed is a link of '
            "the tracks or of the upper body."
        )
    turned = _swept(way[0], way[1].p)
    return Swept(turned.level + way[0].p, turned.even, turned.odd)


def _forward(machine: Machine) -> Swept:
    """The body's heading is that of the root's x axis, carried round by the swing; the sensor's
    axis is `heading_offset` to the left of it."""
    angle = machine.heading_offset
    axis = np.array([np.cos(angle), np.sin(angle), 0.0])
    if machine.heading_of == "tracks":
        return Swept(axis, np.zeros(3), np.zeros(3))
    hop = hops(machine, _moved_by(machine, 0), np.zeros(3))[0]
    return _swept(hop, hop.R.T @ axis)


def _swept(hop: Hop, vector: Array) -> Swept:
    """R Rot(axis, q) vector by Rodrigues' formula, split by its dependence on q."""
    along = hop.axis * float(hop.axis @ vector)
    return Swept(hop.R @ along, hop.R @ (vector - along), hop.R @ np.cross(hop.axis, vector))


def _imus(machine: Machine) -> dict[str, Imu]:
    """By the URDF's link names, which win, and by the names of parts and "base"."""
    imus = {}
    for index, link in enumerate(machine.links):
        way = hops(machine, index, np.zeros(3))
        joint = way[-2].joint if len(way) > 1 else -1
        imus[link.name] = Imu(joint, way[-1].R)
    for k, role in enumerate(joint.role for joint in machine.joints):
        imus.setdefault("upper" if role == "swing" else role, Imu(k, np.eye(3)))
    for root in ("base", "tracks"):
        imus.setdefault(root, Imu(-1, np.eye(3)))
    return imus


def _moved_by(machine: Machine, joint: int) -> int:
    return next(i for i, link in enumerate(machine.links) if link.joint == joint)
