"""A machine and boxes of ground as a model of MuJoCo, generated from the machine's description."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from backend.contact.crawler import Crawler
from backend.contact.outfit import edge_half_width, edge_radius
from backend.machine.model import Machine
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.stability.masses import GRAVITY, MassModel, rigid_groups

FRICTION = 0.7
"""Of tracks and bucket on the ground (Jayasekara and Arisumi 2015, Table 2)."""
STEP = 0.002
"""[s] (Table 2)."""
BELT_SHARE = 0.02
"""Of the undercarriage's mass, each belt and each end wheel."""
SAG = 0.02
"""Of a joint whose whole load came unexpectedly, before it is made up for [rad]."""
DAMPING = 0.04
"""Of a joint's servo: its torque per rate over its torque per angle [s]."""
RIGID = 0.999
"""Impedance of the belts' drives: they keep their speed whatever force that takes."""
GROUND, MACHINE, BUCKET = 1, 2, 4
"""Kinds of geoms, as bits: what touches what."""


@dataclass(frozen=True)
class Options:
    """friction: of everything on the ground; step [s]; bodies: whether bodies beside tracks and
    bucket's edge touch the ground, too.
    """

    friction: float = FRICTION
    step: float = STEP
    bodies: bool = True


DEFAULT = Options()


SIDES = ("left", "right")
BELT_JOINTS = tuple(
    f"{name} {side}" for side in SIDES for name in ("belt", "wheel rear", "wheel front")
)


def stiffness(machine: Machine, masses: MassModel) -> Array:
    """(n,) torque per angle of the joints' servos [N m/rad]: half of the weight at the joint's
    longest lever bends it by SAG."""
    weight = 0.5 * masses.total * GRAVITY
    _, l2, l3, l4 = machine.sun.lengths
    levers = np.full(len(machine.joints), l4)
    levers[:3] = 0.5 * (l2 + l3), l2 + l3, 0.5 * (l2 + l3)
    return np.asarray(weight * levers / SAG)


def spec_of(
    machine: Machine, masses: MassModel, crawler: Crawler, terrain: Boxes, options: Options
) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.option.timestep = options.step
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 20.0
    ground = {
        "contype": GROUND,
        "conaffinity": MACHINE | BUCKET,
        "friction": [options.friction, 0.005, 0.0001],
        "condim": 3,
        "solref": [max(0.01, 2.5 * options.step), 1.0],
        "solimp": [0.97, 0.995, 0.0005, 0.5, 2.0],
    }
    world = spec.worldbody
    world.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1], **ground)
    for k in range(len(terrain)):
        world.add_geom(
            name=f"terrain {k}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=terrain.centers[k],
            quat=_quaternion(terrain.rotations[k]),
            size=terrain.half_extents[k],
            **ground,
        )
    touching = {**ground, "contype": MACHINE, "conaffinity": GROUND}
    gains = stiffness(machine, masses)
    bodies: list[mujoco.MjsBody] = []
    for b in range(len(masses.masses)):
        T, above = masses.T_parent_joint[b], int(masses.parents[b])
        parent = world if above < 0 else bodies[above]
        body = parent.add_body(name=f"body {b}", pos=T[:3, 3], quat=_quaternion(T[:3, :3]))
        bodies.append(body)
        mass, com, tensor = masses.masses[b], masses.coms[b], masses.tensors[b]
        if above < 0:
            body.add_freejoint(name="base")
            mass, com, tensor = _without_belts(mass, com, tensor, crawler)
        else:
            k = int(masses.joints[b])
            # What the servo's stiffness asks of the time step, as rotating mass of its drive.
            drive = 2.0 * gains[k] * options.step**2
            body.add_joint(
                name=f"joint {k}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=masses.axes[b],
                armature=drive,
            )
        body.explicitinertial = True
        body.mass, body.ipos = float(mass), com
        body.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    _belts(bodies[0], masses, crawler, touching)
    if options.bodies:
        _bodies(machine, crawler, bodies, touching)
    _edge(machine, bodies, {**touching, "contype": BUCKET})
    for k in range(len(machine.joints)):
        spec.add_actuator(
            name=f"joint {k}",
            target=f"joint {k}",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            gainprm=[gains[k], *[0.0] * 9],
            biasprm=[0.0, -gains[k], -DAMPING * gains[k], *[0.0] * 7],
        )
    for name in BELT_JOINTS:
        spec.add_equality(
            name=name,
            type=mujoco.mjtEq.mjEQ_JOINT,
            name1=name,
            solref=[2.0 * options.step, 1.0],
            solimp=[RIGID, RIGID, 0.001, 0.5, 2.0],
        )
    return spec


