"""Whether parameters can be gone through at all, and what they need when gone through slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.planning.trajectory.records import Obstacles
from backend.planning.trajectory.sweep import OWN, Sweep, make_sweep
from backend.spatial.types import Array
from backend.surmount.machine import Climber
from backend.surmount.outline import (
    belt_clearance,
    body_clearance,
    leans,
    rear_wheel,
)
from backend.surmount.records import SEQUENCES, Parameters, Spline, Step, Verdict
from backend.surmount.sequences import (
    Course,
    Joints,
    duration_of,
    joints_of,
    sequence_1,
    sequence_2_1,
    sequence_2_2,
)
from backend.surmount.statics import Loads, loads_of, slow_energy, weights_of
from backend.surmount.support import margin, zero_moment_points

ROWS = 61
"""Of a sequence when it is judged."""
SUNK = 1e-3
"""How deep the bucket's bodies may be in what it stands on [m]."""
ROUNDING = 1e-9
SPARE = 0.1
"""Of what lies on the top, before the line that bears it least behind: the bucket carries so much
that the crawler's pressure stays off the edge."""


@dataclass(frozen=True, eq=False)
class Sequence:
    """One sequence worked out. lines: (m, 2, 3) of what bears the machine, see `support.margin`;
    lines_z: (m, 2) their heights [m]; zmp: (m, 2) [m]; margin: (m,) [m]; duration [s].
    """

    name: str
    course: Course
    joints: Joints
    duration: float
    loads: Loads
    centre: Array
    lines: Array
    lines_z: Array
    zmp: Array
    margin: Array


def course_of(
    name: str,
    climber: Climber,
    step: Step,
    parameters: Parameters,
    u: Array,
    spline: Spline | None = None,
) -> Course:
    """One of SEQUENCES over u (m,); spline: of sequence 1."""
    if name == SEQUENCES[0]:
        return sequence_1(climber, step, parameters, u, spline)
    if name == SEQUENCES[1]:
        return sequence_2_1(climber, step, parameters, u)
    return sequence_2_2(climber, step, parameters, u)


def worked_out(climber: Climber, step: Step, name: str, course: Course) -> Sequence:
    """Joints, time, loads and margins of one course; NaN-free even where it cannot be reached."""
    joints = joints_of(climber, course)
    duration = duration_of(climber, course, joints.q)
    weights = weights_of(climber, joints.T, joints.q)
    lines, lines_z, bearing = _lines(climber, step, course)
    held = np.array([course.held[0], course.held[1] - climber.edge[0]])
    if name == "sequence 2-2":
        # The bucket carries what is left when the crawler's pressure lies well on the top.
        low, high = bearing
        least = low + SPARE * (high - low)
        bearing_x = np.clip(weights.centre[:, 0], least, np.maximum(high, least))
    else:
        bearing_x = bearing[0]
    line_z = np.full(len(course.x), 0.0 if name == "sequence 1" else step.height)
    loads = loads_of(climber, weights, np.stack([bearing_x, line_z], axis=1), held)
    dt = duration / (len(course.u) - 1)
    acceleration = np.gradient(np.gradient(weights.centre, dt, axis=0), dt, axis=0)
    points = zero_moment_points(weights.centre, acceleration, lines_z, lines[..., 0])
    return Sequence(
        name,
        course,
        joints,
        duration,
        loads,
        weights.centre,
        lines,
        lines_z,
        points,
        margin(points, lines),
    )


def _lines(
    climber: Climber, step: Step, course: Course
) -> tuple[Array, Array, tuple[Array, Array]]:
    """What bears the machine: (m, 2, 3), its heights (m, 2), and where the crawler bears (x, x)."""
    m, wide = len(course.x), climber.crawler.half_width
    a, r = climber.a, climber.r
    beside = climber.machine.arm.tip_lateral
    bucket = np.array([course.held[0], course.way * beside, climber.edge[1]])
    held_z = course.held[1] - climber.edge[0]
    lines, z = np.zeros((m, 2, 3)), np.zeros((m, 2))
    if course.way > 0:
        rear = rear_wheel(course.x, course.alpha, a, r)
        lines[:, 0, 0], lines[:, 0, 2] = rear, wide
        lines[:, 1] = bucket
        z[:, 1] = held_z
        return lines, z, (rear, rear)
    lines[:, 0] = bucket
    low = np.maximum(course.x - a, 0.0)
    high = np.where(course.alpha > 1e-9, 0.0, course.x + a)
    lines[:, 1, 0], lines[:, 1, 2] = np.maximum(high, 0.0), wide
    z[:, 0], z[:, 1] = held_z, step.height
    return lines, z, (np.where(course.alpha > 1e-9, 0.0, low), np.maximum(high, 0.0))


