"""One machine on ground made of boxes, in MuJoCo: it stands, climbs, tips and falls.

The machine is generated from its description: the rigid bodies of `stability.masses`, a belt a
track (a box between two end wheels), its other bodies as they are, and along the bucket's edge a
round bar. Belts run by letting their box slide and putting it back after every step: what touches
it sees the belt's speed, and the box stays in its place. MuJoCo is imported nowhere else.

Units SI; the world's frame is any with z up; joints in the order of `Machine.joints`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

# Nothing is drawn with it: without this, importing it looks for windows, in a process of its own.
os.environ.setdefault("MUJOCO_GL", "disable")
import mujoco

from backend.contact.crawler import Crawler, crawler_of
from backend.contact.outfit import edge_half_width, edge_radius
from backend.machine.model import Machine
from backend.spatial import rotation
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array
from backend.stability.masses import GRAVITY, MassModel, mass_model, rigid_groups

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


class Touches(NamedTuple):
    """What touches the ground now. points: (k, 3) [m]; forces: (k, 3) on the machine [N], world
    frame; depth: (k,) how far it is in the ground [m]; kinds: (k,) "belt left", "wheel rear right",
    "edge", or a body's name.
    """

    points: Array
    forces: Array
    depth: Array
    kinds: tuple[str, ...]


class ContactWorld:
    """A machine among boxes on the plane z = 0. Not thread-safe.

    payload [kg] hangs at the end point; terrain: fixed boxes, in the world's frame. Raises
    InputError where the masses are not known, or it does not stand on two tracks.
    """

    def __init__(
        self,
        machine: Machine,
        payload: float = 0.0,
        terrain: Boxes = NO_BOXES,
        options: Options = DEFAULT,
    ) -> None:
        self.machine, self.options = machine, options
        self.crawler = crawler_of(machine)
        self.masses = mass_model(machine, payload)
        self.edge_radius = edge_radius(machine)
        spec = _spec(machine, self.masses, self.crawler, terrain, options)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        joints = range(len(machine.joints))
        self.joint_places = np.array([self.model.joint(f"joint {k}").qposadr[0] for k in joints])
        self.joint_dofs = np.array([self.model.joint(f"joint {k}").dofadr[0] for k in joints])
        belts = [self.model.joint(name) for name in BELT_JOINTS]
        self._belt_places = np.array([one.qposadr[0] for one in belts])
        self.belt_dofs = np.array([one.dofadr[0] for one in belts])
        self._drives = np.array([self.model.equality(name).id for name in BELT_JOINTS])
        n = len(machine.joints)
        self._n = n
        # A drive holds its joint at 0 with a spring and a damper; a place ahead by their ratio
        # times a speed is that speed.
        ahead = 2.0 * RIGID * 2.0 * options.step
        self._per_step = options.step / ahead
        r = self.crawler.radius
        self._per_speed = ahead * np.array([-1.0, 1.0 / r, 1.0 / r])
        self.edge_site = int(self.model.site("edge").id)
        self._gains = stiffness(machine, self.masses)
        self.reset(np.eye(4), np.zeros(n))

    def reset(self, T_world_root: Array, q: Array) -> None:
        """Put the machine somewhere, at rest. q: (n,) [rad]."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:3] = T_world_root[:3, 3]
        mujoco.mju_mat2Quat(self.data.qpos[3:7], np.asarray(T_world_root[:3, :3]).ravel())
        self.data.qpos[self.joint_places] = q
        self.data.ctrl[:] = q
        mujoco.mj_forward(self.model, self.data)

    def control(self, q: Array, rates: Array, belts: Array, torque: Array | None = None) -> Array:
        """(..., n + 6) what servos and belts are given to follow: q, rates (..., n) [rad, rad/s];
        belts (..., 2) left, right, over the crawler, forwards [m/s]; torque: (..., n) known
        beforehand [N m], so that the servos make up for the rest only.
        """
        ahead = np.asarray(q, dtype=float) + DAMPING * np.asarray(rates, dtype=float)
        if torque is not None:
            ahead = ahead + np.asarray(torque) / self._gains
        v = np.asarray(belts, dtype=float)[..., :, None] * self._per_speed
        return np.concatenate([ahead, v.reshape(*v.shape[:-2], 6)], axis=-1)

    def step(self, control: Array) -> None:
        """`options.step` seconds on. control: (n + 6,) of `control`."""
        data = self.data
        ahead = control[self._n :]
        data.ctrl[:] = control[: self._n]
        self.model.eq_data[self._drives, 0] = ahead
        mujoco.mj_step(self.model, data)
        # What a belt should have run it is put back by; what it lags stays, and is made up for.
        data.qpos[self._belt_places] -= ahead * self._per_step

    @property
    def time(self) -> float:
        """[s] since the reset."""
        return float(self.data.time)

    @property
    def T_world_root(self) -> Array:
        """(4, 4)"""
        T = np.eye(4)
        mat = np.empty(9)
        mujoco.mju_quat2Mat(mat, self.data.qpos[3:7])
        T[:3, :3], T[:3, 3] = mat.reshape(3, 3), self.data.qpos[:3]
        return T

    @property
    def velocity(self) -> Array:
        """(3,) of the root's origin [m/s], world frame."""
        return np.array(self.data.qvel[:3])

    @property
    def turning(self) -> Array:
        """(3,) angular velocity of the root [rad/s], root frame."""
        return np.array(self.data.qvel[3:6])

    @property
    def q(self) -> Array:
        """(n,) [rad]"""
        return np.array(self.data.qpos[self.joint_places])

    @property
    def rates(self) -> Array:
        """(n,) [rad/s]"""
        return np.array(self.data.qvel[self.joint_dofs])

    @property
    def belts(self) -> Array:
        """(2,) speed of the left and right belt over the crawler [m/s], forwards."""
        return -np.array(self.data.qvel[self.belt_dofs[[0, 3]]])

    @property
    def torques(self) -> Array:
        """(n,) of the joints [N m]."""
        return np.array(self.data.actuator_force)

    @property
    def drives(self) -> Array:
        """(6,) force or torque of the drives on belt, rear and front wheel of the left side, then
        of the right [N, N m]."""
        return np.array(self.data.efc_force[: len(BELT_JOINTS)])

    def deepest(self) -> float:
        """How far anything is in the ground [m]."""
        dist = self.data.contact.dist
        return float(max(0.0, -dist.min())) if len(dist) else 0.0

    def poses_of(self, base: Array) -> Array:
        """(k, 4, 4) of places and quaternions (k, 7) as in MuJoCo's qpos."""
        w, x, y, z = base[:, 3:7].T
        T = np.zeros((len(base), 4, 4))
        T[:, 0] = np.stack(
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), base[:, 0]], axis=1
        )
        T[:, 1] = np.stack(
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), base[:, 1]], axis=1
        )
        T[:, 2] = np.stack(
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), base[:, 2]], axis=1
        )
        T[:, 3, 3] = 1.0
        return T

    def edge(self) -> Array:
        """(3,) the middle of the bar along the bucket's edge [m], world frame."""
        return np.array(self.data.site("edge").xpos)

    def touches(self) -> Touches:
        """What touches the ground, with its forces."""
        data, model = self.data, self.model
        points, forces, depth, kinds = [], [], [], []
        six = np.empty(6)
        for i in range(data.ncon):
            contact = data.contact[i]
            if contact.exclude or contact.efc_address < 0:
                continue
            a, b = (model.geom(int(g)) for g in contact.geom)
            ours, sign = (b, 1.0) if a.contype[0] & GROUND else (a, -1.0)
            mujoco.mj_contactForce(model, data, i, six)
            # Rows of the contact's frame are its axes; x leads from the first geom to the second.
            forces.append(sign * (contact.frame.reshape(3, 3).T @ six[:3]))
            points.append(contact.pos.copy())
            depth.append(max(0.0, -float(contact.dist)))
            kinds.append(ours.name)
        count = len(kinds)
        return Touches(
            np.array(points).reshape(count, 3),
            np.array(forces).reshape(count, 3),
            np.array(depth),
            tuple(kinds),
        )


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


def _spec(
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
