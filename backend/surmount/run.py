"""A motion gone through in MuJoCo: what it takes, and whether the machine stays on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from backend.contact.spec import STEP, Options
from backend.contact.world import ContactWorld
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.surmount.judge import Sequence, course_of
from backend.surmount.machine import Climber
from backend.surmount.records import Motion, Parameters, Phase, Spline, Step
from backend.surmount.sequences import joints_of

SETTLED = 0.4
"""Before a motion begins, the machine finds its rest [s]."""
AFTER = 0.2
"""And after its end [s]."""
COARSER = 0.004
"""Time step for machines as heavy as those that people sit in [s]; small ones take STEP."""
SMALL = 100.0
"""[kg]"""
WIDE = 4.0
"""Ground to either side and along the way, in reaches of the arm."""
LOST = float(np.radians(3.0))
"""The crawler's lean farther from what was planned means that it fell or slid [rad]."""
ASTRAY = 0.1
"""And P_b farther from its place than this share of the crawler's base."""


@dataclass(frozen=True, eq=False)
class Run:
    """time: (k,) of every step from the motion's start [s]; q, rates, torques: (k, n) [rad, rad/s,
    N m]; T_step_root: (k, 4, 4); energy: (k,) of Eq. (19) since the start [J]; edge: (k, 3) of the
    bucket's bar [m]; deepest: of anything in the ground [m]; slip: how far the bucket's edge left
    its place along the ground while it is held there [m]; lean, place: greatest difference to the
    plan, of the crawler's lean [rad] and of its root [m]; why: what went wrong, empty where nothing
    did.
    """

    time: Array
    q: Array
    rates: Array
    torques: Array
    T_step_root: Array
    energy: Array
    edge: Array
    deepest: float
    slip: float
    lean: float
    place: float
    why: str

    @property
    def total(self) -> float:
        """[J]"""
        return float(self.energy[-1])


def options_of(climber: Climber) -> Options:
    """The time step by the machine's size; bodies do not touch: they are judged beforehand."""
    step = STEP if climber.masses.total < SMALL else COARSER
    return Options(climber.demands.friction, step, bodies=False)


def terrain(climber: Climber, step: Step) -> Boxes:
    """Risers as boxes in the step frame: each reaches to the end of all, the next stands in it."""
    wide = WIDE * climber.machine.max_reach
    risers = step.risers
    # A lone top ends where it ends; before another riser it goes on under that.
    end = min(step.depth, 2.0 * wide) if len(risers) == 1 else risers[-1][0] + 2.0 * wide
    half = np.array([[0.5 * (end - x), wide, 0.5 * h] for x, h in risers])
    centres = np.array([[0.5 * (end + x), 0.0, 0.5 * h] for x, h in risers])
    return Boxes(centres, np.broadcast_to(np.eye(3), (len(half), 3, 3)).copy(), half)


def world_of(climber: Climber, step: Step, turned: float = 0.0) -> ContactWorld:
    """To go through as many motions as one likes. turned: the step about its edge's middle, seen
    from above [rad]."""
    boxes = terrain(climber, step)
    if turned:
        R = rotation.rz(turned)
        boxes = Boxes(boxes.centers @ R.T, R @ boxes.rotations, boxes.half_extents)
    return ContactWorld(climber.machine, climber.demands.payload, boxes, options_of(climber))


def fine(
    climber: Climber,
    step: Step,
    parameters: Parameters,
    one: Sequence,
    dt: float,
    spline: Spline | None = None,
) -> Motion:
    """A sequence row by row, dt [s] apart."""
    count = max(2, int(np.ceil(one.duration / dt))) + 1
    u = np.linspace(0.0, 1.0, count)
    course = course_of(one.name, climber, step, parameters, u, spline)
    joints = joints_of(climber, course)
    torques = CubicSpline(one.course.u, one.loads.torques)(u)
    time = u * one.duration
    lines = np.stack(
        [np.interp(u, one.course.u, one.lines[:, i, j]) for i in (0, 1) for j in (0, 2)], axis=1
    )
    return Motion(
        time=time,
        q=joints.q,
        rates=np.gradient(joints.q, time, axis=0),
        belts=np.gradient(course.belt, time),
        T_step_root=joints.T,
        support=lines.reshape(count, 2, 2),
        held=np.broadcast_to(course.held, (count, 2)),
        torques=torques,
        phases=(Phase(one.name, 0.0, one.duration),),
    )