def _without_belts(
    mass: float, com: Array, tensor: Array, crawler: Crawler
) -> tuple[float, Array, Array]:
    """What is left of the undercarriage: together with belts and wheels it is as heavy as before,
    about the same point."""
    part = BELT_SHARE * mass
    places = [
        np.array(
            [crawler.middle + along * crawler.half_base, side * 0.5 * crawler.gauge, crawler.radius]
        )
        for side in (1.0, -1.0)
        for along in (-1.0, 0.0, 1.0)
    ]
    left = mass - part * len(places)
    centre = (mass * com - part * sum(places)) / left
    about = tensor + mass * _parallel(com)
    about = about - part * sum(_parallel(p) for p in places) - left * _parallel(centre)
    return left, centre, about


def _belts(
    body: mujoco.MjsBody, masses: MassModel, crawler: Crawler, touching: dict[str, Any]
) -> None:
    part = BELT_SHARE * float(masses.masses[0])
    a, r = crawler.half_base, crawler.radius
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        y = 0.5 * sign * crawler.gauge
        belt = body.add_body(name=f"belt {side}", pos=[crawler.middle, y, r])
        belt.explicitinertial = True
        belt.mass, belt.ipos = part, [0.0, 0.0, 0.0]
        belt.inertia = [part * 0.1 * r**2] * 3
        belt.add_joint(name=f"belt {side}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1.0, 0.0, 0.0])
        belt.add_geom(
            name=f"belt {side}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[a, 0.5 * crawler.shoe, r],
            **touching,
        )
        for name, along in (("rear", -a), ("front", a)):
            wheel = body.add_body(name=f"wheel {name} {side}", pos=[crawler.middle + along, y, r])
            wheel.explicitinertial = True
            wheel.mass, wheel.ipos = part, [0.0, 0.0, 0.0]
            wheel.inertia = [0.5 * part * r**2] * 3
            wheel.add_joint(
                name=f"wheel {name} {side}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=[0.0, 1.0, 0.0],
            )
            wheel.add_geom(
                name=f"wheel {name} {side}",
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                size=[r, 0.5 * crawler.shoe, 0.0],
                quat=_quaternion(rotation.rx(0.5 * np.pi)),
                **touching,
            )


def _bodies(
    machine: Machine,
    crawler: Crawler,
    bodies: list[mujoco.MjsBody],
    touching: dict[str, Any],
) -> None:
    """The machine's own, but the tracks' and those at the bucket's edge: that is the bar's."""
    group, T_group_link = rigid_groups(machine)
    for k, name in enumerate(machine.body_names):
        link = machine.body_links[k]
        if k in crawler.bodies or link == machine.end_link:
            continue
        T = T_group_link[link]
        R = T[:3, :3] @ machine.bodies.rotations[k]
        bodies[group[link]].add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=T[:3, :3] @ machine.bodies.centers[k] + T[:3, 3],
            quat=_quaternion(R),
            size=machine.bodies.half_extents[k],
            **touching,
        )


def _edge(machine: Machine, bodies: list[mujoco.MjsBody], touching: dict[str, Any]) -> None:
    group, T_group_link = rigid_groups(machine)
    T = T_group_link[machine.end_link]
    place = T[:3, :3] @ machine.end_point + T[:3, 3]
    radius = edge_radius(machine)
    half = max(edge_half_width(machine) - radius, 0.1 * radius)
    # The bar lies along the axis of the bucket's joint.
    body = bodies[group[machine.end_link]]
    axis = machine.joint_axes[3]
    body.add_geom(
        name="edge",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[*(place - half * axis), *(place + half * axis)],
        size=[radius, 0.0, 0.0],
        **touching,
    )
    body.add_site(name="edge", pos=place)


def _quaternion(R: Array) -> Array:
    out = np.empty(4)
    mujoco.mju_mat2Quat(out, np.ascontiguousarray(R, dtype=float).ravel())
    return out


def _parallel(offset: Array) -> Array:
    return np.asarray(float(offset @ offset) * np.eye(3) - np.outer(offset, offset))
