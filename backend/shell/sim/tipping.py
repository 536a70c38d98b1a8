"""A simulated machine that turns over an edge of its support when the ground would have to pull.

As soon as the reactions at the two corners of the opposite edge are zero (Yamashita and Kikuuwe
2025, Section 2), the whole machine turns about the edge as a rigid body under its own moment: it
falls on, or back onto its tracks, until a body of it reaches the ground. What the turning itself
adds to the joints' motion (Coriolis) is left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.shell.sim.dynamics import SimState
from backend.spatial import rotation, transform
from backend.spatial.types import Array
from backend.stability.dynamics import ground_wrench
from backend.stability.masses import MassModel, mass_model, why_unknown
from backend.stability.polygon import Polygon, support_polygon
from backend.stability.zmp import moments_of

TIPPING, TOLD = "tipping", math.radians(0.5)
"""What an agent calls it, and from what angle on [rad]."""
FARTHEST = math.radians(80.0)
"""However it lies, no farther than this."""


@dataclass(frozen=True)
class Stance:
    """What tips: the machine with its payload, and its support."""

    machine: Machine
    model: MassModel
    support: Polygon


@dataclass(frozen=True)
class Lean:
    """edge: of the support that the machine turns about, -1 while it stands on all of it; angle
    [rad] and rate [rad/s] of that.
    """

    edge: int = -1
    angle: float = 0.0
    rate: float = 0.0


UPRIGHT = Lean()


def stance_of(machine: Machine, payload: float) -> Stance | None:
    """None where the masses are not known: then it never tips."""
    if why_unknown(machine):
        return None
    return Stance(machine, mass_model(machine, payload), support_polygon(machine))


def leaned(state: SimState, lean: Lean, stance: Stance) -> SimState:
    """The machine as it is; state: as it would stand on the ground."""
    if lean.edge < 0:
        return state
    T = state.T_site_root @ _turned(stance, lean)
    yaw, pitch, roll = (float(angle) for angle in rotation.to_attitude(T[:3, :3]))
    return replace(state, position=T[:3, 3], yaw=yaw, pitch=pitch, roll=roll)


def tip(lean: Lean, before: SimState, after: SimState, stance: Stance, dt: float) -> Lean:
    """The lean dt [s] later, while the joints and tracks went from `before` to `after`."""
    T = after.T_site_root if lean.edge < 0 else after.T_site_root @ _turned(stance, lean)
    accelerations = (after.qd - before.qd) / dt
    pushed = np.array([float((after.travel - before.travel).mean()) / dt, 0.0, 0.0])
    wrench = ground_wrench(stance.model, after.q, after.qd, accelerations, T, pushed)
    moments = moments_of(wrench, stance.support)
    edge = lean.edge if lean.edge >= 0 else int(np.argmin(moments))
    if lean.edge < 0 and moments[edge] >= 0.0:
        return UPRIGHT
    rate = lean.rate - float(moments[edge]) / _inertia(stance, after.q, edge) * dt
    angle = lean.angle + rate * dt
    if angle <= 0.0:
        return UPRIGHT
    found = Lean(edge, angle, rate)
    if rate > 0.0 and (angle > FARTHEST or _lies(stance, after, found)):
        return replace(lean, edge=edge, rate=0.0)
    return found


def _edge(stance: Stance, edge: int) -> tuple[Array, Array]:
    """A point of the edge and its direction, (3,) each, root frame."""
    corners = stance.support.vertices
    along = corners[(edge + 1) % len(corners)] - corners[edge]
    return np.array([*corners[edge], 0.0]), np.array([*along, 0.0]) / np.linalg.norm(along)


def _turned(stance: Stance, lean: Lean) -> Array:
    """(4, 4) of the machine leaning, in the frame in which it would stand; its inside rises."""
    point, along = _edge(stance, lean.edge)
    R = rotation.about_axis(along, lean.angle)
    return transform.make(R, point - R @ point)


def _inertia(stance: Stance, q: Array, edge: int) -> float:
    """Of the machine about that edge [kg m^2]."""
    point, along = _edge(stance, edge)
    poses, total = link_poses(stance.machine, q), 0.0
    bodies = [(i, x.inertia) for i, x in enumerate(stance.machine.links) if x.inertia is not None]
    for i, body in bodies:
        turned = along @ poses[i, :3, :3]
        total += float(turned @ body.tensor @ turned)
        total += body.mass * _square(poses[i, :3, :3] @ body.com + poses[i, :3, 3] - point, along)
    machine = stance.machine
    held = transform.apply(poses[machine.end_link], machine.end_point[None])[0] - point
    return total + stance.model.payload * _square(held, along)


def _square(away: Array, along: Array) -> float:
    return float(away @ away - (away @ along) ** 2)


def _lies(stance: Stance, state: SimState, lean: Lean) -> bool:
    """Whether a body beyond the edge has reached the ground."""
    poses = link_poses(stance.machine, state.q, _turned(stance, lean))
    corners = body_boxes(stance.machine, poses).corners().reshape(-1, 3)
    point, along = _edge(stance, lean.edge)
    inwards = np.array([-along[1], along[0]])
    beyond = (corners[:, :2] - point[:2]) @ inwards < -0.05
    return bool((corners[beyond, 2] < 0.0).any())
