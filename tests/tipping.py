"""An independent judge of tipping over: MuJoCo, with the machine on four feet that can only push.

The model is made from the Machine link by link. The base floats; at each corner of the support
polygon it stands on a foot, with much friction. Motors make the joints follow a prescribed motion,
whatever the base does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from backend.machine.model import Machine
from backend.spatial import rotation, transform
from backend.stability.masses import mass_model
from backend.stability.polygon import support_polygon
from backend.stability.zmp import edge_distances, edge_moments, share, zmp

STEP = 5e-4  # of the simulation [s]
FOOT = 0.02  # radius [m]
SETTLE = 0.3  # at rest before the motion [s]
LASTING = 5e-3  # a foot without force for less has not lifted: contacts drop out for a step [s]
GRAVITY = 9.81


@dataclass(frozen=True)
class Drive:
    """A machine with a payload [kg] at its end point, on a slope, and a motion of its joints."""

    machine: Machine
    payload: float
    pitch: float
    roll: float
    motion: CubicSpline
    seconds: float


class Measured(NamedTuple):
    """times: (t,) since the motion began [s]; forces: (t, k) of each foot [N], normal; lift: (k,)
    the highest that each foot came above where it stood when the motion began [m].
    """

    times: np.ndarray
    forces: np.ndarray
    lift: np.ndarray


def random_drive(machine: Machine, random: np.random.Generator) -> Drive:
    """A motion through random postures, gentle to more than twice as hard as the machine's limits,
    loaded with nothing to three times what is rated.
    """
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
    q0 = random.uniform(low, high)
    q0[1:3] = low[1:3] + random.uniform([0.3, 0.5], [0.8, 1.0]) * (high - low)[1:3]
    seconds, knots = 2.4, 5
    steps = random.normal(size=(knots, len(low))) * machine.max_velocity
    steps[[0, -1]] = 0.0
    path = q0 + np.cumsum(steps, axis=0) * 0.5
    path[-1] = path[-2]
    motion = CubicSpline(np.linspace(0.0, seconds, knots), path, bc_type="clamped")
    t = np.linspace(0.0, seconds, 400)
    hardest = (np.abs(motion(t, 2)) / machine.max_acceleration).max()
    wish = random.uniform(0.2, 2.5)
    path = q0 + (path - q0) * (wish / hardest)
    motion = CubicSpline(np.linspace(0.0, seconds, knots), path, bc_type="clamped")
    pitch, roll = random.uniform(-0.15, 0.15, 2)
    payload = random.uniform(0.0, 3.0) * machine.payload
    return Drive(machine, payload, pitch, roll, motion, seconds)


def simulate(drive: Drive, corners: np.ndarray) -> Measured:
    """corners: (k, 2) of the support polygon, root frame [m]."""
    model = mujoco.MjModel.from_xml_string(_xml(drive, corners))
    data = mujoco.MjData(model)
    n = len(drive.machine.joints)
    data.qpos[7:] = drive.motion(0.0)
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    feet = {model.geom(f"foot{i}").id: i for i in range(len(corners))}
    height = model.geom("foot0").pos[2]
    times, forces, lift = [], [], np.full(len(corners), -np.inf)
    stood = None
    force = np.zeros(6)
    for i in range(round((SETTLE + drive.seconds) / STEP)):
        t = i * STEP - SETTLE
        at = max(t, 0.0)
        wanted = drive.motion(at, 2) if t >= 0.0 else np.zeros(n)
        rate = drive.motion(at, 1) if t >= 0.0 else np.zeros(n)
        mujoco.mj_step1(model, data)
        mujoco.mj_fullM(model, data, M)
        pull = wanted + 900.0 * (drive.motion(at) - data.qpos[7:]) + 60.0 * (rate - data.qvel[6:])
        data.qfrc_applied[6:] = M[6:, 6:] @ pull + data.qfrc_bias[6:]
        mujoco.mj_step2(model, data)
        if t < 0.0:
            continue
        z = np.array([data.geom_xpos[g, 2] for g in feet])
        stood = z if stood is None else stood
        lift = np.maximum(lift, z - stood)
        now = np.zeros(len(corners))
        for c in range(data.ncon):
            foot = feet.get(int(data.contact.geom2[c]), feet.get(int(data.contact.geom1[c]), -1))
            if foot >= 0:
                mujoco.mj_contactForce(model, data, c, force)
                now[foot] += force[0]
        times.append(t)
        forces.append(now)
    assert height == FOOT
    return Measured(np.array(times), np.array(forces), lift)


def _xml(drive: Drive, corners: np.ndarray) -> str:
    machine = drive.machine
    g = rotation.from_attitude(0.0, drive.pitch, drive.roll).T @ [0.0, 0.0, -GRAVITY]
    inner: dict[int, list[str]] = {i: [] for i in range(len(machine.links))}
    for i, link in enumerate(machine.links):
        if link.inertia is not None:
            inner[i].append(_inertial(link.inertia))
        if link.joint >= 0:
            inner[i].append(f'<joint type="hinge" axis="{_row(link.axis)}"/>')
    inner[machine.end_link].append(
        f'<body pos="{_row(machine.end_point)}"><inertial pos="0 0 0" '
        f'diaginertia="1e-4 1e-4 1e-4" mass="{max(drive.payload, 1e-3)}"/></body>'
    )
    inner[0].append('<freejoint name="base"/>')
    inner[0] += [
        f'<geom name="foot{i}" type="sphere" size="{FOOT}" pos="{x} {y} {FOOT}"/>'
        for i, (x, y) in enumerate(corners)
    ]
    for i in reversed(range(len(machine.links))):
        link = machine.links[i]
        T = link.T_parent_joint
        w = rotation.to_quaternion(T[:3, :3])
        text = f'<body pos="{_row(T[:3, 3])}" quat="{_row(w)}">{"".join(inner[i])}</body>'
        if link.parent >= 0:
            inner[link.parent].append(text)
    return f"""<mujoco>
      <compiler angle="radian" balanceinertia="false"/>
      <option timestep="{STEP}" gravity="{_row(g)}" cone="elliptic" impratio="10"/>
      <default><geom friction="3 0.01 0.001" solref="0.004 1" solimp="0.95 0.99 0.001"
        condim="3"/></default>
      <worldbody><geom name="ground" type="plane" size="50 50 1"/>{text}</worldbody>
    </mujoco>"""


def _inertial(inertia) -> str:
    t = inertia.tensor
    six = [t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]]
    return f'<inertial pos="{_row(inertia.com)}" mass="{inertia.mass}" fullinertia="{_row(six)}"/>'


class Verdict(NamedTuple):
    """predicted: least share of the prescribed motion's ZMP; lifted: whether all feet off some edge
    were without force at once, for LASTING; error: of the edges' moments up to then, 95 % of the
    time below it, by the weight's moment about that edge from the middle.
    """

    predicted: float
    lifted: bool
    error: float


def judge(drive: Drive) -> Verdict:
    """The prediction for the motion as prescribed, and what happened."""
    support = support_polygon(drive.machine)
    model = mass_model(drive.machine, drive.payload)
    got = simulate(drive, support.vertices)
    motion = tuple(drive.motion(got.times, order) for order in range(3))
    T = transform.make(rotation.from_attitude(0.0, drive.pitch, drive.roll), np.zeros(3))
    predicted = share(zmp(model, *motion, T), support).min()
    levers = edge_distances(support.vertices, support)
    opposite = got.forces @ (levers > 1e-9)
    up = _lasting(opposite <= 1e-6 * model.total * GRAVITY, round(LASTING / STEP)).any(axis=1)
    until = int(up.argmax()) if up.any() else len(up)
    scale = model.total * GRAVITY * support.inradii
    off = np.abs(got.forces @ levers - edge_moments(model, support, *motion, T)) / scale
    error = np.percentile(off[:until].max(axis=1), 95) if until else 0.0
    return Verdict(float(predicted), bool(up.any()), float(error))


def _lasting(held: np.ndarray, steps: int) -> np.ndarray:
    """(t, k) where `held` (t, k) is true from here on for so many steps."""
    windows = np.lib.stride_tricks.sliding_window_view(held, steps, axis=0)
    return windows.all(axis=-1)


def _row(values) -> str:
    return " ".join(repr(float(v)) for v in values)