def judge(
    climber: Climber,
    step: Step,
    parameters: Parameters,
    spline: Spline | None = None,
    rows: int = ROWS,
    own: Sweep | None = None,
    names: tuple[str, ...] = SEQUENCES,
) -> tuple[Verdict, tuple[Sequence, ...]]:
    """What holds, with the three sequences; these are empty where alpha_f is impossible.

    own: of `own_bodies`, made once for many parameters; own bodies are not looked at when None.
    names: of the sequences that are judged.
    """
    low, high = leans(step.height, climber.a, climber.r)
    if not low - ROUNDING <= parameters.alpha_f <= high + ROUNDING:
        why = (
            f"a lean of {np.degrees(parameters.alpha_f):.2f} degrees is impossible: the edge is "
            f"under the front half of the crawler from {np.degrees(low):.2f} to "
            f"{np.degrees(high):.2f} degrees"
        )
        off = min(parameters.alpha_f - low, high - parameters.alpha_f)
        return Verdict(off, off, off, off, off, off, off, kind="reach", why=why), ()
    u = np.linspace(0.0, 1.0, rows)
    made = tuple(
        worked_out(climber, step, name, course_of(name, climber, step, parameters, u, spline))
        for name in names
    )
    demands, machine = climber.demands, climber.machine
    reach, joints, crawler, bodies, torque, tips = (np.inf,) * 6
    own_left = np.inf
    for one in made:
        reach = min(reach, _reach(climber, one))
        q = one.joints.q
        joints = min(joints, float(np.minimum(q - machine.lower, machine.upper - q).min()))
        crawler = min(crawler, float(_belts(climber, step, one.course).min()))
        bodies = min(bodies, _bodies(climber, step, one))
        shares = np.abs(one.loads.torques) / demands.torques
        torque = min(torque, 1.0 - float(shares.max()))
        tips = min(tips, float(one.margin.min()) - demands.margin)
        if own is not None:
            own_left = min(own_left, own.least_along(q)[0] - OWN * small(climber))
    bodies = min(bodies, own_left)
    slip = demands.friction - float(np.tan(parameters.alpha_f))
    values = (reach, joints, crawler, bodies, tips, torque, slip)
    kind, why = _words(values, climber, step, parameters)
    energy = sum(slow_energy(s.loads, s.joints.q, s.course.belt, demands.friction) for s in made)
    return Verdict(*values, energy=float(energy), kind=kind, why=why), made


def own_bodies(climber: Climber) -> Sweep:
    """Pairs of the machine's own bodies."""
    return make_sweep(climber.machine, Obstacles(ground=False), OWN)


def small(climber: Climber) -> float:
    """Small machines keep less from themselves: by their arm, of two metres or more."""
    return min(1.0, climber.machine.max_reach / 2.0)


def _reach(climber: Climber, one: Sequence) -> float:
    """What is left of (22) and (23), as a share of the arm's length."""
    _, l2, l3, _ = climber.machine.sun.lengths
    T, course = one.joints.T, one.course
    pivot = _boom_pivot(climber, T, course.way)
    l4 = climber.machine.sun.lengths[3]
    phi = climber.demands.attitude
    joint = course.held - l4 * np.array([course.way * np.cos(phi), np.sin(phi)])
    length = np.linalg.norm(joint - pivot, axis=1)
    left = np.minimum(l2 + l3 - length, length - abs(l2 - l3))
    return float(left.min()) / (l2 + l3)


def _boom_pivot(climber: Climber, T: Array, way: int) -> Array:
    """(m, 2) x, z of the boom's joint with the arm ahead or behind."""
    arm, f = climber.machine.arm, climber.demands.facing
    l1 = climber.machine.sun.lengths[0]
    ahead = way * f
    swing = arm.T_root_swing
    p = swing[:3, 3] + swing[:3, :3] @ np.array([ahead * l1, 0.0, arm.pivot_height])
    placed = np.einsum("mij,j->mi", T[:, :3, :3], p) + T[:, :3, 3]
    return np.asarray(placed[:, [0, 2]])


def _belts(climber: Climber, step: Step, course: Course) -> Array:
    return belt_clearance(course.x, course.z, course.alpha, step.height, climber.a, climber.r)


def _bodies(climber: Climber, step: Step, one: Sequence) -> float:
    """What is left of the clearance; the bucket's own bodies stand on the ground."""
    placed = climber.bodies(one.joints.T, one.joints.q)[..., [0, 2]]
    left = body_clearance(placed, step.height).min(axis=0)
    asked = np.where(climber.of_bucket, -SUNK, climber.demands.clearance)
    return float((left - asked).min())


def _words(
    values: tuple[float, ...], climber: Climber, step: Step, parameters: Parameters
) -> tuple[str, str]:
    """The first that does not hold, in the order in which they are asked."""
    reach, joints, crawler, bodies, tips, torque, slip = values
    demands = climber.demands
    if reach < 0.0:
        return "reach", "the arm does not reach from the crawler to the bucket all the way"
    if joints < -ROUNDING:
        return "reach", f"a joint would have to go {np.degrees(-joints):.1f} degrees past its end"
    if crawler < -1e-6:
        return "collision", f"the crawler would be {-crawler:.3f} m inside the step"
    if bodies < 0.0:
        return (
            "collision",
            f"a body would come {demands.clearance + bodies:.3f} m near to step, ground or another "
            f"body, nearer than allowed",
        )
    if tips < 0.0:
        left = demands.margin + tips
        return "stability", f"it would come within {left:.3f} m of tipping over"
    if torque < 0.0:
        return "torque", f"a joint would need {100.0 * (1.0 - torque):.0f} % of its torque"
    if slip < 0.0:
        return "stability", "it would slide off the edge: the lean is steeper than friction holds"
    return "", ""
