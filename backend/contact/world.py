"""One machine on ground made of boxes, in MuJoCo: it stands, climbs, tips and falls.

The machine is generated from its description: the rigid bodies of `stability.masses`, a belt a
track (a box between two end wheels), its other bodies as they are, and along the bucket's edge a
round bar. Belts run by letting their box slide and putting it back after every step: what touches
it sees the belt's speed, and the box stays in its place.

Units SI; the world's frame is any with z up; joints in the order of `Machine.joints`.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from backend.contact.crawler import crawler_of
from backend.contact.outfit import edge_radius
from backend.contact.spec import (
    BELT_JOINTS,
    DAMPING,
    DEFAULT,
    GROUND,
    RIGID,
    Options,
    spec_of,
    stiffness,
)
from backend.machine.model import Machine
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array
from backend.stability.masses import mass_model


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
        spec = spec_of(machine, self.masses, self.crawler, terrain, options)
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