def run(climber: Climber, world: ContactWorld, motion: Motion, kept: float = LOST) -> Run:
    """motion: with rows of `world.options.step`, apart; kept: how far the crawler may lean from
    what was planned, to either side as well [rad]."""
    dt, n = world.options.step, motion.q.shape[1]
    before, after = round(SETTLED / dt), round(AFTER / dt)
    belts = np.repeat(climber.demands.facing * motion.belts[:, None], 2, axis=1)
    still, none = np.zeros((1, n)), np.zeros((1, 2))
    rows = np.concatenate(
        [
            np.repeat(world.control(motion.q[:1], still, none, motion.torques[:1]), before, axis=0),
            world.control(motion.q, motion.rates, belts, motion.torques),
            np.repeat(
                world.control(motion.q[-1:], still, none, motion.torques[-1:]), after, axis=0
            ),
        ]
    )
    data, site = world.data, world.edge_site
    count = len(rows)
    force, drives = np.empty((count, n)), np.empty((count, len(world.belt_dofs)))
    place, speed = np.empty((count, world.model.nq)), np.empty((count, world.model.nv))
    edge, deepest = np.empty((count, 3)), 0.0
    world.reset(motion.T_step_root[0], motion.q[0])
    for k in range(count):
        world.step(rows[k])
        force[k], place[k], speed[k] = data.actuator_force, data.qpos, data.qvel
        drives[k], edge[k] = data.efc_force[: drives.shape[1]], data.site_xpos[site]
        if k % 5 == 0 and k >= before:
            deepest = max(deepest, world.deepest())
    shown = slice(before, before + len(motion.q))
    torques, place, speed, edge = force[shown], place[shown], speed[shown], edge[shown]
    q, rates = place[:, world.joint_places], speed[:, world.joint_dofs]
    motors = (drives[shown] * speed[:, world.belt_dofs]).reshape(-1, 2, 3)
    work = np.abs(torques[1:] * np.diff(q, axis=0)).sum(axis=1)
    work = work + np.abs(0.5 * (motors[1:] + motors[:-1]).sum(axis=2) * dt).sum(axis=1)
    T = world.poses_of(place[:, :7])
    lean = _angles(T[:, 2, 0]) - _angles(motion.T_step_root[:, 2, 0])
    off = np.linalg.norm(T[:, :3, 3] - motion.T_step_root[:, :3, 3], axis=1)
    beside = np.abs(_angles(T[:, 2, 1]))
    why = ""
    if max(np.abs(lean).max(), beside.max()) > kept or not np.isfinite(place).all():
        at = int(np.argmax((np.abs(lean) > kept) | (beside > kept)))
        why = f"it falls or slides after {motion.time[at]:.1f} s"
    elif off.max() > ASTRAY * 2.0 * climber.a:
        at = int(np.argmax(off > ASTRAY * 2.0 * climber.a))
        why = f"it slides {off.max():.3f} m off its way after {motion.time[at]:.1f} s"
    held = np.isfinite(motion.held[:, 0])
    moved = np.abs(edge[:, 0] - motion.held[:, 0])[held]
    return Run(
        time=motion.time,
        q=q,
        rates=rates,
        torques=torques,
        T_step_root=T,
        energy=np.concatenate([[0.0], np.cumsum(work)]),
        edge=edge,
        deepest=deepest,
        slip=float(moved.max(initial=0.0)),
        lean=float(np.abs(lean).max()),
        place=float(off.max()),
        why=why,
    )


def _angles(sines: Array) -> Array:
    return np.asarray(np.arcsin(np.clip(sines, -1.0, 1.0)))
